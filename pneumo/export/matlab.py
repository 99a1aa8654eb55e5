"""Rates as a MATLAB function; Octave runs it too."""

from typing import Any

from sympy.printing.octave import OctaveCodePrinter

from pneumo.equations.equation_list import Statement, names_in
from pneumo.equations.system import System
from pneumo.export.printing import TEMPLATES, assignments, digits, indented, known_to_all, printed

MATLAB_KEYWORDS = ("if {}", "elseif {}", "else", "end")


class _Octave(OctaveCodePrinter):
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
