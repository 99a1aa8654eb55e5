"""IEC 61131-3 Structured Text: a function block that steps, its test program, and both as PLCopen XML.

Only what the second edition of the standard has: no methods and no types of its own, so one text serves
every controller with function blocks.
"""

from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
from sympy import S
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import precedence

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Statement
from pneumo.equations.system import METHODS, System, quantity
from pneumo.errors import InputError
from pneumo.export.c_source import TEMPLATES
from pneumo.export.known_steps import known_steps, scale
from pneumo.export.printing import assignments, heading, printed
from pneumo.linear.linear_analysis import STABLE_RANGE, stable_steps

KEYWORDS = ("IF {} THEN", "ELSIF {} THEN", "ELSE", "END_IF;")
TYPES = {"double": "LREAL", "float": "REAL"}
REALS = {"double": np.float64, "float": np.float32}
TOLERANCE = {"double": 1e-12, "float": 1e-4}  # of the test program, relative; as in C
# Names that a controller refuses, or that differ from another one only by case: it makes no difference there.
OF_CONSTANTS = {"gamma_": "gamma", "R": "R_gas", "M": "M_moving", "n": "n_index"}
OF_CHAMBER = {name: f"{name}_side" for name in ("u", "m", "x", "v", "P", "T")} | {
    "V": "volume",
    "dV_dt": "volume_rate",
}
OF_PISTON = {name: f"{name}_stage" for name in ("x", "v", "P_A", "P_B", "force")} | {"a": "dv_dt_free"}
COUNTERS = ("i", "j", "k", "side", "first", "place", "stages", "first_A", "first_b")
LISTS = {  # of PLCopen XML: element, and whether its variables are constant
    "VAR_INPUT": ("inputVars", False),
    "VAR_OUTPUT": ("outputVars", False),
    "VAR": ("localVars", False),
    "VAR CONSTANT": ("localVars", True),
}


class Cost(NamedTuple):
    """Operations on real numbers, at most."""

    multiplications: int
    divisions: int
    roots: int
    powers: int

    def plus(self, other: "Cost") -> "Cost":
        """Sum of both."""
        return Cost(*(a + b for a, b in zip(self, other, strict=True)))

    def times(self, count: int) -> "Cost":
        """Product with a count."""
        return Cost(*(count * a for a in self))


class Variable(NamedTuple):
    """A declared variable, an array where it has last indices."""

    name: str
    type: str
    initial: tuple[str, ...] = ()
    comment: str = ""
    last: tuple[int, ...] = ()

    @property
    def declaration(self) -> str:
        """Name, type and initial value."""
        ranges = ", ".join(f"0..{last}" for last in self.last)
        kind = f"ARRAY[{ranges}] OF {self.type}" if self.last else self.type
        values = f"[{', '.join(self.initial)}]" if self.last else "".join(self.initial)
        return f"{self.name} : {kind}" + (f" := {values}" if self.initial else "") + ";"


class Unit(NamedTuple):
    """A function block or program: declarations by their keyword, and the statements."""

    keyword: str
    name: str
    comment: str
    declarations: dict[str, list[Variable]]
    body: str


def number(value: float, precision: str) -> str:
    """A real literal, the shortest that is this number in a precision; the standard wants a point in each."""
    mantissa, _, exponent = str(REALS[precision](value)).partition("e")
    return mantissa + ("" if "." in mantissa else ".0") + (f"E{int(exponent)}" if exponent else "")


class _Text(CodePrinter):
    """Prints expressions of real numbers, with other names for some."""

    _operators = {"and": "AND", "or": "OR", "not": "NOT "}  # noqa: RUF012 - as the base class has it

    def __init__(self, precision: str, names: dict[str, str]) -> None:
        super().__init__()
        self.precision, self.names = precision, names

    def name(self, name: str) -> str:
        return self.names.get(name, name)

    def doprint(self, expr: Any, assign_to: Any = None) -> str:  # noqa: ARG002 - as the base class has it
        return str(self._print(expr))

    def parenthesize(self, item: Any, level: int, strict: bool = False) -> str:
        if item.is_Rational and item.is_nonnegative:  # printed as a decimal number
            return self.doprint(item)
        return str(super().parenthesize(item, level, strict))

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
        if exponent == 2 and base.is_Symbol:
            return "*".join([self._print(base)] * 2)
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


