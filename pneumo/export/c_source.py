"""C99: a model's rates and steps with header and test program, without allocation."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from sympy.codegen.ast import float32, real
from sympy.printing.c import C99CodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Statement, with_tangents
from pneumo.equations.substep import LENGTHS, STAGE
from pneumo.equations.system import System
from pneumo.errors import InputError
from pneumo.export.known_steps import known_steps
from pneumo.export.observer_noise import CONSTANTS, FIRST_VARIANCES, STEPS, ObserverNoise
from pneumo.export.printing import TEMPLATES, Printed, assignments, block, digits, heading, printed
from pneumo.linear.observer import FIRST_PRESSURE
from pneumo.physics.cylinder import Side

KEYWORDS = ("if ({}) {{", "}} else if ({}) {{", "} else {", "}")
PISTON_VARIABLES = ("x", "v", "P_A", "P_B", "force")
TOLERANCE = {  # of the test program, relative
    "double": 1e-12,  # some hundred roundings of 1.1e-16
    "float": 1e-4,  # the same of 6e-8, and rates that cancel
}


class _C(C99CodePrinter):
    """Prints a system's constants as members of the struct of parameters."""

    def __init__(self, precision: str, parameters: set[str]) -> None:
        super().__init__(
            {"math_macros": {}} | ({"type_aliases": {real: float32}} if precision == "float" else {})
        )
        self.suffix, self.parameters = "f" if precision == "float" else "", parameters

    def _print_Float(self, flt: Any) -> str:
        return digits(float(flt)) + self.suffix

    def _print_Symbol(self, expr: Any) -> str:
        name = super()._print_Symbol(expr)
        return f"p->{name}" if name in self.parameters else name


def printer_of(parts: Printed, precision: str = "double") -> _C:
    """SymPy printer of C in which a system's constants are members of its struct of parameters."""
    return _C(precision, {constant.name for constant in parts.constants})


def _body(statements: list[Statement], precision: str, printer: _C) -> str:
    lines = list[str]()
    for s in statements:
        pattern = f"const {precision} {{}} = {{}}; /* {s.comment} */"
        if isinstance(s.value, Choice):
            lines.append(f"{precision} {', '.join(s.names)}; /* {s.comment} */")
            pattern = "{} = {};"
        lines += assignments(s.names, s.value, pattern, printer, KEYWORDS)
    return block(lines)


def _listed(values: Any, suffix: str) -> str:
    return ", ".join(digits(float(value)) + suffix for value in values)


def compiled(
    command: Sequence[str], files: dict[str, str], output: str, libraries: Sequence[str] = ()
) -> bytes:
    """Compile C files in a temporary folder and return the content of the file `output`.

    `command` is the compiler with its options; `files` has the text of each file by its name. `InputError` if
    the compiler refuses them.
    """
    with TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        sources = [name for name in files if name.endswith(".c")]
        words = [*command, "-o", output, *sources, *libraries]
        ran = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        if ran.returncode:
            raise InputError(f"{command[0]}: {ran.stderr.strip().splitlines()[0]}")
        return (Path(folder) / output).read_bytes()


class Kink(NamedTuple):
    """An expression in C whose sign changes where the rates have a kink or jump, and its meaning."""

    expression: str
    meaning: str


def c99(
    system: System,
    stem: str,
    precision: str = "double",
    kinks: tuple[Kink, ...] = (),
    *,
    derivatives: bool = False,
    noise: ObserverNoise | None = None,
) -> dict[str, str]:
    """Files of a system in C99: source, header and test program, by their names.

    With `kinks` the source also has a function that evaluates them; with `derivatives`, one for directional
    derivatives of the rates; with `noise`, the observer that assumes this noise.
    """
    parts = printed(system, CONSTANTS if noise else ())
    suffix = "f" if precision == "float" else ""
    printer, substep = printer_of(parts, precision), parts.substep
    names = {"source": f"{stem}.c", "header": f"{stem}.h", "test": f"{stem}_test.c"}
    known: dict[str, Any] = {
        **names,
        "M": system.name,
        "f": precision,
        "suffix": suffix,
        "digits": digits,
        "heading": heading(system, " * "),
        "constants": parts.constants,
        "inputs": system.inputs,
        "states": system.states,
        "openings": system.openings,
        "own_flows": system.flow_inputs,
        "own_inputs": [*system.flow_inputs, "x", "v"],
        "own_states": list(system.chamber_states),
        "chambers": {
            side.name: {
                "sign": "" if side.sign > 0 else "-",
                "flows": [("-" if sign < 0 else "", name) for sign, name in system.flows(side).values()],
                "constants": list(system.of_chambers[side.name].values()),
            }
            for side in Side
        },
        "own_constants": list(system.of_chambers["A"]),
        "opened": _body(parts.valve, precision, printer),
        "chamber": _body(parts.chamber, precision, printer),
        "piston": _body(parts.piston, precision, printer),
        "stops": _body(parts.stops, precision, printer) if noise else "",
        "v_before": bool(system.plant.cylinder.coulomb),
        "substep": {name: _body(part, precision, printer) for name, part in substep._asdict().items()},
        "lengths": {name: f"{value:g}{suffix}" for name, value in LENGTHS.items()},
        "stage": digits(STAGE) + suffix,
        "kinks": kinks,
        "derivatives": derivatives,
        "noise": noise,
        "opened_changes": "",
        "chamber_changes": "",
        "piston_changes": "",
        "vectors": _vectors(system, suffix),
        "scale": "{" + _listed(system.scale, suffix) + "}",
        "tolerance": TOLERANCE[precision],
    }
    if derivatives:
        moving = {*known["own_inputs"], *system.chamber_states}
        changes = {
            "opened_changes": with_tangents(parts.valve, {*system.inputs, *system.states}),
            "chamber_changes": with_tangents(parts.chamber, moving),
            "piston_changes": with_tangents(parts.piston, set(PISTON_VARIABLES)),
        }
        known |= {key: _body(changed, precision, printer) for key, changed in changes.items()}
    if noise:
        known |= {
            "steps": {name: digits(value) + suffix for name, value in STEPS.items()},
            "first": {name: digits(value) + suffix for name, value in FIRST_VARIANCES.items()},
            "temperature": "T" in system.chamber_states,
            "places": [f"{system.name}_{name}" for name in noise.readings],
            "first_pressure": f"{FIRST_PRESSURE:g}",
        }
    templates = {"source": "model.c.j2", "header": "model.h.j2", "test": "test.c.j2"}
    return {names[key]: TEMPLATES.get_template(name).render(known) for key, name in templates.items()}


def _vectors(system: System, suffix: str) -> list[dict[str, str]]:
    """Steps with known results (`known_steps`) as initialisers in C; `suffix` follows every number."""
    return [
        {
            key: "{" + _listed(value, suffix) + "}"
            for key, value in known._asdict().items()
            if type(value) is list
        }
        | {"h": digits(known.h) + suffix}
        for known in known_steps(system)
    ]
