"""Structured Text on blark's syntax tree: declarations are checked, statements become Python functions.

Strict where controllers differ: case makes no difference, INT and real numbers do not mix, inputs and
constants are not assigned, indices are inside their array; a division by zero or a root of a negative number
is an error.
"""

import math
import operator
import re

import numpy as np
from blark import transform as tree
from blark.parse import parse_source_code

REALS = {"LREAL": float, "REAL": np.float32}
ARRAY = re.compile(r"(\w+)( : ARRAY\[[^\]]*\] OF \w+) := \[([^\]]*)\]")
ARITHMETIC = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}
COMPARISONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq}
LITERAL = "literal"  # of a real number, which takes the type of its neighbour


class Exit(Exception):
    """EXIT, which ends the innermost loop."""


def parsed(text):
    """Unit that blark reads in a text, and the initial values of its arrays.

    blark takes minutes for lists of hundreds of numbers, so they are read here.
    """
    values = {name.lower(): listed.split(", ") for name, _, listed in ARRAY.findall(text)}
    result = parse_source_code(ARRAY.sub(r"\1\2", text))
    if result.exception:
        raise result.exception
    (unit,) = result.transform().items
    return unit, values


class Block:
    """An instance of a function block or program; `blocks` are the units whose instances it declares."""

    def __init__(self, unit, arrays=(), blocks=()):
        self.name, self.types, self.values, self.sections = str(unit.name), {}, {}, {}
        self.blocks = {str(other[0].name).lower(): other for other in blocks}
        for section in unit.declarations:
            for item in section.items:
                self._declare(section, item, dict(arrays))
        self._body = self._statements(unit.body)

    def __call__(self, **inputs):
        """Set inputs, by lower-case name, and run the statements."""
        for name, value in inputs.items():
            assert self.sections[name] == "VAR_INPUT", name
            self.values[name] = self._stored(self.types[name], value)
        self._body()

    def __getitem__(self, name):
        """Value of a variable; of an array a list in the order of its indices."""
        value = self.values[name.lower()]
        return list(value.values()) if isinstance(value, dict) else value

    # Declarations

    def _declare(self, section, item, arrays):
        names = [str(getattr(v, "variable", v)).lower() for v in item.variables]
        constant = "CONSTANT" in str(section.attrs).upper()
        for name in names:
            assert name not in self.types, f"{name}: declared twice"
            self.sections[name] = section.block_header + " CONSTANT" * constant
            spec = getattr(item, "init", None)
            kind = str(spec.spec.type if spec else item.spec)
            if isinstance(getattr(spec, "spec", None), tree.ArraySpecification):
                ranges = [range(int(str(r.start)), int(str(r.stop)) + 1) for r in spec.spec.subranges]
                places = [()]
                for indices in ranges:
                    places = [(*place, index) for place in places for index in indices]
                kind = str(spec.spec.type.type_name)
                texts = arrays.get(name) or ["0" if kind == "INT" else "0.0"] * len(places)
                self.types[name] = kind, len(ranges)
                numbers = (self._number(kind, text) for text in texts)
                self.values[name] = dict(zip(places, numbers, strict=True))
            elif kind.lower() in self.blocks:
                self.types[name] = kind
                self.values[name] = Block(*self.blocks[kind.lower()])
            else:
                self.types[name] = kind
                default = {"BOOL": "FALSE", "INT": "0"}.get(kind, "0.0")
                self.values[name] = self._number(kind, str(spec.value) if spec.value else default)

    @staticmethod
    def _number(kind, text):
        if kind == "BOOL":
            return {"TRUE": True, "FALSE": False}[text]
        assert re.fullmatch(r"-?\d+" if kind == "INT" else r"-?\d+\.\d+(E-?\d+)?", text), text
        return int(text) if kind == "INT" else REALS[kind](text)

    @staticmethod
    def _stored(kind, value):
        if kind in REALS:
            assert isinstance(value, float | np.floating)
            return REALS[kind](value)
        assert type(value) is (bool if kind == "BOOL" else int) and -(2**15) <= value < 2**15
        return value

    # Expressions: the type, and a function without arguments that gives the value

    def _expression(self, node):
        return getattr(self, f"_{type(node).__name__}")(node)

    def _ParenthesizedExpression(self, node):
        return self._expression(node.expr)

    def _Real(self, node):
        value = float(str(node.value))
        return LITERAL, lambda: value

    def _Integer(self, node):
        value = int(str(node.value))
        return "INT", lambda: value

    def _Boolean(self, node):
        value = self._number("BOOL", str(node.value).upper())
        return "BOOL", lambda: value

    def _SimpleVariable(self, node):
        name, values = str(node.name).lower(), self.values
        if name in ("true", "false"):
            return "BOOL", lambda: name == "true"
        assert isinstance(self.types[name], str), f"{name}: needs an index"
        return self.types[name], lambda: values[name]

    def _MultiElementVariable(self, node):
        (element,) = node.elements
        name = str(node.name).lower()
        if isinstance(element, tree.FieldSelector):
            block, field = self.values[name], str(element.field).lower()
            assert block.sections[field] in ("VAR_INPUT", "VAR_OUTPUT"), field
            return block.types[field], lambda: block.values[field]
        array, place = self.values[name], self._place(name, element)
        return self.types[name][0], lambda: array[place()]

    def _place(self, name, element):
        assert len(element.subscripts) == self.types[name][1], name
        kinds, indices = zip(*map(self._expression, element.subscripts), strict=True)
        assert set(kinds) == {"INT"}, name
        return lambda: tuple(index() for index in indices)

    def _UnaryOperation(self, node):
        kind, value = self._expression(node.expr)
        sign = str(node.op).upper()
        assert (kind == "BOOL") == (sign == "NOT"), sign
        return kind, (lambda: not value()) if sign == "NOT" else (lambda: -value())

    def _common(self, *kinds):
        """The type of both operands."""
        different = set(kinds) - {LITERAL}
        assert len(different) <= 1, kinds
        kind = different.pop() if different else LITERAL
        assert kind in (*REALS, LITERAL) or LITERAL not in kinds, kinds
        return kind

    def _BinaryOperation(self, node):
        (left_kind, left), (right_kind, right) = map(self._expression, (node.left, node.right))
        sign, kind = str(node.op).upper(), self._common(left_kind, right_kind)
        if sign in ("AND", "OR"):
            assert kind == "BOOL", sign
            # Both sides are evaluated, as the standard has it.
            return "BOOL", (lambda: left() & right()) if sign == "AND" else (lambda: left() | right())
        assert kind != "BOOL", sign
        function = (COMPARISONS | ARITHMETIC)[sign]
        if sign in COMPARISONS:
            return "BOOL", lambda: bool(function(left(), right()))
        assert kind != "INT" or sign != "/"
        return kind, lambda: function(left(), right())

    def _FunctionCall(self, node):
        name = str(node.name).upper()
        kinds, values = zip(*(self._expression(p.value) for p in node.parameters), strict=True)
        kind = self._common(*kinds)
        function = {"ABS": abs, "SQRT": math.sqrt, "EXPT": math.pow}[name]
        assert len(values) == (2 if name == "EXPT" else 1) and kind in REALS, name
        of_kind = REALS[kind]
        return kind, lambda: of_kind(function(*(value() for value in values)))

    # Statements: functions without arguments

    def _statements(self, node):
        functions = [getattr(self, f"_{type(s).__name__}")(s) for s in node.statements] if node else []

        def run():
            for function in functions:
                function()

        return run

    def _AssignmentStatement(self, node):
        (variable,) = node.variables
        kind, value = self._expression(node.expression)
        name = str(getattr(variable, "name", variable)).lower()
        target, _ = self._expression(variable)
        assert self.sections[name] in ("VAR", "VAR_OUTPUT"), f"{name}: {self.sections[name]} is assigned"
        assert kind == target or (kind == LITERAL and target in REALS), f"{name}: {kind} to {target}"
        values, stored = self.values, self._stored
        if isinstance(variable, tree.SimpleVariable):
            return lambda: values.__setitem__(name, stored(target, value()))
        array, (element,) = values[name], variable.elements
        place = self._place(name, element)

        def assign():
            at = place()
            assert at in array, f"{name}{at}"
            array[at] = stored(target, value())

        return assign

    def _condition(self, node):
        kind, value = self._expression(node)
        assert kind == "BOOL", kind
        return value

    def _IfStatement(self, node):
        clauses = [node, *node.else_ifs]
        branches = [(self._condition(c.if_expression), self._statements(c.statements)) for c in clauses]
        otherwise = self._statements(node.else_clause.statements) if node.else_clause else lambda: None

        def run():
            for condition, statements in branches:
                if condition():
                    return statements()
            return otherwise()

        return run

    def _CaseStatement(self, node):
        assert node.else_clause is None
        kind, value = self._expression(node.expression)
        assert kind == "INT"
        cases = {int(str(match)): self._statements(c.statements) for c in node.cases for match in c.matches}
        return lambda: cases[value()]()

    def _ForStatement(self, node):
        name, values = str(node.control).lower(), self.values
        (first_kind, first), (last_kind, last) = map(self._expression, (node.from_, node.to))
        assert self.types[name] == first_kind == last_kind == "INT" and node.step is None
        statements = self._statements(node.statements)

        def run():
            for index in range(first(), last() + 1):
                values[name] = index
                try:
                    statements()
                except Exit:
                    break

        return run

    def _ExitStatement(self, node):
        def leave():
            raise Exit

        return leave

    def _FunctionCallStatement(self, node):
        block, given = self.values[str(node.name).lower()], []
        for parameter in node.parameters:
            name = str(parameter.name).lower()
            kind, value = self._expression(parameter.value)
            assert kind == block.types[name] or (kind == LITERAL and block.types[name] in REALS), name
            given.append((name, value))
        return lambda: block(**{name: value() for name, value in given})