def _most(value: Any, printer: _Text) -> Cost:
    """Operations of an expression, a tuple of them, or of the costliest branches of a choice."""
    if isinstance(value, Choice):
        branches = (_most(value.yes, printer), _most(value.no, printer))
        return _most(value.condition, printer).plus(Cost(*map(max, *branches)))
    if isinstance(value, tuple):
        return Cost(*map(sum, zip(*(_most(part, printer) for part in value), strict=True)))
    return _counted(printer.doprint(value))


def _cost(statements: list[Statement], printer: _Text) -> Cost:
    return Cost(*map(sum, zip(Cost(0, 0, 0, 0), *(_most(s.value, printer) for s in statements), strict=True)))


def step_costs(system: System, chamber: Cost, piston: Cost, stops: Cost) -> dict[str, Cost]:
    """Operations of a step by each method, from those of a chamber, of the piston and of its stops."""
    states, inputs, costs = len(system.states), len(system.inputs), dict[str, Cost]()
    for name, method in METHODS.items():
        stages = len(method.b)
        below = stages * (stages - 1) // 2  # of the tableau's diagonal
        own = states * (below + 2 * stages + 1) + inputs * stages
        costs[name] = chamber.times(2).plus(piston).times(stages).plus(stops).plus(Cost(own, 0, 0, 0))
    return costs


def _lines(statements: list[Statement], printer: _Text) -> list[str]:
    lines = list[str]()
    for s in statements:
        names = tuple(map(printer.name, s.names))
        lines.append(f"(* {', '.join(names)}: {s.comment} *)")
        lines += assignments(names, s.value, "{} := {};", printer, KEYWORDS)
        if s.names == ("V",):  # a division by zero stops a controller
            lines += [f"IF NOT ({names[0]} > 0.0) THEN", "    failed := TRUE;", "    EXIT;", "END_IF;"]
    return lines


def _numbers(values: Any, precision: str) -> tuple[str, ...]:
    return tuple(number(float(value), precision) for value in values)


def _assigned(statements: list[Statement], printer: _Text, real: str) -> list[Variable]:
    return [Variable(printer.name(name), real) for s in statements for name in s.names]


