"""Text common to all targets: numbers, the heading, assignments with their branches."""

from collections.abc import Iterable
from importlib.metadata import version
from textwrap import wrap
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from sympy import Symbol
from sympy.printing.codeprinter import CodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import (
    Constant,
    Equations,
    Statement,
    chamber_equations,
    constants,
    names_in,
    piston_equations,
    statements,
    stop_equations,
    symbolic,
    symbols_of,
    valve_equations,
)
from pneumo.equations.substep import chamber_pace, chamber_substep, piston_after, piston_before
from pneumo.equations.system import System, closed_drift, quantity
from pneumo.physics.cylinder import Side
from pneumo.storage.files import DOI

TEMPLATES = Environment(
    loader=PackageLoader("pneumo.export"),
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
    autoescape=False,
)


def printed(system: System, also: Iterable[str] = ()) -> tuple[dict[str, list[Statement]], list[Constant]]:
    """Symbolic assignments of a system, by its parts, and the constants that they need and of `also`.

    Rates have the parts valve, chamber, piston and stops; a substep has before, opened, moved and after; its
    length has flows and pace. Those of an absent valve or piston are empty.
    """
    plant, dynamics, n = symbols_of(system.plant), symbolic(system.dynamics, "valve_"), Symbol("n", real=True)
    model, valve, own = system.model, system.valve, system.chamber_states
    flows = [outer for side in Side for _, outer in system.flows(side).values()]
    of_valve = valve_equations(plant, dynamics, system.two_valves)
    opened = valve_equations(plant, dynamics, system.two_valves, substep=True)
    met = ("x_after", "s_part", "stop", "F_before", "v_free")
    wanted: dict[str, tuple[bool, Equations, Iterable[str]]] = {
        "valve": (valve, of_valve, [*flows, *(f"d{name}_dt" for name in system.openings)]),
        "chamber": (True, chamber_equations(model, n, plant, valve), (f"d{name}_dt" for name in own)),
        "piston": (system.piston, piston_equations(plant), ("dx_dt", "dv_dt")),
        "stops": (system.piston, stop_equations(plant), ("x_after", "v_after")),
        "before": (system.piston, piston_before(plant), met),
        "opened": (valve, opened, [*flows, *(f"{name}_after" for name in system.openings)]),
        "moved": (True, chamber_substep(model, n, plant, valve), (f"{name}_after" for name in own)),
        "after": (system.piston, piston_after(plant), ("v_after",)),
        "flows": (valve, of_valve, flows),
        "pace": (True, chamber_pace(plant, valve), ("pace",)),
    }
    parts = {part: statements(of, {*names}) if there else [] for part, (there, of, names) in wanted.items()}
    needed = names_in(tuple(s.value for part in parts.values() for s in part))
    needed |= {name for names in system.of_chambers.values() for name in names.values()}.union(also)
    known = constants(system.plant, system.n, system.dynamics)
    return parts, [constant for constant in known if constant.name in needed]


def known_to_all(system: System, mark: str = "") -> dict[str, Any]:
    """What templates of every target use; `mark` begins each line of the heading."""
    return {
        "M": system.name,
        "heading": heading(system, mark),
        "digits": digits,
        "inputs": system.inputs,
        "states": system.states,
        "rates": [f"d{name}_dt" for name in system.states],
        "openings": system.openings,
        "own_flows": system.flow_inputs,
        "own_inputs": [*system.flow_inputs, "x", "v"],
        "own_states": [*system.chamber_states],
        "own_constants": [*system.of_chambers["A"]],
        "chambers": {
            side.name: {
                "sign": "-" * (side.sign < 0),
                "flows": [("-" * (sign < 0), name) for sign, name in system.flows(side).values()],
                "constants": list(system.of_chambers[side.name].values()),
            }
            for side in Side
        },
    }


def digits(value: float) -> str:
    """A number as text with 17 significant digits, which determine a double, and a decimal point."""
    text = f"{value:.17g}"
    return text if set(".en") & set(text) else text + ".0"


def heading(system: System, mark: str = "") -> str:
    """Comment: system (line 1, also of FMUs), units and range of validity; each line begins with `mark`."""
    model, dead_time = system.model, system.valve and system.dynamics.dead_time
    index = f" at n = {system.n:g}" if model and model.has_n else ""
    cylinder = "a servo-pneumatic cylinder"
    text = TEMPLATES.get_template("heading.j2").render(
        subject=f"{cylinder} with its piston" if system.piston else f"both chambers of {cylinder}",
        which=f"model {model.name}{index}" if model else "the full order, eqs (4), (5)",
        doi=DOI,
        version=version("pneumo"),
        inputs=system.inputs,
        states=system.states,
        quantities={name: quantity(name) for name in (*system.inputs, *system.states)},
        half=system.plant.cylinder.stroke / 2,
        c=system.plant.conditions,
        limits=wrap(validity(system), 90),
        dead_time=dead_time,
        sag=system.valve and system.plant.sag,
    )
    return "\n".join((mark + line).rstrip() for line in text.rstrip().split("\n"))


def validity(system: System) -> str:
    """Sentence that says where a model does not hold; empty for most."""
    drift, P_0 = closed_drift(system), system.plant.conditions.P_0
    if drift is None:
        return ""
    return (
        f"{system.model_name} holds near P_0 = {P_0:.4g} Pa only. Do not start it vented, nor hold with the "
        "valve shut: a closed chamber drifts to P_0, from atmospheric pressure in mid-stroke at "
        f"{1e-3 * drift:.3g} kPa/s."
    )


def indented(lines: list[str]) -> list[str]:
    """Lines one level further right."""
    return ["    " + line for line in lines]


def assignments(
    names: tuple[str, ...], value: Any, pattern: str, printer: CodePrinter, keywords: tuple[str, ...]
) -> list[str]:
    """Lines of source code that assign values to names; a `Choice` becomes nested if and else.

    `pattern` is an assignment with {} for name and value. `keywords` are four lines of a choice: before its
    first branch, before each further one, before the last, and after the last; {} takes the condition.
    """
    if not isinstance(value, Choice):
        values = value if isinstance(value, tuple) else (value,)
        return [pattern.format(name, printer.doprint(v)) for name, v in zip(names, values, strict=True)]
    lines: list[str] = []
    opening, further, otherwise, end = keywords
    while isinstance(value, Choice):
        lines.append(opening.format(printer.doprint(value.condition)))
        lines += indented(assignments(names, value.yes, pattern, printer, keywords))
        value, opening = value.no, further
    return [*lines, otherwise, *indented(assignments(names, value, pattern, printer, keywords)), end]
