"""Sections 2 and 3: checks of the paper's own formulas and constants, without any run.

Equations are tried on a fixed sample of states, against mass and energy balances that are written here
independently of `pneumo.physics`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from paper.study.paper_2006.results import StudyResults
from paper_verdict.findings import Finding
from pneumo.physics.chamber import dP_dt, dT_dt, wall_heat
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import MODELS, lane, model_dP_dt, temperature
from pneumo.physics.valve import Gas, choked_flow, critical_ratio, exact_gas, mass_flow, sonic_coefficient

SONIC, CRITICAL = 0.0404, 0.5283  # eq (1) as printed
GAMMA = 1.4
R = 287.0  # J/(kg K), ASSUME: not printed
P_S, P_ATM, T_AMB, P_0 = 7e5, 1e5, 293.0, 5.65e5  # Pa and K; P_ATM is not printed
STANDARD = (101325.0, 293.15)  # Pa, K: standard litre, Appendix 1
ROUNDING_OF_RATES = 1e-12  # relative; double precision after some ten operations


class State(NamedTuple):
    """A chamber at one instant, SI units, in the argument order of `dP_dt`; heat from wall to air, W."""

    P: float
    T: float
    V: float
    dV_dt: float
    m_in: float
    m_out: float
    T_in: float
    heat: float


def _twenty_states() -> list[State]:
    """Twenty random states of a chamber, the same in every verdict."""
    random = np.random.Generator(np.random.PCG64(2006))
    low = np.array([1.5e5, 250.0, 5e-6, -1e-4, 0.0, 0.0, 280.0, -20.0])
    high = np.array([6.9e5, 340.0, 2e-4, 1e-4, 1e-3, 1e-3, 310.0, 20.0])
    return [State(*map(float, row)) for row in low + (high - low) * random.random((20, len(low)))]


def _balances(s: State) -> tuple[float, float]:
    """Rates of pressure and temperature from mass and energy balance of a perfect gas, Pa/s and K/s."""
    c_v = R / (GAMMA - 1)
    m = s.P * s.V / (R * s.T)
    energy = s.m_in * GAMMA * c_v * s.T_in - s.m_out * GAMMA * c_v * s.T - s.P * s.dV_dt + s.heat
    rate_T = (energy / c_v - s.T * (s.m_in - s.m_out)) / m
    rate_P = (energy * (GAMMA - 1) - s.P * s.dV_dt) / s.V  # P V = (gamma - 1) m c_v T
    return rate_P, rate_T


def _size_of_terms(s: State) -> float:
    """Sum of the magnitudes of the terms of the pressure equation, Pa/s: the scale of rounding errors."""
    flows = R * (s.m_in * max(s.T_in, s.T) + s.m_out * s.T)
    return GAMMA * (s.P * abs(s.dV_dt) + flows + abs(s.heat)) / s.V


def _nearly_equal(a: float, b: float, scale: float) -> bool:
    return abs(a - b) <= ROUNDING_OF_RATES * max(abs(a), abs(b), scale)


def _equal_rates(*rates: Callable[[State], tuple[float, float]], words: str = "20 states") -> Finding:
    """Whether the two rates that each function returns, Pa/s, are equal but for rounding, in 20 states."""
    equal = [_nearly_equal(*pair(s), _size_of_terms(s)) for s in _twenty_states() for pair in rates]
    return Finding(holds=all(equal), shown=words)


# Section 2: flow and equilibrium


def branches_meet(_: StudyResults) -> Finding:
    """Whether sonic and subsonic flow of eq (1) agree at the pressure ratio 0.5283.

    To within half a unit in the last digit of 0.0404.
    """
    gas = Gas(R, GAMMA, SONIC, CRITICAL)
    sonic = choked_flow(1e-6, P_S, T_AMB, gas)
    ratio = mass_flow(1e-6, P_S, (CRITICAL + 1e-9) * P_S, T_AMB, gas) / sonic
    return Finding(holds=abs(ratio - 1) <= 0.00005 / SONIC, shown=f"subsonic over sonic flow {ratio:.5f}")


def areas_as_printed(results: StudyResults) -> Finding:
    """Whether eq (2) as printed gives no negative valve area."""
    area = results.plant("D").valve.k_xu * -1.0
    return Finding(holds=area >= 0, shown=f"at u = -1 V cylinder D's valve has an area of {area:g} m^2")


def half_bridge_ratios(air: float) -> tuple[float, float]:
    """P_0 / P_s by eq (17), with the exact coefficient and with 0.0404; `air`: gas constant, J/(kg K)."""
    exact, printed = exact_gas(air, GAMMA), Gas(air, GAMMA, SONIC, CRITICAL)
    return equilibrium_pressure(P_S, P_ATM, exact) / P_S, equilibrium_pressure(P_S, P_ATM, printed) / P_S


def half_bridge_ratio(_: StudyResults) -> Finding:
    """Root of eq (17) with the exact coefficient, over P_s."""
    exact, printed = half_bridge_ratios(R)
    return Finding(exact, shown=f"{printed:.5f} with the printed 0.0404 and R = {R:g} J/(kg K)")


def root_in_range(_: StudyResults, ranges: str) -> Finding:
    """Whether eq (17) has its root in the first range of Appendix 2, or none in the two others.

    `ranges`: ``first`` or the others.
    """
    gas = exact_gas(R, GAMMA)
    root = equilibrium_pressure(P_S, P_ATM, gas)
    if ranges == "first":
        inside = CRITICAL * P_S < root < P_S and P_ATM / root <= CRITICAL
        return Finding(holds=inside, shown=f"P_0 = {root / P_S:.4f} P_s")
    pressures = np.linspace(P_ATM, CRITICAL * P_S, 2001)[1:]
    least = min(mass_flow(1.0, P_S, P, T_AMB, gas) / mass_flow(1.0, P, P_ATM, T_AMB, gas) for P in pressures)
    return Finding(holds=least > 1, shown=f"flow in is at least {least:.2f} times the flow out")


def sonic_factor_as_printed() -> float:
    """Right-hand factor of eq (17) as printed, s K^0.5/m."""
    return 2 / (GAMMA + 1) * (2 * GAMMA / ((GAMMA - 1) * R)) ** 0.5


def as_in_eq_1(factor: float) -> dict[str, Any]:
    """Arguments of `Finding`: whether a sonic factor, s K^0.5/m, is the 0.0404 of eq (1); its value."""
    return {"holds": abs(factor - SONIC) <= 0.00005, "shown": f"it is {factor:.4f}"}


def standard_flow(gain: float, u: float) -> float:
    """Choked flow from supply by eq (1) as printed, standard litres per minute; `gain` in m^2/V, `u` in V."""
    density = STANDARD[0] / (R * STANDARD[1])
    return SONIC * P_S * gain * u / T_AMB**0.5 / density * 6e4


def largest_flow(results: StudyResults, cylinder: str) -> Finding:
    """Choked flow from supply at the largest command, standard litres per minute."""
    valve = results.plant(cylinder).valve
    return Finding(standard_flow(valve.k_xu, valve.u_max))


# Sections 2.3 and 3: equations


def temperature_equation_fits(factor_T: bool) -> bool:
    """Whether eq (5), with `factor_T` times T in its last term, follows from mass and energy balance."""

    def fits(s: State) -> bool:
        rate = dT_dt(*s._replace(heat=0.0), R, GAMMA)
        rate += (GAMMA - 1) / (s.P * s.V) * s.heat * (s.T if factor_T else 1.0)
        return _nearly_equal(rate, _balances(s)[1], s.T * _size_of_terms(s) / s.P)

    return all(map(fits, _twenty_states()))


def wall_heat_rates(T: float, sign: float) -> dict[str, float]:
    """Rates of temperature ("K/s") and of M7's pressure ("Pa/s") by wall heat alone.

    T is the air's temperature, K; the `sign` of wall heat is 1 as meant, -1 as printed.
    """
    heat = sign * wall_heat(T, 0.5, T_AMB)
    rate_T = dT_dt(P_0, T, 1e-5, 0.0, 0.0, 0.0, T_AMB, heat, R, GAMMA)
    return {"K/s": rate_T, "Pa/s": (GAMMA - 1) / 1e-5 * heat}


def wall_heat_as_printed(_: StudyResults, unit: str) -> Finding:
    """Whether wall heat, signed as printed, brings hot and cold air back to ambient temperature.

    `unit` chooses the rate of `wall_heat_rates`.
    """
    rates = {T: wall_heat_rates(T, -1.0)[unit] for T in (T_AMB - 20, T_AMB + 20)}
    holds = all(value * (T_AMB - T) > 0 for T, value in rates.items())
    return Finding(holds=holds, shown=", ".join(f"{v:+.3g} {unit} at {T:g} K" for T, v in rates.items()))


def _eq_9(s: State, T: float, rate_T: float) -> float:
    """Rate of pressure by eq (9), Pa/s, from temperature, K, and its rate, K/s."""
    return -s.P / s.V * s.dV_dt + R / s.V * T * (s.m_in - s.m_out) + s.P / T * rate_T


def _by_model(name: str, s: State, n: float, area: float, k_0: float, T_in: float) -> tuple[float, float]:
    """Temperature, K, and rate of pressure, Pa/s, of a reduced model; `area` is A_q(x) / A_q(x_0)."""
    row = lane(MODELS[name], n, GAMMA)
    T = temperature(s.P, P_0, T_AMB, row.a)
    of_chamber = s.P, T, s.V, s.dV_dt, s.m_in, s.m_out, area
    return T, model_dP_dt(*of_chamber, k_0, P_0, T_AMB, T_in, T_AMB, R, GAMMA, row)


def polytropic_pressure_equation(_: StudyResults) -> Finding:
    """Whether eq (10) in the form of M5 satisfies eq (9) when dT/dt follows from eq (6)."""

    def rates(s: State, n: float) -> tuple[float, float]:
        T, rate = _by_model("M5", s, n, 1.0, 0.5, T_AMB)
        return _eq_9(s, T, (n - 1) / n * T / s.P * rate), rate  # (6)

    at_n = [partial(rates, n=n) for n in (1.0, 1.2, 1.4)]
    return _equal_rates(*at_n, words="20 states at n = 1, 1.2 and 1.4")


# Computations of one line, from the paper's constants alone.
CONSTANTS: dict[str, Callable[[object], Finding]] = {
    # Ratio of sonic flow; exact coefficient of eq (1), s K^0.5/m; pressure at rest by the printed rule, Pa.
    "critical_pressure_ratio": lambda _: Finding(critical_ratio(GAMMA)),
    "coefficient_of_sonic_flow": lambda _: Finding(
        sonic_coefficient(R, GAMMA), shown=f"with R = {R:g} J/(kg K)"
    ),
    "equilibrium_pressure_as_printed": lambda _: Finding(0.8077 * P_S),
    # Appendix 2: P_s / P_atm at which P_atm / 0.5283 is 0.5283 P_s; sonic factor of eq (17).
    "three_ranges_from": lambda _: Finding(CRITICAL**-2),
    "eq_17_as_printed": lambda _: Finding(**as_in_eq_1(sonic_factor_as_printed())),
    # Whether k_x k_u u is an area if both gains are in mm/V: exponents of length and voltage.
    "units_as_printed": lambda _: Finding(
        holds=(1 + 1, -1 - 1 + 1) == (2, 0), shown="mm/V times mm/V times V is mm^2/V, not an area"
    ),
    # Whether eq (4) is the energy balance; whether eq (5) as printed follows from the balances.
    "pressure_equation_keeps_energy": lambda _: _equal_rates(
        lambda s: (dP_dt(*s, GAMMA, GAMMA, GAMMA, R, GAMMA), _balances(s)[0])
    ),
    "temperature_equation_as_printed": lambda _: Finding(
        holds=temperature_equation_fits(False), shown="the last term has the unit 1/s, not K/s"
    ),
    # Whether eq (9) with the balances' rate of temperature gives their rate of pressure.
    "gas_law_differentiated": lambda _: _equal_rates(
        lambda s: (_eq_9(s, s.T, _balances(s)[1]), _balances(s)[0])
    ),
}
