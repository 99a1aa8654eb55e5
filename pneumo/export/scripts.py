"""Rates as a MATLAB function (Octave runs it too) and as a CasADi function in Python."""

from typing import Any

from sympy.printing.codeprinter import CodePrinter
from sympy.printing.octave import OctaveCodePrinter
from sympy.printing.pycode import PythonCodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Statement, names_in
from pneumo.equations.system import System
from pneumo.export.printing import TEMPLATES, assignments, digits, heading, indented, printed
from pneumo.physics.cylinder import Side

MATLAB_KEYWORDS = ("if {}", "elseif {}", "else", "end")


class _Octave(OctaveCodePrinter):
    def _print_Float(self, expr: Any) -> str:
        return digits(float(expr))


class _Python(PythonCodePrinter):
    def _print_Float(self, expr: Any) -> str:
        return digits(float(expr))


def _rendered(template: str, system: System, **known: Any) -> str:
    """Text of a template, from the arguments and rates of the system, of chamber A or B, and of either."""
    states, either = system.chamber_states, list(system.of_chambers["A"])
    arguments = {"either": [*system.flow_inputs, "x", "v", *states, *either]}
    rates = {"either": [f"d{name}_dt" for name in states]}
    for side in Side:
        minus, at = "-" * (side.sign < 0), side.name
        flows = ("-" * (sign < 0) + name for sign, name in system.flows(side).values())
        named, constants = (f"{name}_{at}" for name in states), system.of_chambers[at].values()
        arguments[at] = [*flows, f"{minus}x", f"{minus}v", *named, *constants]
        rates[at] = [f"d{name}_{at}_dt" for name in states]
    return TEMPLATES.get_template(template).render(
        M=system.name,
        openings=system.openings,
        arguments=[*system.inputs, *system.states],
        rates=[f"d{name}_dt" for name in system.states],
        arguments_of=arguments,
        rates_of=rates,
        **known,
    )


def matlab(system: System) -> str:
    """Source of a MATLAB function of the rates, named <model>_dP_dt; Octave runs it too."""
    parts, printer = printed(system), _Octave({})
    of_chambers = {name for of in system.of_chambers.values() for name in of.values()}

    def lines(statements: list[Statement], also: set[str]) -> list[str]:
        names = names_in(tuple(s.value for s in statements)) | also
        result = [f"{c.name} = {digits(c.value)}; % {c.comment}" for c in parts.constants if c.name in names]
        for s in statements:
            result.append(f"% {', '.join(s.names)}: {s.comment}")
            result += assignments(s.names, s.value, "{} = {};", printer, MATLAB_KEYWORDS)
        return indented(result)

    known = {"outer": lines(parts.valve, of_chambers), "body": lines(parts.chamber, set())}
    return _rendered("script.m.j2", system, heading=heading(system, "% "), **known)


def _nested(value: Any, i: int, printer: CodePrinter) -> list[str]:
    """Lines of nested `if_else` of CasADi for the i-th value of a statement with several values."""
    if not isinstance(value, Choice):
        return [str(printer.doprint(value[i] if isinstance(value, tuple) else value))]
    yes, no = _nested(value.yes, i, printer), _nested(value.no, i, printer)
    if yes == no:
        return yes
    yes[-1] += ","
    no[-1] += ","
    return ["if_else(", *indented([f"{printer.doprint(value.condition)},", *yes, *no]), ")"]


def _assigned(statements: list[Statement]) -> list[str]:
    """Lines of Python that make the assignments of statements with CasADi symbols."""
    lines, settings = list[str](), {"fully_qualified_modules": False, "user_functions": {"Abs": "fabs"}}
    for s in statements:
        for i, assigned_name in enumerate(s.names):
            first, *rest = _nested(s.value, i, _Python(settings))
            lines += [f"{assigned_name} = {first}", *rest]
            lines[-1] += f"  # {s.comment}"
    return lines


def casadi(system: System) -> str:
    """Source of a Python function that makes a `casadi.Function` of the rates, named <model>_dP_dt."""
    parts = printed(system)
    constants = [f"{c.name} = {digits(c.value)}  # {c.comment}" for c in parts.constants]
    known = {"outer": _assigned(parts.valve), "body": indented(_assigned(parts.chamber))}
    return _rendered("script.py.j2", system, heading=heading(system), constants=constants, **known)
