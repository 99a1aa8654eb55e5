"""Equations of one chamber, of the piston and of its stops, in the order in which they are solved.

Each `Equation` names a function of `pneumo.physics` and its arguments. `pneumo.equations.system` evaluates
the equations on numbers; this module makes symbolic assignments of them, for the printers of `pneumo.export`.
Only the order of the calls is repeated from `pneumo.simulation`; tests compare the two. SymPy, whose import
takes 0.4 s, is loaded by the functions that need it.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from pneumo.configuration.experiment import Plant
from pneumo.equations.branches import Choice, choices
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Chamber, Cylinder, Side, acceleration, heat_area, motion, stopped, volume
from pneumo.physics.models import Model, lane, model_dP_dt, temperature
from pneumo.physics.valve import Conditions, Gas, Paths, Valve, chamber_flows, limited, path_flows
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics, beyond_dead_band, opening_rate


class Constant(NamedTuple):
    """A named number of the plant, with unit and meaning."""

    name: str
    value: float
    unit: str
    meaning: str

    @property
    def comment(self) -> str:
        """Unit, unless it is 1, and meaning, for a comment in source code."""
        return self.meaning if self.unit == "1" else f"{self.unit}, {self.meaning}"


class Equation(NamedTuple):
    """A function of `pneumo.physics`, with names for its arguments and its results."""

    names: tuple[str, ...]
    function: Callable[..., Any]
    arguments: tuple[str, ...]
    comment: str  # unit and number of the equation


def equation(names: str, function: Callable[..., Any], arguments: str, comment: str) -> Equation:
    """An `Equation` whose names and arguments are separated by spaces."""
    return Equation(tuple(names.split()), function, tuple(arguments.split()), comment)


class Statement(NamedTuple):
    """A symbolic assignment to one or more variables."""

    names: tuple[str, ...]
    value: Any  # an expression, or a tuple of them, or a `Choice` between either
    comment: str  # unit and number of the equation


PATHS = "inlet", "outlet"  # of a chamber, from the supply and to the atmosphere
ROOT_2 = 2**0.5  # SymPy takes it out of the root in eq (1)
WALL_EQUATION = {"none": "none", "k_0": "eq (13)", "lambda_0 A_q": "eq (11)", "lambda A_q": "eqs (7), (8)"}


def valve_equations(
    plant: Plant, dynamics: ValveDynamics, two_valves: bool, substep: bool = False
) -> list[Equation]:
    """Equations of the valve from the command u, or u_A and u_B, to the effective `u_valve`, or two of these.

    With a lag, `opening` is a state: results include its rate, or, in a substep of s seconds, its value at
    the end. A valve with `Paths` has their openings as results, such as `inlet_A`.
    """
    lag, null, dead_band = dynamics.lag, dynamics.null, dynamics.dead_band
    paths, equations = plant.valve.paths, list[Equation]()

    def rate(u: Any, opening: Any) -> Any:
        return opening_rate(u, opening, lag)

    def followed(u: Any, opening: Any, s: Any) -> tuple[Any, Any]:
        after = u + (opening - u) / (1 + s / lag + (s / lag) ** 2 / 2)
        return after, (opening + after) / 2

    def limit(u: Any) -> Any:
        return limited(u, plant.valve.u_max)

    def shut(u: Any) -> Any:
        return beyond_dead_band(u, null, dead_band)

    for of in ("_A", "_B") if two_valves else ("",):
        if dynamics.proportional:
            equations.append(equation(f"u_valve{of}", limit, f"u{of}", "V, limited"))
            continue
        equations.append(equation(f"u_limited{of}", limit, f"u{of}", "V"))
        spool, known = f"u_limited{of}", f"u_limited{of} opening{of}"
        if lag and substep:
            spool = f"opening{of}_mean"
            equations.append(
                equation(f"opening{of}_after {spool}", followed, f"{known} s", "V, first-order lag")
            )
        elif lag:
            spool = f"opening{of}"
            equations.append(equation(f"dopening{of}_dt", rate, known, "V/s, first-order lag"))
        equations.append(equation(f"u_valve{of}", shut, spool, "V, beyond null offset and dead band"))
    for side in Side if paths.knots else ():
        sign, of = (1, f"_{side.name}") if two_valves else (side.sign, "")
        openings = lambda u, sign=sign, side=side: paths.openings(sign * u, side)  # noqa: E731
        names = " ".join(f"{path}_{side.name}" for path in PATHS)
        equations.append(equation(names, openings, f"u_valve{of}", "V, openings of the paths"))
    return equations


def chamber_equations(model: Model | None, n: Any, plant: Plant, valve: bool) -> list[Equation]:
    """Equations of one chamber by a reduced model, or by the full order where `model` is None.

    Their inputs are (u, x, v, P, area, V_d), for the full order also T. Without `valve` the
    mass flow m takes the place of u; with `Paths` their openings do, `inlet` and `outlet`, with the critical
    ratios `b_inlet` and `b_outlet` if they differ. u, m, x and v are positive where they fill or enlarge
    this chamber.
    """
    gas, restrictions, c, cylinder, k_0 = plant
    g, A_q0, equations = gas.gamma, heat_area(0.0, cylinder), list[Equation]()
    row = lane(model, n, g) if model else None

    def add(names: str, function: Callable[..., Any], arguments: str, comment: str) -> None:
        equations.append(equation(names, function, arguments, comment))

    if model and row:
        law = "eq (6)" if model.temperature == "polytropic" else "constant"
        add("T", lambda P: temperature(P, c.P_0, c.T_0, row.a), "P", f"K, {law}")
    add("V", lambda x, *fields: volume(x, Chamber(*fields), cylinder), "x area V_d", "m^3")
    add("dV_dt", lambda v, area: area * v, "v area", "m^3/s")
    if valve and restrictions.paths.knots:

        def by_paths(inlet: Any, outlet: Any, P: Any, T: Any, *ratios: Any) -> tuple[Any, Any]:
            return path_flows((inlet, outlet), ratios, P, T, restrictions, gas, c)

        ratios = " b_inlet b_outlet" if restrictions.paths.b else ""
        add("m_in m_out", by_paths, f"inlet outlet P T{ratios}", "kg/s, eq (1)")
    elif valve:
        through = lambda u, P, T: chamber_flows(u, P, T, restrictions, gas, c)  # noqa: E731
        add("m_in m_out", through, "u P T", "kg/s, eqs (1), (2)")
    else:
        add("m_in m_out", lambda m: (m, 0.0) if m > 0 else (0.0, -m), "m", "kg/s")
    add("area_ratio", lambda x: heat_area(x, cylinder) / A_q0, "x", "A_q(x)/A_q(0)")
    known = "P T V dV_dt m_in m_out"
    if model and row:
        names = ("k_0", "P_0", "T_0", "T_in", "T_amb", "R", "gamma", "lane")
        rest = dict(zip(names, (k_0, c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, g, row), strict=True))
        comment = f"Pa/s, eq (10); wall heat: {WALL_EQUATION[model.wall]}"
        add("dP_dt", lambda *y: model_dP_dt(*y, **rest), f"{known} area_ratio", comment)
        return equations

    def heat(P: Any, T: Any, area_ratio: Any) -> Any:
        conductance = wall_conductance(k_0, area_ratio, P * T / (c.P_0 * c.T_0), 1.0, 0.5)
        return wall_heat(T, conductance, c.T_amb)

    def pressure(heat: Any, *y: Any) -> Any:
        return dP_dt(*y, T_inlet=c.T_in, heat=heat, n_V=g, n_in=g, n_out=g, R=gas.R, gamma=g)

    def warming(heat: Any, *y: Any) -> Any:
        return dT_dt(*y, T_in=c.T_in, heat=heat, R=gas.R, gamma=g)

    add("heat", heat, "P T area_ratio", "W, eqs (7), (8)")
    add("dP_dt", pressure, f"heat {known}", "Pa/s, eq (4)")
    add("dT_dt", warming, f"heat {known}", "K/s, eq (5)")
    return equations


def piston_equations(plant: Plant) -> list[Equation]:
    """Equations of motion of the piston, eq (3), with the inputs (x, v, P_A, P_B, force)."""
    forces = lambda *y: acceleration(*y, cylinder=plant.cylinder)  # noqa: E731
    moves = lambda *y: motion(*y, cylinder=plant.cylinder)  # noqa: E731
    return [
        equation("a", forces, "v P_A P_B force", "m/s^2, eq (3)"),
        equation("dx_dt dv_dt", moves, "x v a", "m/s, m/s^2; 0 on a stop"),
    ]


def stop_equations(plant: Plant) -> list[Equation]:
    """Equation of the end stops: corrects (x, v) after a step that began with the velocity v_before."""
    stops = lambda *y: stopped(*y, cylinder=plant.cylinder)  # noqa: E731
    return [equation("x_after v_after", stops, "x v v_before", "m, m/s, end stops")]


def exact_numbers(value: Any) -> Any:
    """Expression, tuple or `Choice` in which multiples of 1/2, and sqrt(2), are exact instead of floats."""
    if isinstance(value, Choice):
        condition, yes, no = map(exact_numbers, value)
        return yes if yes == no else Choice(condition, yes, no)
    if isinstance(value, tuple):
        return tuple(exact_numbers(part) for part in value)
    import sympy

    value = sympy.sympify(value)
    floats = value.atoms(sympy.Float)
    exact = {f: sympy.Rational(int(2 * f), 2) for f in floats if float(2 * f).is_integer()}
    return value.xreplace(exact | {f: sympy.sqrt(2) for f in floats if float(f) == ROOT_2})


def names_in(value: Any) -> set[str]:
    """Names of the symbols in an expression, a tuple or a `Choice`."""
    if isinstance(value, tuple):  # a choice is one
        return set().union(*(names_in(part) for part in value))
    return {symbol.name for symbol in value.free_symbols}


def _real(name: str) -> Any:
    from sympy import Symbol

    return Symbol(name, positive=True) if name == "u_max" else Symbol(name, real=True)


Numbers = TypeVar("Numbers", bound=Gas | Valve | Conditions | Cylinder | ValveDynamics)


def _symbolic(numbers: Numbers, prefix: str = "") -> Numbers:
    """Named tuple whose numbers are symbols of their names; a number that is the default stays."""
    defaults = numbers._field_defaults
    symbols = {
        name: _real("gamma_" if name == "gamma" else prefix + name)
        for name, value in numbers._asdict().items()
        if not isinstance(value, bool | tuple) and value != defaults.get(name)
    }
    return numbers._replace(**symbols)


def symbols_of(plant: Plant) -> Plant:
    """A plant whose numbers are symbols named as in `constants`; an absent load, friction or leak stays 0."""
    gas, valve, conditions, cylinder, _ = plant
    valve = _symbolic(valve)._replace(paths=_symbols_of_paths(valve.paths))
    return Plant(_symbolic(gas), valve, _symbolic(conditions), _symbolic(cylinder), _real("k_0"))


def symbols_of_valve(dynamics: ValveDynamics) -> ValveDynamics:
    """Valve dynamics whose numbers are symbols, named as in `constants`; what is 0 stays 0."""
    return _symbolic(dynamics, "valve_")


def _symbols_of_paths(paths: Paths) -> Paths:
    """Paths whose knots and openings are symbols named as in `constants`; openings that are 0 stay 0."""

    def table(path: str, openings: tuple[tuple[float, ...], ...]) -> tuple[tuple[Any, ...], ...]:
        return tuple(
            tuple(_real(f"{path}_{side}_{i}") if value else 0.0 for i, value in enumerate(values, 1))
            for side, values in zip("AB", openings, strict=bool(openings))
        )

    u = tuple(_real(f"knot_{i}") for i in range(1, paths.knots + 1))
    return paths._replace(u=u, supply=table("inlet", paths.supply), exhaust=table("outlet", paths.exhaust))


def statements(equations: list[Equation], wanted: set[str]) -> list[Statement]:
    """Symbolic assignments that compute the wanted names, in order, without those not needed for them."""
    needed, result = set(wanted), list[Statement]()
    for names, function, arguments, comment in reversed(equations):
        if needed & set(names):
            value = exact_numbers(choices(function, *map(_real, arguments)))
            needed |= names_in(value)
            result.insert(0, Statement(names, value, comment))
    return result


def _tangent(value: Any, moving: set[str]) -> Any:
    if isinstance(value, Choice):
        return Choice(value.condition, _tangent(value.yes, moving), _tangent(value.no, moving))
    if isinstance(value, tuple):
        return tuple(_tangent(part, moving) for part in value)
    from sympy import Add

    terms = (value.diff(s) * _real(f"d_{s.name}") for s in value.free_symbols if s.name in moving)
    return Add(*terms)


def with_tangents(given: list[Statement], moving: set[str]) -> list[Statement]:
    """Statements with their first-order derivatives, for source code that linearises.

    After each statement comes one that computes the change ``d_name`` of its names from the changes
    ``d_name`` of the names in `moving` and of all names computed before.
    """
    result, moving = list[Statement](), set(moving)
    for statement in given:
        names = tuple(f"d_{name}" for name in statement.names)
        change = exact_numbers(_tangent(statement.value, moving))
        result += [statement, Statement(names, change, f"change of {', '.join(statement.names)}")]
        moving |= set(statement.names)
    return result


CONSTANTS = {  # unit and meaning of each number, in the order of exports
    "R": ("J/(kg K)", "gas constant"),
    "gamma_": ("1", "ratio of specific heats"),
    "sonic_coefficient": ("s K^0.5/m", "eq (1)"),
    "critical_ratio": ("1", "P_d/P_u at which flow becomes sonic, eq (1)"),
    "k_xu": ("m^2/V", "valve area per volt, eq (2)"),
    "laminar": ("1", "1 - P_d/P_u below which flow is proportional to it"),
    "exhaust": ("1", "area to the atmosphere over area from the supply"),
    "leak": ("m^2", "area that stays open to either port"),
    "u_max": ("V", "limit of the command"),
    "valve_lag": ("s", "time constant of the valve's lag"),
    "valve_null": ("V", "command at which the valve is shut"),
    "valve_dead_band": ("V", "to either side, where it stays shut"),
    "P_s": ("Pa", "supply"),
    "P_atm": ("Pa", "atmosphere"),
    "T_in": ("K", "incoming air"),
    "T_amb": ("K", "walls"),
    "P_0": ("Pa", "equilibrium"),
    "T_0": ("K", "equilibrium"),
    "bore": ("m", "diameter phi"),
    "stroke": ("m", "stroke l"),
    "V_d_A": ("m^3", "dead volume, chamber A"),
    "V_d_B": ("m^3", "dead volume, chamber B"),
    "A_A": ("m^2", "piston area, chamber A"),
    "A_B": ("m^2", "piston area, chamber B"),
    "M": ("kg", "moving mass with load"),
    "k_f": ("N s/m", "viscous friction"),
    "x_min": ("m", "end stop where chamber A is smallest"),
    "x_max": ("m", "end stop where chamber B is smallest"),
    "load": ("N", "constant force towards a larger chamber A"),
    "coulomb": ("N", "Coulomb friction"),
    "k_0": ("W/K", "thermal conductance of the wall at equilibrium, eq (12)"),
    "n": ("1", "polytropic index"),
}


def constants(plant: Plant, n: float, dynamics: ValveDynamics = PROPORTIONAL) -> list[Constant]:
    """All numbers of a plant and its valve's dynamics, and the polytropic index n, as named constants."""
    paths = plant.valve.paths
    values = plant.valve._asdict() | plant.conditions._asdict() | plant.cylinder._asdict()
    values |= plant.gas._asdict() | {"gamma_": plant.gas.gamma, "k_0": plant.k_0, "n": n}
    values |= {f"valve_{name}": value for name, value in dynamics._asdict().items()}
    result = [Constant(name, values[name], *of) for name, of in CONSTANTS.items()]
    result += [Constant(f"knot_{i}", u, "V", "own command of a chamber") for i, u in enumerate(paths.u, 1)]
    where = {"inlet": ("from the supply", paths.supply), "outlet": ("to the atmosphere", paths.exhaust)}
    for path, (to, table) in where.items():
        for side, openings in zip("AB", table, strict=bool(table)):
            result += [
                Constant(f"{path}_{side}_{i}", opening, "V", f"opening {to} at knot {i}, chamber {side}")
                for i, opening in enumerate(openings, 1)
            ]
    for side, ratios in zip("AB", paths.b, strict=bool(paths.b)):
        result += [
            Constant(f"b_{path}_{side}", b, "1", f"critical ratio, {path} of chamber {side}")
            for path, b in zip(PATHS, ratios, strict=True)
        ]
    return result
