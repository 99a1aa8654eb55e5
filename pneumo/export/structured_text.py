"""IEC 61131-3 Structured Text: a function block that steps, its test program, and both as PLCopen XML.

Only features of the second edition of the standard are used, neither methods nor user-defined types, so one
text serves every controller with function blocks.
"""

import re
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
from sympy import S
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import precedence

from pneumo.equations.equation_list import PATHS, Statement
from pneumo.equations.substep import LENGTHS, STAGE
from pneumo.equations.system import System, quantity
from pneumo.errors import InputError
from pneumo.export.known_steps import TOLERANCE, known_steps
from pneumo.export.printing import TEMPLATES, assignments, known_to_all, printed
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
LISTS = {  # of PLCopen XML: element, and whether its variables are constant
    "VAR_INPUT": ("inputVars", False),
    "VAR_OUTPUT": ("outputVars", False),
    "VAR": ("localVars", False),
    "VAR CONSTANT": ("localVars", True),
}


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


def block(system: System, precision: str) -> Unit:
    """Function block in Structured Text that integrates a system."""
    (parts, constants), real = printed(system), TYPES[precision]
    inside, outside = (Text(precision, OF_CONSTANTS | names) for names in (OF_CHAMBER, OF_PISTON))
    starts = dict(zip(system.states, numbers(system.at_rest, precision), strict=True))
    printers = {"opened": outside, "flows": outside, "before": outside, "after": outside}
    printers |= {"moved": inside, "pace": inside}
    known = known_to_all(system) | {part: lines(parts[part], of) for part, of in printers.items()}
    known |= {
        "P_A": system.states.index("P_A"),
        "chambers": {
            side.name: {
                inside.name(name): "-" * (sign < 0) + outside.name(outer)
                for name, (sign, outer) in system.flows(side).items()
            }
            | system.of_chambers[side.name]
            for side in Side
        },
        "lengths": {name: number(value, precision) for name, value in LENGTHS.items()},
        "stage": number(STAGE, precision),
        "piston": system.piston,
    }
    body = TEMPLATES.get_template("block.st.j2").render(known).rstrip()
    inputs = [
        *(Variable(name, real, (number(0.0, precision),), described(name)) for name in system.inputs),
        Variable("h", real, (number(1e-3, precision),), "s, step"),
        Variable(
            "interpolate", "BOOL", ("FALSE",), "inputs are linear from those of the last call, not held"
        ),
        Variable("restart", "BOOL", ("FALSE",), "take the state below; no step"),
        *(Variable(f"{name}_start", real, (start,), described(name)) for name, start in starts.items()),
        *(Variable(outside.name(c.name), real, (number(c.value, precision),), c.comment) for c in constants),
    ]
    problem = "h, a volume, a pressure or a temperature is not positive"
    failed = Variable("failed", "BOOL", ("FALSE",), problem)
    outputs = [*(Variable(name, real, (start,), described(name)) for name, start in starts.items()), failed]
    internal = [
        *(Variable(name, real, last=(len(system.states) - 1,)) for name in ("state", "stage")),
        Variable("started", "BOOL", ("FALSE",)),
        *(Variable(name, "INT") for name in ("i", "k", "side", "first")),
    ]
    declared = {variable.name for variable in (*inputs, *outputs, *internal)}
    assigned = dict.fromkeys(re.findall(r"^ *(\w+) :=", body, re.MULTILINE))
    internal += [Variable(name, real) for name in assigned if name not in declared]
    in_ms = {name: f"{1e3 * LENGTHS[name]:g}" for name in ("longest", "shortest")}
    comment = TEMPLATES.get_template("head.st.j2").render(known | in_ms).rstrip()
    declarations = {"VAR_INPUT": inputs, "VAR_OUTPUT": outputs, "VAR": internal}
    return Unit("FUNCTION_BLOCK", f"Pneumo_{system.name}", comment, declarations, body)


def program(system: System, precision: str) -> Unit:
    """Test program in Structured Text that compares steps of the function block with those in Python."""
    real, steps, block = TYPES[precision], known_steps(system), f"Pneumo_{system.name}"
    last, of_state = len(steps) - 1, (len(system.states) - 1,)
    constants = [
        Variable(
            f"known_{key}",
            real,
            numbers((value for step in steps for value in getattr(step, key)), precision),
            last=(last, len(getattr(steps[0], key)) - 1),
        )
        for key in ("start", "end", "before", "after")
    ]
    constants.append(Variable("scale", real, numbers(system.scale, precision), last=of_state))
    variables = [
        Variable("model", block),
        Variable("passed", "BOOL", ("FALSE",), "all steps agree"),
        Variable("largest", real, comment="largest relative difference from Python"),
        Variable("failures", "INT", comment="calls that failed"),
        Variable("difference", real, last=of_state),
        *(Variable(name, "INT") for name in ("i", "k")),
    ]
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "h": number(steps[0].h, precision),
        "last": last,
        "tolerance": number(TOLERANCE[precision], precision),
    }
    body = TEMPLATES.get_template("test.st.j2").render(known).rstrip()
    comment = f"Steps of {block} with known results, from Python in double precision: `passed` if all agree."
    return Unit("PROGRAM", f"{block}_test", comment, {"VAR": variables, "VAR CONSTANT": constants}, body)


def structured_text(system: System, stem: str, precision: str = "double") -> dict[str, str]:
    """Files of a system, by their names: function block, test program, and both as PLCopen XML."""
    name = system.name
    if "__" in name or name.endswith("_"):
        what = "--name" if system.own_name else "model name"
        raise InputError(f"{what} {name!r}: --to st: must not have two _ in a row, nor one at its end")
    units = block(system, precision), program(system, precision)
    text = TEMPLATES.get_template("unit.st.j2")
    xml = TEMPLATES.get_template("plcopen.xml.j2")
    return {
        f"{stem}.st": text.render(units[0]._asdict()),
        f"{stem}_test.st": text.render(units[1]._asdict()),
        f"{stem}.xml": xml.render(
            units=units,
            version=version("pneumo"),
            pou_types={"FUNCTION_BLOCK": "functionBlock", "PROGRAM": "program"},
            lists=LISTS,
            elementary=(*TYPES.values(), "INT", "BOOL"),
        ),
    }
