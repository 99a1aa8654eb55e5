"""The physics on quantities with units: dimensions, and the same numbers as on plain floats."""

import re
from math import prod

import pint
import pytest

from pneumo.export.fmu import UNITS
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import Cylinder, acceleration, chamber_of, heat_area, volume
from pneumo.physics.models import MODELS, lane, model_dP_dt, temperature
from pneumo.physics.valve import Gas, choked_flow, mass_flow, sonic_coefficient
from pneumo.quantities.table import QUANTITIES

EPS = 2.0**-52
U = pint.get_application_registry()
# All different, so that a swap shows.
ARGUMENTS = {
    **{"P": (4.1e5, "Pa"), "V": (2.3e-5, "m^3"), "dV_dt": (1.1e-4, "m^3/s"), "m_in": (3e-4, "kg/s")},
    **{"m_out": (2e-4, "kg/s"), "T_amb": (291.0, "K"), "T_in": (297.0, "K"), "P_0": (5.65e5, "Pa")},
    **{"T_0": (293.0, "K"), "gamma": (1.4, ""), "R": (287.0, "J/(kg K)"), "k_0": (0.3, "W/K")},
    **{"area_ratio": (1.09, ""), "T": (301.0, "K"), "heat": (2.7, "W"), "A_t": (1e-6, "m^2")},
    **{"P_d": (3.3e5, "Pa"), "sonic_coefficient": (0.0404, "s K^0.5/m")},
}
PLAIN = {name: value for name, (value, _) in ARGUMENTS.items()}
# Exponents and ratios stay plain numbers.
WITH_UNITS = {name: U.Quantity(value, unit) if unit else value for name, (value, unit) in ARGUMENTS.items()}


def model(name, a):
    row = lane(MODELS[name], 1.15, a["gamma"])
    T = temperature(a["P"], a["P_0"], a["T_0"], row.a)
    names = ("V", "dV_dt", "m_in", "m_out", "area_ratio", "k_0", "P_0", "T_0", "T_in", "T_amb", "R", "gamma")
    return T, model_dP_dt(a["P"], T, *(a[name] for name in names), row)


def full_order(a):
    state = [a[name] for name in ("P", "T", "V", "dV_dt", "m_in", "m_out", "T_in", "heat")]
    g = a["gamma"]
    return dP_dt(*state, g, g, g, a["R"], g), dT_dt(*state, a["R"], g)


def gas_of(a):
    return Gas(a["R"], a["gamma"], a["sonic_coefficient"], 0.5283)


def flow(a, P_d):
    return mass_flow(a["A_t"], a["P"], P_d, a["T"], gas_of(a))


def heat(a, law):
    conductance = wall_conductance(a["k_0"], a["area_ratio"], a["P"] * a["T"] / (a["P_0"] * a["T_0"]), *law)
    return wall_heat(a["T"], conductance, a["T_amb"])


def cylinder_of(a):
    units = ("m", "m", "m^2", "m^2", "m^3", "m^3", "kg", "N s/m", "m", "m")
    numbers = (0.02, 0.1, 3.1e-4, 3.0e-4, 1.571e-6, 1.9e-6, 1.5, 100.0, -0.05, 0.05)
    quantities = (U.Quantity(*pair) for pair in zip(numbers, units, strict=True))
    return Cylinder(*(quantities if a is WITH_UNITS else numbers))


def length(a, x, unit="m"):
    return U.Quantity(x, unit) if a is WITH_UNITS else x


def acceleration_of(a):
    return acceleration(length(a, 0.3, "m/s"), a["P"], a["P_d"], length(a, 30.0, "N"), cylinder_of(a))


WALL_LAWS = {7: (1.0, 0.5), 11: (1.0, 0.0), 13: (0.0, 0.0)}
RATES = {
    **{f"{name} temperature": ("K", lambda a, name=name: model(name, a)[0]) for name in MODELS},
    **{f"{name} dP/dt": ("Pa/s", lambda a, name=name: model(name, a)[1]) for name in MODELS},
    "full-order dP/dt": ("Pa/s", lambda a: full_order(a)[0]),
    "full-order dT/dt": ("K/s", lambda a: full_order(a)[1]),
    "sonic mass flow": ("kg/s", lambda a: flow(a, 0.5 * a["P"])),
    "subsonic mass flow": ("kg/s", lambda a: flow(a, a["P_d"])),
    "choked flow": ("kg/s", lambda a: choked_flow(a["A_t"], a["P"], a["T"], gas_of(a))),
    "sonic coefficient": ("s K^0.5/m", lambda a: sonic_coefficient(a["R"], a["gamma"])),
    **{f"wall heat ({eq})": ("W", lambda a, law=law: heat(a, law)) for eq, law in WALL_LAWS.items()},
    "volume": ("m^3", lambda a: volume(length(a, 0.01), chamber_of(cylinder_of(a), 0), cylinder_of(a))),
    "heat area": ("m^2", lambda a: heat_area(length(a, 0.01), cylinder_of(a))),
    "acceleration": ("m/s^2", acceleration_of),
}


@pytest.mark.parametrize("name", RATES)
def test_units_come_out_and_the_numbers_with_them(name):
    unit, function = RATES[name]
    result = function(WITH_UNITS)
    assert result.is_compatible_with(unit)
    # Units are coherent, all factors 1, but pint may multiply by them in another order.
    assert result.m_as(unit) == pytest.approx(function(PLAIN), rel=8 * EPS)


def spelled(unit):
    """Unit as pint reads it: W K-1 is W*K**-1."""
    return re.sub(r"([A-Za-z])(-?\d+)", r"\1**\2", unit).replace(" ", "*")


def test_factors_of_fitted_quantities_and_base_units_of_fmus_are_those_of_pint():
    for quantity in QUANTITIES.values():
        shown = U.Quantity(1.0, spelled(quantity.unit)).m_as(spelled(quantity.shown_unit or quantity.unit))
        assert quantity.factor == pytest.approx(shown, rel=8 * EPS), quantity.name
    for name, powers in UNITS.items():
        units = {unit: power for unit, power in powers.items() if unit != "factor"}
        product = powers.get("factor", 1.0) * prod(
            U.Quantity(1.0, unit) ** power for unit, power in units.items()
        )
        assert product.m_as(spelled(name)) == pytest.approx(1.0, rel=8 * EPS), name
