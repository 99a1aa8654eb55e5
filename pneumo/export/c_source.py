"""C99: a model's rates and steps with header and test program, without allocation."""

from typing import Any, NamedTuple
from zlib import crc32

from sympy.codegen.ast import float32, real
from sympy.printing.c import C99CodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Constant, Statement, with_tangents
from pneumo.equations.substep import LENGTHS, STAGE
from pneumo.equations.system import System
from pneumo.export.known_steps import TOLERANCE, known_steps
from pneumo.export.observer_noise import CONSTANTS, FIRST_VARIANCES, STEPS, ObserverNoise
from pneumo.export.printing import TEMPLATES, assignments, digits, indented, known_to_all, printed
from pneumo.linear.observer import FIRST_PRESSURE

KEYWORDS = ("if ({}) {{", "}} else if ({}) {{", "} else {", "}")


class CPrinter(C99CodePrinter):
    """SymPy printer of C in which a system's constants are members of its struct of parameters."""

    def __init__(self, constants: list[Constant], precision: str = "double") -> None:
        aliases = {"type_aliases": {real: float32}} if precision == "float" else {}
        super().__init__({"math_macros": {}} | aliases)
        self.suffix = "f" if precision == "float" else ""
        self.parameters = {constant.name for constant in constants}

    def _print_Float(self, flt: Any) -> str:
        return digits(float(flt)) + self.suffix

    def _print_Symbol(self, expr: Any) -> str:
        name = super()._print_Symbol(expr)
        return f"p->{name}" if name in self.parameters else name


def _body(statements: list[Statement], precision: str, printer: CPrinter) -> str:
    lines = list[str]()
    for s in statements:
        pattern = f"const {precision} {{}} = {{}}; /* {s.comment} */"
        if isinstance(s.value, Choice):
            lines.append(f"{precision} {', '.join(s.names)}; /* {s.comment} */")
            pattern = "{} = {};"
        lines += assignments(s.names, s.value, pattern, printer, KEYWORDS)
    return "\n".join(indented(lines))


class Kink(NamedTuple):
    """An expression in C whose sign changes where the rates have a kink or jump, and its meaning."""

    expression: str
    meaning: str


def c99(
    system: System,
    stem: str,
    precision: str = "double",
    kinks: tuple[Kink, ...] = (),
    *,
    derivatives: bool = False,
    noise: ObserverNoise | None = None,
) -> dict[str, str]:
    """Files of a system in C99: source, header and test program, by their names.

    With `kinks` the source also has a function that evaluates them; with `derivatives`, one for directional
    derivatives of the rates; with `noise`, the observer that assumes this noise.
    """
    parts, constants = printed(system, CONSTANTS if noise else ())
    suffix = "f" if precision == "float" else ""
    names = {"source": f"{stem}.c", "header": f"{stem}.h", "test": f"{stem}_test.c"}
    known = known_to_all(system, " * ")
    if derivatives:
        moving = {
            "valve": {*system.inputs, *system.states},
            "chamber": {*known["own_inputs"], *system.chamber_states},
            "piston": {"x", "v", "P_A", "P_B", "force"},
        }
        parts |= {f"{part}_changes": with_tangents(parts[part], of) for part, of in moving.items()}
    printer = CPrinter(constants, precision)
    known |= names | {part: _body(of, precision, printer) for part, of in parts.items()}
    known |= {
        "f": precision,
        "suffix": suffix,
        "constants": constants,
        "spring": bool(system.plant.cylinder.spring),
        "v_before": bool(system.plant.cylinder.coulomb),
        "lengths": {name: f"{value:g}{suffix}" for name, value in LENGTHS.items()},
        "stage": digits(STAGE) + suffix,
        "kinks": kinks,
        "derivatives": derivatives,
        "noise": noise,
        "identity": f"{crc32(repr((system, precision, noise)).encode()):#010x}",
        "of_filter": {"steps": STEPS, "first": FIRST_VARIANCES, "first_pressure": FIRST_PRESSURE},
        "vectors": known_steps(system),
        "scale": system.scale,
        "tolerance": TOLERANCE[precision],
    }
    templates = {"source": "model.c.j2", "header": "model.h.j2", "test": "test.c.j2"}
    return {names[key]: TEMPLATES.get_template(name).render(known) for key, name in templates.items()}
