"""Page of a cylinder in the browser: exported C of every model and of the full order, as WebAssembly."""

import base64
import json
import math
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pneumo.configuration.experiment import MOST_HALVINGS, Plant, Study
from pneumo.equations.system import FULL_ORDER, System, system
from pneumo.errors import InputError
from pneumo.export.c_source import TEMPLATES, c99, compiled
from pneumo.export.printing import digits, printed
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import STEP_TOLERANCE
from pneumo.simulation.tableau import DORMAND_PRINCE, EMBEDDED_DIFFERENCE, STAGES

MOST_STEPS = 1000  # in one call
EXPORTED = ("take_defaults", "start", "advance", "start_record", "replay_record", "study_run")
FLAGS = [
    "--target=wasm32",
    "-std=c99",
    "-O3",
    "-flto",
    "-ffreestanding",
    "-nostdlib",
    "-fno-math-errno",
    "-I.",
]
PLACES = ("parameters", "state", "pressures", "squares", "commands", "record", "replayed", "errors")
GAS = "gas"  # the full order's chambers without the piston
TOOLS = {"clang": "clang", "wasm-ld": "lld"}  # program -> Debian's package
TYPICAL_K_0 = 0.5  # W/K
TERMS = 14  # of the series of logarithm and exponential
DEAD_PER_SWEPT = 0.05  # dead volume over swept volume, as of both cylinders of the paper


class Module(NamedTuple):
    """A WebAssembly module, with the parameters of its models."""

    code: bytes
    parameters: dict[str, list[str]]  # of each model, in their order in the C struct
    defaults: dict[str, float]  # of the full order with its piston, in SI units


def sources(plant: Plant, *n: float) -> tuple[dict[str, str], list[System]]:
    """C files of all reduced models, of the full order, and of the full order without piston; their systems.

    The models have the polytropic index n. If several n are given, the C function for runs of a study
    applies each of them to every model, and all other functions use the first.
    """
    systems = [system(model, n[0], plant) for model in MODELS.values()]
    systems.append(system(FULL_ORDER, None, plant, piston=True))
    names, files = [chosen.name for chosen in systems], dict[str, str]()
    systems.append(system(FULL_ORDER, None, plant))
    for chosen, name in zip(systems, [*names, GAS], strict=True):
        files |= _renamed(c99(chosen, name, tested=False), chosen.name, name)
    files["full.inc"] = files.pop("full.c")
    known = {"names": names, "most_steps": MOST_STEPS, "most_halvings": MOST_HALVINGS}
    known |= {"tolerance": STEP_TOLERANCE, "coulomb": plant.cylinder.coulomb, "indices": [*map(digits, n)]}
    known["with_n"] = [name for name, model in MODELS.items() if model.has_n]
    A, b, c = (np.vectorize(digits)(values).tolist() for values in DORMAND_PRINCE[:3])
    known |= {
        "A": A,
        "b": b,
        "c": c,
        "stages": STAGES,
        "difference": [digits(e) for e in EMBEDDED_DIFFERENCE],
    }
    files["live.c"] = TEMPLATES.get_template("live.c.j2").render(known)
    return files, systems


def _renamed(files: dict[str, str], old: str, new: str) -> dict[str, str]:
    """Copy of a system's C files in which the prefix of all names is another."""
    return {
        file: text.replace(f"{old}_", f"{new}_").replace(f"{old.upper()}_", f"{new.upper()}_")
        for file, text in files.items()
    }


def module(plant: Plant, *n: float) -> Module:
    """Compile the `sources` to WebAssembly.

    Raises
    ------
    InputError
        If clang or its linker for WebAssembly is not installed, or refuses the source.
    """
    for tool, package in TOOLS.items():
        if shutil.which(tool) is None:
            raise InputError(f"{tool}: not installed, so that there is no page; `apt-get install {package}`")
    files, systems = sources(plant, *n)
    wanted = [*EXPORTED, *(f"place_of_{name}" for name in PLACES)]
    linked = ["--no-entry", "--strip-all", *(f"--export={name}" for name in wanted)]
    command = ["clang", *FLAGS, *(f"-Wl,{flag}" for flag in linked)]
    series = {
        "over_odd": [digits(1 / (2 * i + 1)) for i in range(TERMS)],
        "over_factorial": [digits(1 / math.factorial(i)) for i in range(TERMS)],
    }
    files["math.h"] = TEMPLATES.get_template("wasm_math.h.j2").render(series)
    code = compiled(command, files, "live.wasm")
    names = [*(chosen.name for chosen in systems[:-1]), GAS]
    constants = [printed(s).constants for s in systems]
    by_model = {name: [c.name for c in each] for name, each in zip(names, constants, strict=True)}
    return Module(code, by_model, {c.name: c.value for c in constants[-2]})


def assembled(folder: Path, name: str, layout: Mapping[str, Any], compiled: Module) -> str:
    """HTML page `name` in one file, from its body and JavaScript in `folder`, with a layout and a module.

    The title is that of the body's heading.
    """
    page, body, style, script = (
        (folder / file).read_text(encoding="utf-8")
        for file in ("frame.html", f"{name}.html", "live.css", f"{name}.js")
    )
    inside = {
        "TITLE": body.partition("<h1>")[2].partition("</h1>")[0],
        "BODY": body,
        "/* live.css */": style,
        "SCRIPT": script,
        "LAYOUT": json.dumps(dict(layout) | {"parameters": compiled.parameters}),
        "WASM": base64.b64encode(compiled.code).decode(),
    }
    for mark, content in inside.items():
        page = page.replace(mark, content)
    return page


def installed() -> bool:
    """Whether clang and its linker for WebAssembly are installed."""
    return all(map(shutil.which, TOOLS))


def typical_plants(study: Study) -> dict[str, Plant]:
    """Plant of each cylinder of a study, from its experiment with the most typical k_0."""
    by_k_0 = sorted(study.experiments.values(), key=lambda e: -abs(math.log(e.plant.k_0 / TYPICAL_K_0)))
    return dict(sorted({e.cylinder: e.plant for e in by_k_0}.items()))


def live_page(
    plants: Mapping[str, Plant], n: float, folder: Path, colours: Mapping[str, tuple[str, str]]
) -> str:
    """HTML page that simulates a cylinder in the browser, in one file.

    It is put together from the HTML, CSS and JavaScript in `folder`. Its reader chooses one of the `plants`
    by name; `colours` has, by model, the colours on light and on dark ground.
    """
    compiled = module(next(iter(plants.values())), n)
    full = {name: system(FULL_ORDER, None, plant, piston=True) for name, plant in plants.items()}
    layout = {
        "most_steps": MOST_STEPS,
        "dead_per_swept": DEAD_PER_SWEPT,
        "plants": {name: {c.name: c.value for c in printed(each).constants} for name, each in full.items()},
        "colours": dict(colours),
    }
    return assembled(folder, "live", layout, compiled)
