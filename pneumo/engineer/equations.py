"""One chamber's equations as symbolic assignments, for the printers of `pneumo.engineer.export`.

The functions of `pneumo.physics` are evaluated on SymPy symbols. Only the order in which
`pneumo.simulation.reference.lane_rate` calls them is repeated here; tests compare the two.
"""

from typing import Any, NamedTuple

import sympy

from pneumo.configuration.experiment import Plant
from pneumo.engineer.branches import Choice, choices
from pneumo.physics.cylinder import Cylinder, heat_area, volume
from pneumo.physics.models import Model, lane, model_dP_dt, temperature
from pneumo.physics.valve import Conditions, Gas, Valve, chamber_flows, limited


class Constant(NamedTuple):
    """A number of the plant, under the paper's name; the comment has unit and meaning."""

    name: str
    value: float
    comment: str


class Statement(NamedTuple):
    """An assignment of one expression, or a `Choice` between tuples of expressions, to variables.

    The comment has unit and number of the equation.
    """

    names: tuple[str, ...]
    value: Any
    comment: str


ARGUMENTS = ("u", "x", "v", "P", "area")  # outward from the chamber, but u before its limiter
AREAS = ("A_A", "A_B")  # passed as `area`
ROOT_2 = 2**0.5  # SymPy takes it out of the root in eq (1)
WALL_EQUATION = {"none": "none", "k_0": "eq (13)", "lambda_0 A_q": "eq (11)", "lambda A_q": "eqs (7), (8)"}


def exact_numbers(value: Any) -> Any:
    """Expression, tuple or choice with whole numbers, halves and the root of 2 exact."""
    if isinstance(value, Choice):
        return Choice(*(exact_numbers(part) for part in value))
    if isinstance(value, tuple):
        return tuple(exact_numbers(part) for part in value)
    value = sympy.sympify(value)
    floats = value.atoms(sympy.Float)
    exact = {f: sympy.Rational(int(2 * f), 2) for f in floats if float(2 * f).is_integer()}
    return value.xreplace(exact | {f: sympy.sqrt(2) for f in floats if float(f) == ROOT_2})


def names_in(value: Any) -> set[str]:
    """Names of the symbols in an expression, a tuple or a choice."""
    if isinstance(value, tuple):  # a choice is one
        return set().union(*(names_in(part) for part in value))
    return {symbol.name for symbol in value.free_symbols}


def statements(model: Model, plant: Plant) -> list[Statement]:
    """Assignments that compute dP_dt of one chamber by a model; only those that model and valve need.

    Symbols are named as in `used_constants`; `ARGUMENTS` are those of the function.
    """

    def real(name: str) -> Any:
        return sympy.Symbol(name, real=True)

    u, x, v, P, area = (real(name) for name in ARGUMENTS)
    T, V, dV_dt, m_in, m_out, area_ratio = map(real, ("T", "V", "dV_dt", "m_in", "m_out", "area_ratio"))
    u_max: Any = sympy.Symbol("u_max", positive=True)
    names = ("R", "gamma_", "sonic_coefficient", "critical_ratio")
    gas = Gas._make([*map(real, names), plant.gas.elliptic])
    usual = Valve(real("k_xu"), u_max)  # properties that the valve lacks stay numbers and drop out
    unusual = [
        name for name in ("laminar", "exhaust", "leak") if getattr(plant.valve, name) != getattr(usual, name)
    ]
    valve = usual._replace(**{name: real(name) for name in unusual})
    c = Conditions(*(real(name) for name in Conditions._fields))
    cylinder = Cylinder(*(real(name) for name in Cylinder._fields))
    k_0, row = real("k_0"), lane(model, real("n"), gas.gamma)
    flows = choices(lambda u, P, T: chamber_flows(u, P, T, valve, gas, c), real("u_limited"), P, T)
    rest = (c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, gas.gamma)
    dP_dt = model_dP_dt(P, T, V, dV_dt, m_in, m_out, area_ratio, k_0, *rest, row)
    law = "eq (6)" if model.temperature == "polytropic" else "constant"
    every = [
        Statement(("u_limited",), choices(lambda u: limited(u, valve.u_max), u), "V"),
        Statement(("T",), temperature(P, c.P_0, c.T_0, row.a), f"K, {law}"),
        Statement(("V",), volume(x, area, cylinder), "m^3"),
        Statement(("dV_dt",), area * v, "m^3/s"),
        Statement(("m_in", "m_out"), flows, "kg/s, eqs (1), (2)"),
        Statement(("area_ratio",), heat_area(x, cylinder) / heat_area(0.0, cylinder), "A_q(x)/A_q(0)"),
        Statement(("dP_dt",), dP_dt, f"Pa/s, eq (10); wall heat: {WALL_EQUATION[model.wall]}"),
    ]
    every = [statement._replace(value=exact_numbers(statement.value)) for statement in every]
    needed: set[str] = {"dP_dt"}
    kept: list[Statement] = []
    for statement in reversed(every):
        if needed & set(statement.names):
            needed |= names_in(statement.value)
            kept.insert(0, statement)
    return kept


def used_constants(model: Model, plant: Plant, n: float) -> list[Constant]:
    """Constants that a model's statements need, and both piston areas."""
    gas, valve, c, cylinder, k_0 = plant
    every = [
        Constant("R", gas.R, "J/(kg K), gas constant"),
        Constant("gamma_", gas.gamma, "ratio of specific heats"),
        Constant("sonic_coefficient", gas.sonic_coefficient, "s K^0.5/m, eq (1)"),
        Constant("critical_ratio", gas.critical_ratio, "P_d/P_u at which flow becomes sonic, eq (1)"),
        Constant("k_xu", valve.k_xu, "m^2/V, valve area per volt, eq (2)"),
        Constant("laminar", valve.laminar, "1 - P_d/P_u below which flow is proportional to it"),
        Constant("exhaust", valve.exhaust, "area to the atmosphere over area from the supply"),
        Constant("leak", valve.leak, "m^2, area that stays open to either port"),
        Constant("u_max", valve.u_max, "V, limit of the command"),
        Constant("P_s", c.P_s, "Pa, supply"),
        Constant("P_atm", c.P_atm, "Pa, atmosphere"),
        Constant("T_in", c.T_in, "K, incoming air"),
        Constant("T_amb", c.T_amb, "K, walls"),
        Constant("P_0", c.P_0, "Pa, equilibrium"),
        Constant("T_0", c.T_0, "K, equilibrium"),
        Constant("bore", cylinder.bore, "m, diameter phi"),
        Constant("stroke", cylinder.stroke, "m, stroke l"),
        Constant("V_d", cylinder.V_d, "m^3, dead volume"),
        Constant("A_A", cylinder.A_A, "m^2, piston area, chamber A"),
        Constant("A_B", cylinder.A_B, "m^2, piston area, chamber B"),
        Constant("k_0", k_0, "W/K, thermal conductance of the wall at equilibrium, eq (12)"),
        Constant("n", n, "polytropic index"),
    ]
    needed = names_in(tuple(statement.value for statement in statements(model, plant))) | set(AREAS)
    return [constant for constant in every if constant.name in needed]
