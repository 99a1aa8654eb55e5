"""Rates as a MATLAB function (Octave runs it too) and as a CasADi function in Python."""

from typing import Any

from sympy.printing.codeprinter import CodePrinter
from sympy.printing.octave import OctaveCodePrinter
from sympy.printing.pycode import PythonCodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import CHAMBER_CONSTANTS, Statement, names_in
from pneumo.equations.system import System
from pneumo.export.printing import assignments, block, digits, heading, indented, printed

MATLAB_KEYWORDS = ("if {}", "elseif {}", "else", "end")


class _Octave(OctaveCodePrinter):
    def _print_Float(self, expr: Any) -> str:
        return digits(float(expr))


class _Python(PythonCodePrinter):
    def _print_Float(self, expr: Any) -> str:
        return digits(float(expr))


def _lists(system: System) -> dict[str, str]:
    """Comma-separated arguments and rates, by key: of the whole system, of chamber A or B, and of either."""
    states = system.chamber_states
    return {
        "command": "u" if system.proportional else "u_valve",
        "arguments": ", ".join((*system.inputs, *system.states)),
        "rates": ", ".join(f"d{name}_dt" for name in system.states),
        "states_of_either": ", ".join(states),
        "rates_of_either": ", ".join(f"d{name}_dt" for name in states),
        **{
            f"arguments_{side}": ", ".join((*(f"{name}_{side}" for name in states), *names))
            for side, names in CHAMBER_CONSTANTS.items()
        },
        **{f"rates_{side}": ", ".join(f"d{name}_{side}_dt" for name in states) for side in CHAMBER_CONSTANTS},
    }


def matlab(system: System) -> str:
    """Source of a MATLAB function of the rates, named <model>_dP_dt; Octave runs it too."""
    outer, body, printer = list[str](), list[str](), _Octave({})
    parts, names = printed(system), _lists(system)
    of_both = names_in(tuple(s.value for s in parts.valve)).union(*CHAMBER_CONSTANTS.values())
    for c in parts.constants:
        (outer if c.name in of_both else body).append(f"{c.name} = {digits(c.value)}; % {c.comment}")
    for lines, assigned in ((outer, parts.valve), (body, parts.chamber)):
        for s in assigned:
            lines.append(f"% {', '.join(s.names)}: {s.comment}")
            lines += assignments(s.names, s.value, "{} = {};", printer, MATLAB_KEYWORDS)
    return f"""\
function [{names["rates"]}] = {system.name}_dP_dt({names["arguments"]})
{heading(system, "% ")}
% Scalars only.
{block(outer)}
    [{names["rates_A"]}] = chamber({names["command"]}, x, v, {names["arguments_A"]});
    [{names["rates_B"]}] = chamber(-{names["command"]}, -x, -v, {names["arguments_B"]});
end

function [{names["rates_of_either"]}] = chamber(u, x, v, {names["states_of_either"]}, area, V_d)
% One chamber, with u, x, v counted outward from it; area in m^2, dead volume in m^3.
{block(body)}
end
"""


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
    parts, names = printed(system), _lists(system)
    followed = "".join(f"{line}\n" for line in _assigned(parts.valve))
    opening = "dopening_dt, " if "opening" in system.states else ""
    given = [f"{c.name} = {digits(c.value)}  # {c.comment}\n" for c in parts.constants]
    rates, u = [f"d{name}_dt" for name in system.states], names["command"]
    return f'''\
"""
{heading(system)}
"""

from casadi import SX, Function, fabs, if_else, sqrt

{"".join(given)}

def chamber(u, x, v, {names["states_of_either"]}, area, V_d):
    """One chamber, with u, x, v counted outward from it; area in m^2, dead volume in m^3."""
{block(_assigned(parts.chamber))}
    return [{names["rates_of_either"]}]


names = {list((*system.inputs, *system.states))!r}
{names["arguments"]} = map(SX.sym, names)
{followed}{system.name}_dP_dt = Function(
    "{system.name}_dP_dt",
    [{names["arguments"]}],
    [{opening}*chamber({u}, x, v, {names["arguments_A"]}), *chamber(-{u}, -x, -v, {names["arguments_B"]})],
    names,
    {rates!r},
)
'''