def block(system: System, precision: str) -> Unit:
    """Function block of a system."""
    parts, real = printed(system), TYPES[precision]
    inside, outside = (_Text(precision, OF_CONSTANTS | names) for names in (OF_CHAMBER, OF_PISTON))
    c = system.plant.conditions
    rest = system.state(x=0.0, v=0.0, P=c.P_0, T=c.T_0)
    starts = dict(zip(system.states, _numbers(rest, precision), strict=True))
    methods, states, stages = METHODS.values(), len(system.states), max(len(m.b) for m in METHODS.values())
    costs = step_costs(
        system, _cost(parts.chamber, inside), _cost(parts.piston, outside), _cost(parts.stops, outside)
    )

    def described(name: str) -> str:
        return ", ".join(quantity(name))

    zero = (number(0.0, precision),)
    inputs = [Variable(name, real, zero, described(name)) for name in system.inputs]
    inputs += [
        Variable("h", real, (number(1e-3, precision),), "s, step"),
        Variable("solver", "INT", ("1",), ", ".join(f"{i} {name}" for i, name in enumerate(METHODS))),
        Variable(
            "interpolate", "BOOL", ("FALSE",), "inputs are linear from those of the last call, not held"
        ),
        Variable("restart", "BOOL", ("FALSE",), "take the state below; no step"),
        *(Variable(f"{name}_start", real, (starts[name],), described(name)) for name in system.states),
        *(
            Variable(outside.name(p.name), real, _numbers([p.value], precision), p.comment)
            for p in parts.constants
        ),
    ]
    outputs = [Variable(name, real, (starts[name],), described(name)) for name in system.states]
    failed = "no such solver, or a volume, pressure or temperature that is not positive"
    outputs.append(Variable("failed", "BOOL", ("FALSE",), failed))
    chamber_names = [*system.chamber_states, "u" if system.valve else "m", "x", "v"]
    piston_names = [*(name for name in system.inputs if name not in ("x", "v")), "x", "v"]
    piston_names += ["P_A", "P_B"] * system.piston
    own = [
        *(Variable(f"{name}_before", real) for name in system.inputs),
        Variable("state", real, last=(states - 1,)),
        Variable("stage", real, last=(states - 1,)),
        Variable("rate", real, last=(stages - 1, states - 1)),
        Variable("total", real),
        *(Variable(f"{name}_stage", real) for name in piston_names),
        *_assigned(parts.piston, outside, real),
        *_assigned(parts.stops, outside, real),
        *[Variable("v_before", real)] * system.piston,
        *(Variable(f"{name}_side", real) for name in chamber_names),
        Variable("area", real, comment="m^2, of the piston"),
        Variable("V_d", real, comment="m^3, dead volume"),
        *_assigned(parts.chamber, inside, real),
        Variable("started", "BOOL", ("FALSE",)),
        *(Variable(name, "INT") for name in COUNTERS),
    ]
    tableau = {
        "table_A": [a for m in methods for i in range(len(m.b)) for a in m.A[i, :i]],
        "table_b": [b for m in methods for b in m.b],
        "table_c": [node for m in methods for node in m.c],
    }
    constants = [
        Variable(name, real, _numbers(values, precision), last=(len(values) - 1,))
        for name, values in tableau.items()
    ]
    places, first_A, first_b = list[dict[str, int]](), 0, 0
    for m in methods:
        count = len(m.b)
        places.append({"stages": count, "first_A": first_A, "first_b": first_b})
        first_A, first_b = first_A + count * (count - 1) // 2, first_b + count
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "own_states": system.chamber_states,
        "P_A": system.states.index("P_A"),
        "valve": system.valve,
        "piston": _lines(parts.piston, outside),
        "stops": _lines(parts.stops, outside),
        "chamber": _lines(parts.chamber, inside),
        "methods": list(zip(METHODS, places, strict=True)),
    }
    comment = (
        TEMPLATES.get_template("head.st.j2")
        .render(
            heading=heading(system),
            costs=costs,
            range=STABLE_RANGE,
            stable={name: f"{h:.3g}" for name, h in stable_steps(system).items()},
            real=real,
        )
        .rstrip()
    )
    declarations = {"VAR_INPUT": inputs, "VAR_OUTPUT": outputs, "VAR": own, "VAR CONSTANT": constants}
    body = TEMPLATES.get_template("block.st.j2").render(known).rstrip()
    return Unit("FUNCTION_BLOCK", f"Pneumo_{system.name}", comment, declarations, body)


def program(system: System, precision: str) -> Unit:
    """Program that compares steps of the block with those in Python."""
    real, stable = TYPES[precision], stable_steps(system)
    steps = known_steps(system, min(1e-4, stable["EULER"]))
    last = len(steps) - 1
    arrays = [
        Variable(
            f"known_{key}",
            real,
            _numbers((value for step in steps for value in getattr(step, key)), precision),
            last=(last, len(getattr(steps[0], key)) - 1),
        )
        for key in ("start", "end", "before", "after")
    ]
    arrays += [
        Variable(
            "solvers", "INT", tuple(str(list(METHODS).index(s.method)) for s in steps), last=(len(steps) - 1,)
        ),
        Variable("scale", real, _numbers(scale(system), precision), last=(len(system.states) - 1,)),
    ]
    name = f"Pneumo_{system.name}"
    own = [
        Variable("model", name),
        Variable("passed", "BOOL", ("FALSE",), "all steps agree"),
        Variable("largest", real, comment="largest relative difference from Python"),
        Variable("failures", "INT", comment="steps that failed"),
        Variable("difference", real, last=(len(system.states) - 1,)),
        Variable("i", "INT"),
        Variable("k", "INT"),
    ]
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "h": number(steps[0].h, precision),
        "last": last,
        "tolerance": number(TOLERANCE[precision], precision),
    }
    comment = f"Steps of {name} with known results, from Python in double precision: `passed` if all agree."
    body = TEMPLATES.get_template("test.st.j2").render(known).rstrip()
    return Unit("PROGRAM", f"{name}_test", comment, {"VAR": own, "VAR CONSTANT": arrays}, body)


def structured_text(system: System, stem: str, precision: str = "double") -> dict[str, str]:
    """Files of a system: function block, test program, and both as PLCopen XML, by their names."""
    name = system.name
    if "__" in name or name.endswith("_"):
        raise InputError(f"model name {name!r}: --to st: must not have two _ in a row, nor one at its end")
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
