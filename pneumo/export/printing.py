"""Text common to all targets: numbers, the heading, assignments with their branches."""

from collections.abc import Callable, Iterable
from importlib.metadata import version
from textwrap import wrap
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from sympy import Symbol
from sympy.printing.codeprinter import CodePrinter

from pneumo.configuration.experiment import Plant
from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import (
    Constant,
    Equation,
    Statement,
    chamber_equations,
    constants,
    names_in,
    piston_equations,
    statements,
    stop_equations,
    symbols_of,
    symbols_of_valve,
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


class Substep(NamedTuple):
    """Symbolic assignments of a substep, by `pneumo.equations.substep`; by its parts."""

    valve: list[Statement]
    before: list[Statement]
    chamber: list[Statement]
    after: list[Statement]
    opened: list[Statement]  # inputs of the pace
    pace: list[Statement]  # of one chamber


class Printed(NamedTuple):
    """Symbolic assignments of a system, by its parts, and the constants that they need."""

    valve: list[Statement]
    chamber: list[Statement]
    piston: list[Statement]
    stops: list[Statement]
    constants: list[Constant]
    substep: Substep


def printed(system: System, also: Iterable[str] = ()) -> Printed:
    """Symbolic assignments of a system; the lists for valve and piston are empty without one.

    `also` names further constants to include, beside those that the assignments need.
    """
    plant, dynamics, n = symbols_of(system.plant), symbols_of_valve(system.dynamics), Symbol("n", real=True)
    flows = {outer for side in Side for _, outer in system.flows(side).values()}

    def of_valve(wanted: Iterable[str], substep: bool = False) -> list[Statement]:
        if not system.valve:
            return []
        return statements(valve_equations(plant, dynamics, system.two_valves, substep), {*wanted})

    def of_piston(equations: Callable[[Plant], list[Equation]], *wanted: str) -> list[Statement]:
        return statements(equations(plant), {*wanted}) if system.piston else []

    def of_chamber(equations: list[Equation], pattern: str) -> list[Statement]:
        return statements(equations, {pattern.format(name) for name in system.chamber_states})

    substep = Substep(
        of_valve([*flows, *(f"{name}_after" for name in system.openings)], substep=True),
        of_piston(piston_before, "x_after", "s_part", "stop", "F_before", "v_free"),
        of_chamber(chamber_substep(system.model, n, plant, system.valve), "{}_after"),
        of_piston(piston_after, "v_after"),
        of_valve(flows),
        statements(chamber_pace(plant, system.valve), {"pace"}),
    )
    parts = (
        of_valve([*flows, *(f"d{name}_dt" for name in system.openings)]),
        of_chamber(chamber_equations(system.model, n, plant, system.valve), "d{}_dt"),
        of_piston(piston_equations, "dx_dt", "dv_dt"),
        of_piston(stop_equations, "x_after", "v_after"),
    )
    needed = names_in(tuple(s.value for part in (*parts, *substep) for s in part))
    needed |= {name for names in system.of_chambers.values() for name in names.values()}.union(also)
    known = constants(system.plant, system.n, system.dynamics)
    return Printed(*parts, [constant for constant in known if constant.name in needed], substep)


def digits(value: float) -> str:
    """A number as text with 17 significant digits, which determine a double, and a decimal point."""
    text = f"{value:.17g}"
    return text if set(".en") & set(text) else text + ".0"


def heading(system: System, mark: str = "") -> str:
    """Comment at the head of a file: system, units and range of validity; each line begins with `mark`."""
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
    )
    return "\n".join((mark + line).rstrip() for line in text.rstrip().split("\n"))


def validity(system: System) -> str:
    """Sentence that says where a model does not hold; empty for most."""
    drift, P_0 = closed_drift(system), system.plant.conditions.P_0
    if drift is None:
        return ""
    return (
        f"{system.name} holds near P_0 = {P_0:.4g} Pa only. Do not start it vented, nor hold with the valve "
        "shut: a closed chamber drifts to P_0, from atmospheric pressure in mid-stroke at "
        f"{1e-3 * drift:.3g} kPa/s."
    )


def indented(lines: list[str]) -> list[str]:
    """Lines one level further right."""
    return ["    " + line for line in lines]


def block(lines: list[str]) -> str:
    """Text of lines one level further right."""
    return "\n".join(indented(lines))


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
