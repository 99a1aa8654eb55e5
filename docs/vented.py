"""Page vented.md: one stroke from vented to rest by Python, C, Structured Text, FMU and WebAssembly."""

import ctypes
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from fmpy import simulate_fmu
from matplotlib.figure import Figure

from benchmarks.exported_strokes import template_plant
from paper.study.text.markdown_tables import markdown_table as table
from pneumo import simulate
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import Sources, plant_of
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.equations.system import FULL_ORDER
from pneumo.export import exported, write_files
from pneumo.publish.style import METADATA, new_figure, paper_style
from pneumo.selection.cylinder_template import TEMPLATE

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from structured_text import Block, parsed  # pyright: ignore[reportMissingImports]

PICTURE = Path(__file__).parent / "static/vented.svg"
STATES = ("x", "v", "P_A", "T_A", "P_B", "T_B")
H, STEPS, SHOWN, FINE = 1e-3, 600, 200, 100  # s; steps; of these in the picture; of the reference in one
DRIVER = """\
#include "full.h"
#ifdef __wasm__
#define EXPORT __attribute__((export_name("run")))
#else
#define EXPORT
#endif
static double states[%(steps)d + 1][full_STATES] = {{%(start)s}};
EXPORT double *run(void)
{
    const double inputs[] = {full_defaults.u_max, 0};
    for (int k = 0; k < %(steps)d; k++) {
        for (int i = 0; i < full_STATES; i++)
            states[k + 1][i] = states[k][i];
        if (full_step(&full_defaults, inputs, inputs, %(h)r, states[k + 1]))
            return 0;
    }
    return states[0];
}
"""
MATH = """\
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define pow(x, two) ((x) * (x)) /* with the flow of ISO 6358 all powers are squares */
"""
NODE = """
WebAssembly.instantiate(require("fs").readFileSync("full.wasm")).then(({instance: {exports}}) =>
  process.stdout.write(Buffer.from(exports.memory.buffer, exports.run(), %d)));
"""


def by_python(plant: Plant, start: np.ndarray, fine: int = 1) -> np.ndarray:
    """States by `pneumo.simulate`, whose steps are `fine` times shorter."""
    u = np.full(fine * STEPS + 1, plant.valve.u_max)
    return simulate(plant, H / fine, command=u, start=tuple(start)).recording.states[::fine]  # pyright: ignore[reportArgumentType]


def _sources(plant: Plant, start: np.ndarray, folder: Path) -> list[str]:
    write_files(exported(FULL_ORDER, None, plant, "c", piston=True), folder)
    text = DRIVER % {"steps": STEPS, "start": ", ".join(map(repr, start.tolist())), "h": H}
    (folder / "driver.c").write_text(text, encoding="utf-8")
    return ["full.c", "driver.c"]


def by_c(plant: Plant, start: np.ndarray, folder: Path) -> np.ndarray:
    """States by the exported C, compiled by gcc."""
    sources = _sources(plant, start, folder)
    subprocess.run(
        ["gcc", "-O2", "-shared", "-fPIC", "-o", "full.so", *sources, "-lm"], cwd=folder, check=True
    )
    run = ctypes.CDLL(str(folder / "full.so")).run
    run.restype = ctypes.POINTER(ctypes.c_double * (len(STATES) * (STEPS + 1)))
    return np.array(run().contents).reshape(-1, len(STATES))


def by_webassembly(plant: Plant, start: np.ndarray, folder: Path) -> np.ndarray:
    """States by the same C, compiled by clang to WebAssembly and run by Node."""
    sources = _sources(plant, start, folder)
    (folder / "math.h").write_text(MATH, encoding="utf-8")
    flags = ["--target=wasm32", "-O2", "-ffreestanding", "-nostdlib", "-I.", "-Wl,--no-entry"]
    subprocess.run(["clang", *flags, *sources, "-o", "full.wasm"], cwd=folder, check=True)
    script = NODE % (8 * len(STATES) * (STEPS + 1))
    ran = subprocess.run(["node", "-e", script], cwd=folder, check=True, capture_output=True)
    return np.frombuffer(ran.stdout).reshape(-1, len(STATES))


def by_structured_text(plant: Plant, start: np.ndarray, folder: Path) -> np.ndarray:  # noqa: ARG001
    """States by the exported function block, interpreted by the tests' interpreter."""
    text = exported(FULL_ORDER, None, plant, "st", piston=True)["full.st"].decode()
    block, states = Block(*parsed(text)), list[list[float]]()
    inputs = {"u": plant.valve.u_max, "h": H}
    inputs |= {f"{name}_start".lower(): float(value) for name, value in zip(STATES, start, strict=True)}
    for _ in range(STEPS + 1):
        block(**inputs)
        states.append([block[name] for name in STATES])
    return np.array(states)


def by_fmu(plant: Plant, start: np.ndarray, folder: Path) -> np.ndarray:
    """States by the FMU in co-simulation, run by fmpy."""
    ((_, content),) = exported(FULL_ORDER, None, plant, "fmu", piston=True).items()
    (folder / "full.fmu").write_bytes(content)
    signals = [("time", float), ("u", float), ("force", float)]
    starts: dict[str, float] = dict(zip(STATES, map(float, start), strict=True))
    result = simulate_fmu(
        str(folder / "full.fmu"),
        input=np.array([(0.0, plant.valve.u_max, 0.0)], dtype=signals),
        stop_time=STEPS * H,
        output_interval=H,
        start_values=starts,
        output=STATES,
    )
    return np.column_stack([result[name] for name in STATES])


