"""C99: a model's rates and steps with header and test program, without allocation."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from sympy.codegen.ast import float32, real
from sympy.printing.c import C99CodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Statement
from pneumo.equations.system import METHODS, System, step
from pneumo.errors import InputError
from pneumo.export.printing import Printed, assignments, block, digits, heading, printed
from pneumo.linear.linear_analysis import STABLE_RANGE, stable_steps

KEYWORDS = ("if ({}) {{", "}} else if ({}) {{", "} else {", "}")
TOLERANCE = {  # of the test program, relative
    "double": 1e-12,  # some hundred roundings of 1.1e-16
    "float": 1e-4,  # the same of 6e-8, and rates that cancel
}
TEMPLATES = Environment(
    loader=PackageLoader("pneumo.export"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
    autoescape=False,
)


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
    """Printer that knows the constants of a system."""
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
    """Content of `output`, compiled from C in a temporary folder; `InputError` if the compiler refuses it."""
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
    """An expression whose sign changes where the rates have a kink."""

    expression: str
    meaning: str


def c99(system: System, stem: str, precision: str = "double", kinks: tuple[Kink, ...] = ()) -> dict[str, str]:
    """Files of a system in C: source, header and test program, by their names."""
    parts, suffix = printed(system), "f" if precision == "float" else ""
    printer, stable = printer_of(parts, precision), stable_steps(system)
    tableaus = {
        name: {
            "stages": len(t.b),
            "A": ", ".join(_listed(t.A[i, :i], suffix) for i in range(1, len(t.b))),
            "b": _listed(t.b, suffix),
            "c": _listed(t.c, suffix),
        }
        for name, t in METHODS.items()
    }
    c = system.plant.conditions
    # By which the test program divides the error of each state.
    scale = system.state(x=system.plant.cylinder.stroke, v=1.0, P=c.P_atm, T=c.T_0)
    names = {"source": f"{stem}.c", "header": f"{stem}.h", "test": f"{stem}_test.c"}
    known = {
        **names,
        "M": system.name,
        "f": precision,
        "suffix": suffix,
        "zero": f".0{suffix}",
        "digits": digits,
        "heading": heading(system, " * "),
        "constants": parts.constants,
        "inputs": system.inputs,
        "states": system.states,
        "own_inputs": ["u" if system.valve else "m", "x", "v"],
        "own_states": list(system.chamber_states),
        "valve": system.valve,
        "chamber": _body(parts.chamber, precision, printer),
        "piston": _body(parts.piston, precision, printer),
        "stops": _body(parts.stops, precision, printer),
        "v_before": bool(system.plant.cylinder.coulomb),
        "methods": list(METHODS),
        "tableaus": tableaus,
        "most_stages": max(len(t.b) for t in METHODS.values()),
        "range": STABLE_RANGE,
        "stable": {name: f"{h:.3g}" for name, h in stable.items()},
        "kinks": kinks,
        "vectors": _vectors(system, min(1e-4, stable["EULER"]), suffix),
        "scale": "{" + _listed(scale, suffix) + "}",
        "tolerance": TOLERANCE[precision],
    }
    templates = {"source": "model.c.j2", "header": "model.h.j2", "test": "test.c.j2"}
    return {name: TEMPLATES.get_template(templates[key]).render(known) for key, name in names.items()}


def _vectors(system: System, h: float, suffix: str) -> list[dict[str, str]]:
    """Steps of every method from random states; with a piston also into a stop and at rest on it."""
    rng, c, cylinder = np.random.default_rng(2006), system.plant.conditions, system.plant.cylinder
    flow = 0.04 * system.plant.valve.k_xu * system.plant.valve.u_max * c.P_s / c.T_0**0.5
    most = {"u": 1.2 * system.plant.valve.u_max, "m": flow, "v": 1.0, "force": 100.0}
    most["x"] = 0.98 * min(cylinder.stroke / 2, -cylinder.x_min, cylinder.x_max)

    def draw(name: str) -> float:
        base = name.split("_")[0]
        low, high = {"P": (c.P_atm, c.P_s), "T": (0.8 * c.T_0, 1.2 * c.T_0)}.get(base, (-1.0, 1.0))
        return float(rng.uniform(low, high)) * most.get(base, 1.0)

    vectors = list[dict[str, str]]()
    for name, method in METHODS.items():
        for i in range(8):
            start, end = ([draw(quantity) for quantity in system.inputs] for _ in range(2))
            state = [draw(quantity) for quantity in system.states]
            if system.piston and i == 0:
                state[:2] = cylinder.x_max - h / 2, 1.0
            if system.piston and i == 1:
                state[:2] = cylinder.x_min, 0.0
                start[-1] = end[-1] = -1e4  # N: held whatever the pressures
            lists = {
                "start": start,
                "end": end,
                "before": state,
                "after": step(system, method, state, start, end, h),
            }
            texts = {key: "{" + _listed(values, suffix) + "}" for key, values in lists.items()}
            vectors.append(texts | {"method": name, "h": digits(h) + suffix})
    return vectors
