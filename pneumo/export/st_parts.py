"""Parts of a unit in Structured Text: declarations, numbers, expressions and statements."""

from typing import Any, NamedTuple

import numpy as np
from sympy import S
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import precedence

from pneumo.equations.equation_list import PATHS, Statement
from pneumo.equations.system import quantity
from pneumo.export.printing import assignments

KEYWORDS = ("IF {} THEN", "ELSIF {} THEN", "ELSE", "END_IF;")
TYPES = {"double": "LREAL", "float": "REAL"}
REALS = {"double": np.float64, "float": np.float32}
# Names that a controller refuses, or that differ from another one only by case: it makes no difference there.
OF_CONSTANTS = {"gamma_": "gamma", "R": "R_gas", "M": "M_moving", "n": "n_index"}
OF_CHAMBER = {name: f"{name}_side" for name in ("u", "m", *PATHS, "x", "v", "P", "T")} | {
    "V": "volume",
    "dV_dt": "volume_rate",
    "s": "length",
}
OF_PISTON = {name: f"{name}_stage" for name in ("x", "v", "P_A", "P_B", "force")}
OF_PISTON |= {f"{name}{of}": f"{name}{of}_stage" for name in ("u", "m", "opening") for of in ("", "_A", "_B")}
OF_PISTON |= {"a": "dv_dt_free", "s": "length"}
POSITIVE = ("V", "space", "space_mid", "space_end", "resists_mid", "resists_end", "P_mid", "T_mid")


class Variable(NamedTuple):
    """A declared variable; an array if `last`, the highest index of each dimension, is given."""

    name: str
    type: str
    initial: tuple[str, ...] = ()
    comment: str = ""
    last: tuple[int, ...] = ()

    @property
    def declaration(self) -> str:
        """Declaration in Structured Text: name, type and initial value."""
        ranges = ", ".join(f"0..{last}" for last in self.last)
        kind = f"ARRAY[{ranges}] OF {self.type}" if self.last else self.type
        values = f"[{', '.join(self.initial)}]" if self.last else "".join(self.initial)
        return f"{self.name} : {kind}" + (f" := {values}" if self.initial else "") + ";"


class Unit(NamedTuple):
    """A function block or program: declarations by keyword, such as VAR_INPUT, and statements as text."""

    keyword: str
    name: str
    comment: str
    declarations: dict[str, list[Variable]]
    body: str


def number(value: float, precision: str) -> str:
    """The shortest literal, with a decimal point, of a real number in a precision, "float" or "double"."""
    mantissa, _, exponent = str(REALS[precision](value)).partition("e")
    return mantissa + ("" if "." in mantissa else ".0") + (f"E{int(exponent)}" if exponent else "")


class Text(CodePrinter):
    """SymPy printer of Structured Text for expressions of real numbers; `names` renames some quantities."""

    _operators = {"and": "AND", "or": "OR", "not": "NOT "}  # noqa: RUF012 - as the base class has it

    def __init__(self, precision: str, names: dict[str, str]) -> None:
        super().__init__()
        self.precision, self.names = precision, names

    def name(self, name: str) -> str:
        """Name of a quantity in the text."""
        return self.names.get(name, name)

    def doprint(self, expr: Any, assign_to: Any = None) -> str:  # noqa: ARG002 - as the base class has it
        """Text of an expression."""
        return str(self._print(expr))

    def parenthesize(self, item: Any, level: int, strict: bool = False) -> str:
        """Text of an operand, in parentheses where it needs them."""
        if item.is_Rational and item.is_nonnegative:  # printed as a decimal number
            return self.doprint(item)
        text = str(super().parenthesize(item, level, strict))
        return f"({text})" if item.is_Pow and item.exp == 2 else text  # a square is printed as a product

    def _print_Symbol(self, expr: Any) -> str:
        return self.name(expr.name)

    def _print_Float(self, expr: Any) -> str:
        return number(float(expr), self.precision)

    _print_Integer = _print_Rational = _print_NumberSymbol = _print_Float

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:  # noqa: ARG002 - as the base class has it
        base, exponent = expr.args
        if expr.is_number:
            return number(float(expr), self.precision)
        if exponent == -1:
            return f"1.0/{self.parenthesize(base, precedence(expr))}"
        if exponent == 2:
            return "*".join([self.parenthesize(base, precedence(expr))] * 2)
        if exponent == S.Half:
            return f"SQRT({self._print(base)})"
        if exponent == -S.Half:
            return f"1.0/SQRT({self._print(base)})"
        return f"EXPT({self._print(base)}, {self._print(exponent)})"

    def _print_Abs(self, expr: Any) -> str:
        return f"ABS({self._print(expr.args[0])})"

    def _print_Relational(self, expr: Any) -> str:
        sign = {"==": "=", "!=": "<>"}.get(expr.rel_op, expr.rel_op)
        return f"{self._print(expr.lhs)} {sign} {self._print(expr.rhs)}"


def lines(statements: list[Statement], printer: Text) -> list[str]:
    """Lines of Structured Text for statements.

    After each of the `POSITIVE` quantities comes a test that leaves the surrounding loop if it is not.
    """
    result = list[str]()
    for s in statements:
        names = tuple(map(printer.name, s.names))
        result.append(f"(* {', '.join(names)}: {s.comment} *)")
        result += assignments(names, s.value, "{} := {};", printer, KEYWORDS)
        for name in (printer.name(n) for n in s.names if n in POSITIVE):
            # A division by zero stops a controller.
            result += [f"IF NOT ({name} > 0.0) THEN", "    failed := TRUE;", "    EXIT;", "END_IF;"]
    return result


def numbers(values: Any, precision: str) -> tuple[str, ...]:
    """Literals of several real numbers, as from `number`."""
    return tuple(number(float(value), precision) for value in values)


def described(name: str) -> str:
    """Unit and meaning of an input or a state."""
    return ", ".join(quantity(name))
