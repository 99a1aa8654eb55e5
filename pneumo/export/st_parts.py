"""Parts of a unit in Structured Text: declarations, numbers, expressions, statements and their cost."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from sympy import S
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import precedence

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import PATHS, Statement
from pneumo.equations.system import System, quantity
from pneumo.export.known_steps import scale
from pneumo.export.printing import Printed, assignments, printed
from pneumo.physics.cylinder import Side

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


class Cost(NamedTuple):
    """Numbers of operations on real numbers, at most, by kind."""

    multiplications: int
    divisions: int
    roots: int
    powers: int

    def plus(self, other: "Cost") -> "Cost":
        """Sum with another cost, kind by kind."""
        return Cost(*(a + b for a, b in zip(self, other, strict=True)))

    def times(self, count: int) -> "Cost":
        """Operations times a count."""
        return Cost(*(count * a for a in self))


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


def _counted(text: str) -> Cost:
    return Cost(text.count("*"), text.count("/"), text.count("SQRT("), text.count("EXPT("))


def _most(value: Any, printer: Text) -> Cost:
    """Largest number of operations of an expression, a tuple, or a `Choice`, over its branches."""
    if isinstance(value, Choice):
        branches = (_most(value.yes, printer), _most(value.no, printer))
        return _most(value.condition, printer).plus(Cost(*map(max, *branches)))
    if isinstance(value, tuple):
        return Cost(*map(sum, zip(*(_most(part, printer) for part in value), strict=True)))
    return _counted(printer.doprint(value))


def statement_cost(statements: list[Statement], printer: Text) -> Cost:
    """Largest number of operations of statements, over their branches."""
    return Cost(*map(sum, zip(Cost(0, 0, 0, 0), *(_most(s.value, printer) for s in statements), strict=True)))


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


class SystemText(NamedTuple):
    """Text of a system that the stepping block and the observer block have in common."""

    system: System
    precision: str
    parts: Printed
    inside: Text  # of statements on one chamber
    outside: Text  # of those on valve and piston

    @property
    def real(self) -> str:
        """Name of the type of real numbers in Structured Text, from `TYPES`."""
        return TYPES[self.precision]

    def number(self, value: float) -> str:
        """Literal of a real number."""
        return number(value, self.precision)

    def numbers(self, values: Any) -> tuple[str, ...]:
        """Literals of several real numbers."""
        return tuple(self.number(float(value)) for value in values)

    def quantity(self, name: str, initial: float = 0.0) -> Variable:
        """Declaration of an input or a state, with its unit and meaning."""
        return Variable(name, self.real, (self.number(initial),), described(name))

    @property
    def chambers(self) -> dict[str, dict[str, str]]:
        """Text of each variable of a chamber in which the two differ, by side."""
        result = dict[str, dict[str, str]]()
        for side in Side:
            flows = self.system.flows(side).items()
            result[side.name] = {
                self.inside.name(name): "-" * (sign < 0) + self.outside.name(outer)
                for name, (sign, outer) in flows
            } | self.system.of_chambers[side.name]
        return result

    @property
    def constants(self) -> list[Variable]:
        """Declarations of the plant's numbers."""
        return [
            Variable(self.outside.name(c.name), self.real, (self.number(c.value),), c.comment)
            for c in self.parts.constants
        ]

    @property
    def costs(self) -> tuple[Cost, Cost, Cost]:
        """Operations of one chamber's rates, of valve and piston, and of the stops, at most."""
        return (
            statement_cost(self.parts.chamber, self.inside),
            statement_cost([*self.parts.valve, *self.parts.piston], self.outside),
            statement_cost(self.parts.stops, self.outside),
        )

    @property
    def substep_cost(self) -> Cost:
        """Operations of a substep of both chambers, of valve and piston, at most."""
        valve, before, chamber, after, opened, pace = self.parts.substep
        return (
            statement_cost([*chamber, *pace], self.inside)
            .times(2)
            .plus(statement_cost([*valve, *before, *after, *opened], self.outside))
        )

    @property
    def statements(self) -> dict[str, list[str]]:
        """Lines of the statements of the rates, by part."""
        return {
            "opened": lines(self.parts.valve, self.outside),
            "piston": lines(self.parts.piston, self.outside),
            "stops": lines(self.parts.stops, self.outside),
            "chamber": lines(self.parts.chamber, self.inside),
        }

    @property
    def substep(self) -> dict[str, list[str]]:
        """Lines of the statements of a substep, by part."""
        valve, before, chamber, after, opened, pace = self.parts.substep
        return {
            "valve": lines(valve, self.outside),
            "opened": lines(opened, self.outside),
            "before": lines(before, self.outside),
            "chamber": lines(chamber, self.inside),
            "after": lines(after, self.outside),
            "paces": lines(pace, self.inside),
        }

    def variables(
        self,
        outside: list[Statement],
        inside: list[Statement],
        of_chamber: Iterable[str],
        counters: Iterable[str],
    ) -> list[Variable]:
        """Declarations of the variables that statements use; `of_chamber` are further inputs of a chamber."""
        named = dict.fromkeys(self.outside.name(name) for s in outside for name in s.names)
        named |= dict.fromkeys(self.inside.name(name) for s in inside for name in s.names)
        named |= dict.fromkeys(f"{name}_side" for name in (*self.system.flow_inputs, *of_chamber))
        named |= dict.fromkeys(self.system.of_chambers["A"])
        return [
            *(Variable(name, self.real) for name in named),
            Variable("started", "BOOL", ("FALSE",)),
            *(Variable(name, "INT") for name in counters),
        ]


def described(name: str) -> str:
    """Unit and meaning of an input or a state."""
    return ", ".join(quantity(name))


def system_text(system: System, precision: str, also: Iterable[str] = ()) -> SystemText:
    """Text of a system; `also` as in `printed`."""
    inside, outside = (Text(precision, OF_CONSTANTS | names) for names in (OF_CHAMBER, OF_PISTON))
    return SystemText(system, precision, printed(system, also), inside, outside)


def comparing_program(
    system: System,
    precision: str,
    block: tuple[str, str],
    compared: str,
    arrays: list[Variable],
    body: str,
) -> Unit:
    """Program that compares results of a function block with those in Python.

    `block` are the block's name and that of its instance, `compared` what the program compares.
    """
    name, instance = block
    real, last = TYPES[precision], (len(system.states) - 1,)
    variables = [
        Variable(instance, name),
        Variable("passed", "BOOL", ("FALSE",), f"all {compared} agree"),
        Variable("largest", real, comment="largest relative difference from Python"),
        Variable("failures", "INT", comment="calls that failed"),
        Variable("difference", real, last=last),
        Variable("i", "INT"),
        Variable("k", "INT"),
    ]
    comment = (
        f"{compared.capitalize()} of {name} with known results, from Python in double precision: "
        "`passed` if all agree."
    )
    scales = Variable("scale", real, numbers(scale(system), precision), last=last)
    return Unit(
        "PROGRAM", f"{name}_test", comment, {"VAR": variables, "VAR CONSTANT": [*arrays, scales]}, body
    )
