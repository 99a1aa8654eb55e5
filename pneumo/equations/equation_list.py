"""Equations of one chamber, of the piston and of its stops, in the order in which they are solved.

Each `Equation` calls functions of `pneumo.physics`. `pneumo.equations.system` evaluates
the equations on numbers; this module makes symbolic assignments of them, for the printers of `pneumo.export`.
Only the order of the calls is repeated from `pneumo.simulation`; tests compare the two. SymPy, whose import
takes 0.4 s, is loaded by the functions that need it.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from pneumo.configuration.experiment import Plant
from pneumo.configuration.valve_conversions import area_per_conductance
from pneumo.equations.branches import Choice, choices
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import (
    Chamber,
    Cylinder,
    Side,
    acceleration,
    heat_area,
    motion,
    stopped,
    volume,
    with_spring,
)
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
    """A function whose argument has all known quantities as attributes, and names for its results."""

    names: tuple[str, ...]
    function: Callable[[Any], Any]
    comment: str  # unit and number of the equation


class Equations(list[Equation]):
    """Equations in the order in which they are solved; `given` names inputs that end with a place."""

    def __init__(self, given: str = "") -> None:
        super().__init__()
        self.known = set(given.split())

    def let(
        self, names: str, comment: str, function: Callable[[Any], Any], at: str = "", **renamed: str
    ) -> None:
        """Append an equation: `names`, separated by spaces, are the first results of a function.

        `at` is a place, such as "_mid". It follows each of `names`, or replaces {} there, and each quantity
        of the function that is known at that place. `renamed` has other names of such quantities.
        """
        results = tuple(name.format(at) if "{}" in name else name + at for name in names.split())

        def first(k: Any) -> Any:
            result = function(_Placed(k, self.known, at, renamed) if at or renamed else k)
            return result[: len(results)] if isinstance(result, tuple) else result

        self.known |= {*results}
        self.append(Equation(results, first, comment))


class _Placed(NamedTuple):
    """Known quantities, of which a function uses those of a place by their names without it."""

    quantities: Any
    known: set[str]
    at: str
    renamed: dict[str, str]

    def __getattr__(self, name: str) -> Any:
        placed = name + self.at if name + self.at in self.known else name
        return getattr(self.quantities, self.renamed.get(name, placed))


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
) -> Equations:
    """Equations of the valve from the command u, or u_A and u_B, to the effective `u_valve`, or two of these.

    With a lag, `opening` is a state: results include its rate, or, in a substep of s seconds, its value at
    the end. A valve with `Paths` has their openings as results, such as `inlet_A`.
    """
    lag, null, dead_band = dynamics.lag, dynamics.null, dynamics.dead_band
    paths, equations = plant.valve.paths, Equations("u_A u_B opening_A opening_B" if two_valves else "")
    let = equations.let

    def followed(k: Any) -> tuple[Any, Any]:
        after = k.u_limited + (k.opening - k.u_limited) / (1 + k.s / lag + (k.s / lag) ** 2 / 2)
        return after, (k.opening + after) / 2

    for of in ("_A", "_B") if two_valves else ("",):
        limit = "u_valve" if dynamics.proportional else "u_limited"
        unit, spool = "V, limited" if dynamics.proportional else "V", "u_limited" + of
        let(limit, unit, lambda k: limited(k.u, plant.valve.u_max), of)
        if dynamics.proportional:
            continue
        if lag and substep:
            spool = f"opening{of}_mean"
            let("opening{}_after opening{}_mean", "V, first-order lag", followed, of)
        elif lag:
            spool = "opening" + of
            rate = lambda k: opening_rate(k.u_limited, k.opening, lag)  # noqa: E731
            let("dopening{}_dt", "V/s, first-order lag", rate, of)
        shut = lambda k: beyond_dead_band(k.spool, null, dead_band)  # noqa: E731
        let("u_valve", "V, beyond null offset and dead band", shut, of, spool=spool)
    for side in Side if paths.knots else ():
        sign, of = (1, f"_{side.name}") if two_valves else (side.sign, "")
        openings = lambda k, sign=sign, side=side: paths.openings(sign * k.u, side)  # noqa: E731
        let("inlet outlet", "V, openings of the paths", openings, f"_{side.name}", u=f"u_valve{of}")
    return equations


def chamber_equations(model: Model | None, n: Any, plant: Plant, valve: bool) -> Equations:
    """Equations of one chamber by a reduced model, or by the full order where `model` is None.

    Their inputs are (u, x, v, P, area, V_d), for the full order also T. Without `valve` the
    mass flow m takes the place of u; with `Paths` their openings do, `inlet` and `outlet`, with the critical
    ratios `b_inlet` and `b_outlet` if they differ. u, m, x and v are positive where they fill or enlarge
    this chamber.
    """
    gas, restrictions, c, cylinder, k_0, wall, _ = plant
    g, paths, equations = gas.gamma, restrictions.paths, Equations()
    let, row = equations.let, lane(model, n, g) if model else None

    def by_paths(k: Any) -> tuple[Any, Any]:
        ratios = (k.b_inlet, k.b_outlet) if paths.b else ()
        return path_flows((k.inlet, k.outlet), ratios, k.P, k.T, restrictions, gas, c)

    if model and row:
        law = "eq (6)" if model.temperature == "polytropic" else "constant"
        let("T", f"K, {law}", lambda k: temperature(k.P, c.P_0, c.T_0, row.a))
    let("V", "m^3", lambda k: volume(k.x, Chamber(k.area, k.V_d), cylinder))
    let("dV_dt", "m^3/s", lambda k: k.area * k.v)
    if valve and paths.knots:
        let("m_in m_out", "kg/s, eq (1)", by_paths)
    elif valve:
        through = lambda k: chamber_flows(k.u, k.P, k.T, restrictions, gas, c)  # noqa: E731
        let("m_in m_out", "kg/s, eqs (1), (2)", through)
    else:
        let("m_in m_out", "kg/s", lambda k: (k.m, 0.0) if k.m > 0 else (0.0, -k.m))
    let("area_ratio", "A_q(x)/A_q(0)", lambda k: heat_area(k.x, cylinder) / heat_area(0.0, cylinder))

    def air(k: Any) -> tuple[Any, Any, Any, Any, Any, Any]:
        return k.P, k.T, k.V, k.dV_dt, k.m_in, k.m_out

    def heat(k: Any) -> Any:
        conductance = wall_conductance(k_0, k.area_ratio, k.P * k.T / (c.P_0 * c.T_0), *wall)
        return wall_heat(k.T, conductance, c.T_amb)

    if model and row:
        numbers = k_0, c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, g, row
        comment = f"Pa/s, eq (10); wall heat: {WALL_EQUATION[model.wall]}"
        let("dP_dt", comment, lambda k: model_dP_dt(*air(k), k.area_ratio, *numbers))
    else:
        let("heat", "W, eqs (7), (8)", heat)
        let("dP_dt", "Pa/s, eq (4)", lambda k: dP_dt(*air(k), c.T_in, k.heat, g, g, g, gas.R, g))
        let("dT_dt", "K/s, eq (5)", lambda k: dT_dt(*air(k), c.T_in, k.heat, gas.R, g))
    return equations


def piston_equations(plant: Plant) -> Equations:
    """Equations of motion of the piston, eq (3), with the inputs (x, v, P_A, P_B, force)."""
    cylinder, equations = plant.cylinder, Equations()

    def of_piston(k: Any) -> Any:
        return acceleration(k.v, k.P_A, k.P_B, with_spring(k.force, k.x, cylinder), cylinder)

    equations.let("a", "m/s^2, eq (3)", of_piston)
    equations.let("dx_dt dv_dt", "m/s, m/s^2; 0 on a stop", lambda k: motion(k.x, k.v, k.a, cylinder))
    return equations


def stop_equations(plant: Plant) -> Equations:
    """Equation of the end stops: corrects (x, v) after a step that began with the velocity v_before."""
    equations = Equations()
    stops = lambda k: stopped(k.x, k.v, k.v_before, plant.cylinder)  # noqa: E731
    equations.let("x_after v_after", "m, m/s, end stops", stops)
    return equations


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


def symbolic(numbers: Numbers, prefix: str = "") -> Numbers:
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
    gas, valve, conditions, cylinder, _, wall, _ = plant
    valve = symbolic(valve)._replace(paths=_symbols_of_paths(valve.paths))
    gas = symbolic(gas)
    if gas.elliptic:  # a valve by its catalogue, with the figures of its data sheet
        area = _real("area_per_C")
        leak = valve.leak and _real("C_leak") * area
        valve = valve._replace(k_xu=_real("C") * area / valve.u_max, leak=leak)
        gas = gas._replace(critical_ratio=_real("b"))
    return Plant(gas, valve, symbolic(conditions), symbolic(cylinder), _real("k_0"), wall)


def _symbols_of_paths(paths: Paths) -> Paths:
    """Paths whose knots and openings are symbols named as in `constants`; openings that are 0 stay 0."""

    def table(path: str, openings: tuple[tuple[float, ...], ...]) -> tuple[tuple[Any, ...], ...]:
        return tuple(
            tuple(_real(f"{path}_{side}_{i}") if value else 0.0 for i, value in enumerate(values, 1))
            for side, values in zip("AB", openings, strict=bool(openings))
        )

    u = tuple(_real(f"knot_{i}") for i in range(1, paths.knots + 1))
    return paths._replace(u=u, supply=table("inlet", paths.supply), exhaust=table("outlet", paths.exhaust))


class _Symbols(dict[str, Any]):
    """Symbols by their names."""

    def __missing__(self, name: str) -> Any:
        return _real(name)


def statements(equations: list[Equation], wanted: set[str]) -> list[Statement]:
    """Symbolic assignments that compute the wanted names, in order, without those not needed for them."""
    needed, result = set(wanted), list[Statement]()
    for names, function, comment in reversed(equations):
        if needed & set(names):
            value = exact_numbers(choices(function, _Symbols()))
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
    "C": ("dm^3/(s bar)", "sonic conductance from the supply at u_max, ISO 6358"),
    "b": ("1", "critical pressure ratio, ISO 6358"),
    "C_leak": ("dm^3/(s bar)", "sonic conductance that stays open to either port"),
    "area_per_C": ("m^2 s bar/dm^3", "area of a conductance of 1, with the reference atmosphere of ISO 6358"),
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
    "spring": ("N/m", "rate of a return spring, whose force in mid-stroke is part of the load"),
    "k_0": ("W/K", "thermal conductance of the wall at equilibrium, eq (12)"),
    "n": ("1", "polytropic index"),
}


def _catalogue_figures(plant: Plant) -> dict[str, float]:
    """Figures of a valve's data sheet, with the units of `CONSTANTS`; conductances without their rounding."""
    gas, valve = plant.gas, plant.valve
    area = area_per_conductance(gas)
    figures = {"C": valve.k_xu * valve.u_max / area, "C_leak": valve.leak / area}
    rounded = {name: float(f"{value:.15g}") for name, value in figures.items()}
    return rounded | {"b": gas.critical_ratio, "area_per_C": area}


def constants(plant: Plant, n: float, dynamics: ValveDynamics = PROPORTIONAL) -> list[Constant]:
    """All numbers of a plant and its valve's dynamics, and the polytropic index n, as named constants."""
    paths = plant.valve.paths
    values = plant.valve._asdict() | plant.conditions._asdict() | plant.cylinder._asdict()
    values |= plant.gas._asdict() | {"gamma_": plant.gas.gamma, "k_0": plant.k_0, "n": n}
    values |= {f"valve_{name}": value for name, value in dynamics._asdict().items()}
    values |= _catalogue_figures(plant)
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