EXPORTS: dict[str, Callable[[Plant, np.ndarray, Path], np.ndarray]] = {
    "C": by_c,
    "Structured Text": by_structured_text,
    "FMU": by_fmu,
    "WebAssembly": by_webassembly,
}


def strokes() -> dict[str, np.ndarray]:
    """States of the same stroke by every program, in steps of 1 ms; the reference is first."""
    plant = template_plant()
    c = plant.conditions
    start = np.array([plant.cylinder.x_min, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb])
    made = {"reference": by_python(plant, start, FINE), "Python": by_python(plant, start)}
    for name, run in EXPORTS.items():
        with TemporaryDirectory() as folder:
            made[name] = run(plant, start, Path(folder))
    return made


@paper_style()
def figure(made: dict[str, np.ndarray]) -> Figure:
    """Draw position, pressures and temperatures of all programs over each other."""
    fig = new_figure(150, 75)
    axes = fig.subplots(1, 3)
    t = 1e3 * H * np.arange(SHOWN + 1)
    styles = dict(zip(made, ("-", "--", "-.", ":", (0, (1, 3)), (0, (4, 4))), strict=True))
    for name, states in made.items():
        looks = {"ls": styles[name], "lw": 1.0}
        looks |= {"lw": 2.4, "color": "0.75"} if name == "reference" else {}
        for ax, columns, scale in zip(axes, ([0], [2, 4], [3, 5]), (1e3, 1e-3, 1.0), strict=True):
            lines = ax.plot(t, scale * states[: SHOWN + 1, columns], **looks)
            lines[0].set_label(name)
            lines[-1].set_color(lines[0].get_color())
    for ax, label in zip(axes, ("$x$ (mm)", "$P_A$, $P_B$ (kPa)", "$T_A$, $T_B$ (K)"), strict=True):
        ax.set(xlabel="t (ms)", ylabel=label, xlim=(0, t[-1]))
    axes[0].legend()
    return fig


def _stroke_time(x: np.ndarray) -> float:
    """Time at which the piston has reached its stop, ms."""
    return 1e3 * H * int(np.argmax(x >= x[-1]))


def compared(made: dict[str, np.ndarray]) -> str:
    """Table of the largest differences from the reference, up to the stop and at rest after it."""
    reference, cells = made["reference"], list[list[str]]()
    for name, states in made.items():
        off = np.abs(states - reference)
        row = [f"{off[:, columns].max() * scale:.2g}" for columns, scale in (([2, 4], 1e-3), ([3, 5], 1.0))]
        rest = [f"{off[-1, columns].max() * scale:.1g}" for columns, scale in (([2, 4], 1e-3), ([3, 5], 1.0))]
        cells.append([name, f"{_stroke_time(states[:, 0]):.0f}", *row, *rest])
    heads = ["stroke (ms)", "off by (kPa)", "(K)", "after 0.6 s by (kPa)", "(K)"]
    return table(["1 ms steps of", *heads], cells[1:])


# Name, bore, stroke and rod in mm, moving mass in kg, Cv of the valve
CYLINDERS = (
    ("ISO 6432, 12 x 50 mm, 0.2 kg", 12, 50, 6, 0.2, 0.1),
    ("ISO 15552, 32 x 200 mm, 5 kg", 32, 200, 12, 5.0, 0.6),
    ("ISO 15552, 100 x 500 mm, 60 kg", 100, 500, 25, 60.0, 3.0),
)
SUPPLY, PSI, INCH, ATMOSPHERE = 90.0, 6894.76, 0.0254, 101325.0  # psi on the gauge; Pa; m; Pa
COMPRESSION, DROP = 7.1, 35.5  # the formula's factors at 90 psi, for a drop of 15 psi
DRY, VISCOUS = 0.05, 0.1  # friction over the force of the supply: Coulomb; viscous, at 1 m/s
DEAD = 0.1  # dead volume over swept volume, tubes included


def stroke_times() -> str:
    """Table of stroke times of three catalogue cylinders, by a manufacturer's formula and simulated."""
    cells, template = list[list[str]](), read_yaml(TEMPLATE)
    for name, bore, stroke, rod, mass, Cv in CYLINDERS:
        area, length = np.pi * (bore * 1e-3) ** 2 / 4, stroke * 1e-3
        formula = area / INCH**2 * length / INCH * COMPRESSION / (DROP * Cv * 29)
        force = area * SUPPLY * PSI
        sizes = {"bore_mm": bore, "stroke_mm": stroke, "rod_mm": rod, "mass_kg": mass, "valve": {"Cv": Cv}}
        sizes |= {"coulomb_N": DRY * force, "friction_Ns_per_m": VISCOUS * force}
        sizes |= {"dead_volume_m3": DEAD * area * length}
        content = template | {"cylinders": {"mine": template["cylinders"]["mine"] | sizes}}
        content["supply"] = template["supply"] | {"P_s_Pa": ATMOSPHERE + SUPPLY * PSI, "P_atm_Pa": ATMOSPHERE}
        plant = plant_of(Sources(content).validated(), "open")
        command = np.full(3001, plant.valve.u_max)
        runs = [simulate(plant, H, command=command, start=start) for start in ("vented", "retracted")]
        first, usual = (run.strokes[0].time for run in runs)
        cells.append([name, f"{Cv:g}", *(f"{1e3 * time:.0f}" for time in (formula, first, usual))])
    return table(["cylinder", "Cv", "formula (ms)", "from vented (ms)", "from retracted (ms)"], cells)


def tables() -> dict[str, str]:
    """Tables of vented.md; the picture is drawn beside them."""
    made = strokes()
    with paper_style():
        figure(made).savefig(PICTURE, metadata=METADATA["svg"])
    return {"table_programs": compared(made), "table_times": stroke_times()}
