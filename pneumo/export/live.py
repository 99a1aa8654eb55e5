"""Page of a cylinder in the browser: exported C of every model and of the full order, as WebAssembly."""

import base64
import json
import shutil
from pathlib import Path
from typing import NamedTuple

from pneumo.configuration.experiment import MOST_HALVINGS, Plant
from pneumo.equations.system import FULL_ORDER, System, system
from pneumo.errors import InputError
from pneumo.export.c_source import TEMPLATES, c99, compiled
from pneumo.export.printing import printed
from pneumo.physics.models import MODELS
from pneumo.simulation.runge_kutta import STEP_TOLERANCE

MOST_STEPS = 1000  # in one call
MOST_PARTS = 2**MOST_HALVINGS  # of a step
EXPORTED = ("take_defaults", "start", "advance")
FLAGS = ["--target=wasm32", "-std=c99", "-O3", "-ffreestanding", "-nostdlib", "-fno-math-errno", "-I."]
PLACES = ("parameters", "state", "pressures", "squares", "commands")
# clang has no headers for this target: roots and absolute values are its instructions, powers the browser's.
MATH_H = """\
double pow(double x, double y);
static inline double sqrt(double x) { return __builtin_sqrt(x); }
static inline double fabs(double x) { return __builtin_fabs(x); }
#define HUGE_VAL __builtin_huge_val()
"""


class Module(NamedTuple):
    """WebAssembly, and the names of each model's parameters in the order of its struct."""

    code: bytes
    parameters: dict[str, list[str]]


def sources(plant: Plant, n: float) -> tuple[dict[str, str], list[System]]:
    """Files in C of all models of `MODELS` at n and the full order with its piston, and these systems."""
    systems = [system(model, n, plant) for model in MODELS.values()]
    systems.append(system(FULL_ORDER, None, plant, piston=True))
    names, files = [chosen.name for chosen in systems], dict[str, str]()
    for chosen in systems:
        files |= c99(chosen, chosen.name)
        del files[f"{chosen.name}_test.c"]
    known = {"names": names, "most_steps": MOST_STEPS, "most_parts": MOST_PARTS, "tolerance": STEP_TOLERANCE}
    files["live.c"] = TEMPLATES.get_template("live.c.j2").render(known)
    return files, systems


def module(plant: Plant, n: float) -> Module:
    """Compile the `sources` to WebAssembly.

    Raises
    ------
    InputError
        If clang or its linker for WebAssembly is not installed, or refuses the source.
    """
    for tool, package in {"clang": "clang", "wasm-ld": "lld"}.items():
        if shutil.which(tool) is None:
            raise InputError(f"{tool}: not installed, so that there is no page; `apt-get install {package}`")
    files, systems = sources(plant, n)
    wanted = [*EXPORTED, *(f"place_of_{name}" for name in PLACES)]
    linked = ["--no-entry", "--allow-undefined", "--strip-all", *(f"--export={name}" for name in wanted)]
    command = ["clang", *FLAGS, *(f"-Wl,{flag}" for flag in linked)]
    code = compiled(command, files | {"math.h": MATH_H}, "live.wasm")
    return Module(code, {s.name: [c.name for c in printed(s).constants] for s in systems})


def live_page(plant: Plant, n: float, folder: Path) -> str:
    """Page with everything in it, from the HTML, CSS and JavaScript in a folder."""
    compiled = module(plant, n)
    page = (folder / "live.html").read_text(encoding="utf-8")
    inside = {
        "/* live.css */": (folder / "live.css").read_text(encoding="utf-8"),
        "/* live.js */": (folder / "live.js").read_text(encoding="utf-8"),
        "LAYOUT": json.dumps({"parameters": compiled.parameters, "most_steps": MOST_STEPS}),
        "WASM": base64.b64encode(compiled.code).decode(),
    }
    for mark, content in inside.items():
        page = page.replace(mark, content)
    return page
