"""Rates as a MATLAB function (Octave runs it too) and as a CasADi function in Python."""

from typing import Any

from sympy.printing.codeprinter import CodePrinter
from sympy.printing.octave import OctaveCodePrinter
from sympy.printing.pycode import PythonCodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Statement, names_in
from pneumo.equations.system import System
from pneumo.export.printing import TEMPLATES, assignments, digits, indented, known_to_all, printed

MATLAB_KEYWORDS = ("if {}", "elseif {}", "else", "end")


class _Octave(OctaveCodePrinter):
    def _print_Float(self, expr: Any) -> str:
        return digits(float(expr))


class _Python(PythonCodePrinter):
    def _print_Float(self, expr: Any) -> str:
        return digits(float(expr))


def matlab(system: System) -> str:
    """Source of a MATLAB function of the rates, named <model>_dP_dt; Octave runs it too."""
    (parts, constants), printer = printed(system), _Octave({})
    of_chambers = {name for of in system.of_chambers.values() for name in of.values()}

    def lines(statements: list[Statement], also: set[str]) -> list[str]:
        names = names_in(tuple(s.value for s in statements)) | also
        result = [f"{c.name} = {digits(c.value)}; % {c.comment}" for c in constants if c.name in names]
        for s in statements:
            result.append(f"% {', '.join(s.names)}: {s.comment}")
            result += assignments(s.names, s.value, "{} = {};", printer, MATLAB_KEYWORDS)
        return indented(result)

    known = {"outer": lines(parts["valve"], of_chambers), "body": lines(parts["chamber"], set())}
    return TEMPLATES.get_template("script.m.j2").render(known_to_all(system, "% ") | known)


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
    parts, constants = printed(system)
    known = {"outer": _assigned(parts["valve"]), "body": indented(_assigned(parts["chamber"]))}
    known["constants"] = [f"{c.name} = {digits(c.value)}  # {c.comment}" for c in constants]
    return TEMPLATES.get_template("script.py.j2").render(known_to_all(system) | known)
