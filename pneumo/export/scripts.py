"""Rates as a MATLAB function (Octave runs it too) and as a CasADi function in Python."""

from typing import Any

from sympy.printing.codeprinter import CodePrinter
from sympy.printing.octave import OctaveCodePrinter
from sympy.printing.pycode import PythonCodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Statement, names_in
from pneumo.equations.system import System
from pneumo.export.printing import assignments, block, digits, heading, indented, printed
from pneumo.physics.cylinder import Side

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
    lists = {
        "arguments": ", ".join((*system.inputs, *system.states)),
        "rates": ", ".join(f"d{name}_dt" for name in system.states),
        "of_either": ", ".join((*system.flow_inputs, "x", "v", *states, *system.of_chambers["A"])),
        "rates_of_either": ", ".join(f"d{name}_dt" for name in states),
    }
    for side in Side:
        minus, at = "-" * (side.sign < 0), side.name
        flows = ("-" * (sign < 0) + name for sign, name in system.flows(side).values())
        named, constants = (f"{name}_{at}" for name in states), system.of_chambers[at].values()
        lists[at] = ", ".join((*flows, f"{minus}x", f"{minus}v", *named, *constants))
        lists[f"rates_{at}"] = ", ".join(f"d{name}_{at}_dt" for name in states)
    return lists


def matlab(system: System) -> str:
    """Source of a MATLAB function of the rates, named <model>_dP_dt; Octave runs it too."""
    outer, body, printer = list[str](), list[str](), _Octave({})
    parts, names = printed(system), _lists(system)
    of_body = names_in(tuple(s.value for s in parts.chamber))
    of_outer = names_in(tuple(s.value for s in parts.valve))
    of_outer = of_outer.union(*(of.values() for of in system.of_chambers.values()))
    for lines, names_of in ((outer, of_outer), (body, of_body)):
        lines += [
            f"{c.name} = {digits(c.value)}; % {c.comment}" for c in parts.constants if c.name in names_of
        ]
    for lines, assigned in ((outer, parts.valve), (body, parts.chamber)):
        for s in assigned:
            lines.append(f"% {', '.join(s.names)}: {s.comment}")
            lines += assignments(s.names, s.value, "{} = {};", printer, MATLAB_KEYWORDS)
    return f"""\
function [{names["rates"]}] = {system.name}_dP_dt({names["arguments"]})
{heading(system, "% ")}
% Scalars only.
{block(outer)}
    [{names["rates_A"]}] = chamber({names["A"]});
    [{names["rates_B"]}] = chamber({names["B"]});
end

function [{names["rates_of_either"]}] = chamber({names["of_either"]})
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
    openings = "".join(f"d{name}_dt, " for name in system.states if name.startswith("opening"))
    given = [f"{c.name} = {digits(c.value)}  # {c.comment}\n" for c in parts.constants]
    rates = [f"d{name}_dt" for name in system.states]
    return f'''\
"""
{heading(system)}
"""

from casadi import SX, Function, fabs, if_else, sqrt

{"".join(given)}

def chamber({names["of_either"]}):
    """One chamber, with u, x, v counted outward from it; area in m^2, dead volume in m^3."""
{block(_assigned(parts.chamber))}
    return [{names["rates_of_either"]}]


names = {list((*system.inputs, *system.states))!r}
{names["arguments"]} = map(SX.sym, names)
{followed}{system.name}_dP_dt = Function(
    "{system.name}_dP_dt",
    [{names["arguments"]}],
    [{openings}*chamber({names["A"]}), *chamber({names["B"]})],
    names,
    {rates!r},
)
'''
