"""What the paper's own formulas and numbers say about a claim: computations that need no run.

Equations are tried on a fixed sample of states. Mass and energy balance are written out here once more, so
that no equation is compared with itself.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Experiment
from pneumo.papers.paper_2006.computations import features
from pneumo.papers.paper_2006.table1 import table_1
from pneumo.physics.chamber import dP_dt, dT_dt, wall_conductance, wall_heat
from pneumo.physics.cylinder import heat_area
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import MODELS, lane, model_dP_dt, temperature
from pneumo.physics.valve import Gas, choked_flow, critical_ratio, exact_gas, mass_flow, sonic_coefficient
from pneumo.verdict.published import read_table, table7, table9
from pneumo.verdict.sources import Absent, Finding, Results, computation

SONIC, CRITICAL = 0.0404, 0.5283  # eq (1) as printed
GAMMA = 1.4
R = 287.0  # J/(kg K), ASSUME: not printed
P_S, P_ATM, T_AMB, P_0 = 7e5, 1e5, 293.0, 5.65e5  # Pa and K; P_ATM is not printed
STANDARD = (101325.0, 293.15)  # Pa, K: standard litre, Appendix 1
ROUNDING = 1e-12  # relative; double precision after some ten operations


class State(NamedTuple):
    """A chamber at one instant, SI units; heat is the flow from the wall into the air, W."""

    P: float
    T: float
    V: float
    dV_dt: float
    m_in: float
    m_out: float
    T_in: float
    heat: float


def sample() -> Iterator[State]:
    """Yield twenty states of a chamber, always the same."""
    random = np.random.Generator(np.random.PCG64(2006))
    low = np.array([1.5e5, 250.0, 5e-6, -1e-4, 0.0, 0.0, 280.0, -20.0])
    high = np.array([6.9e5, 340.0, 2e-4, 1e-4, 1e-3, 1e-3, 310.0, 20.0])
    for row in low + (high - low) * random.random((20, len(low))):
        yield State(*map(float, row))


def balances(s: State) -> tuple[float, float]:
    """Rates of pressure and temperature from mass and energy balance of a perfect gas, Pa/s and K/s."""
    c_v = R / (GAMMA - 1)
    m = s.P * s.V / (R * s.T)
    energy = s.m_in * GAMMA * c_v * s.T_in - s.m_out * GAMMA * c_v * s.T - s.P * s.dV_dt + s.heat
    rate_T = (energy / c_v - s.T * (s.m_in - s.m_out)) / m
    rate_P = (energy * (GAMMA - 1) - s.P * s.dV_dt) / s.V  # P V = (gamma - 1) m c_v T
    return rate_P, rate_T


def _close(one: float, other: float, scale: float = 0.0) -> bool:
    return abs(one - other) <= ROUNDING * max(abs(one), abs(other), scale)


def _terms(s: State) -> float:
    """Size of the terms of the pressure equation, of which its rounding is a fraction, Pa/s."""
    flows = R * (s.m_in * max(s.T_in, s.T) + s.m_out * s.T)
    return GAMMA * (s.P * abs(s.dV_dt) + flows + abs(s.heat)) / s.V


def _first(results: Results, cylinder: str) -> Experiment:
    return next(iter(results.experiments(cylinder).values()))


# Tables 1, 2 and 4


@computation
def feature(results: Results, model: str, column: str) -> Finding:
    """One cell of Table 1, generated from the table of models."""
    row = next(features for features in table_1() if features.model == model)
    marks = {True: "✓", False: "×"}
    cells = {
        "wall_heat": marks[row.wall_heat],
        "mixing": marks[row.mixing],
        "temperature": row.temperature,
        "index": row.pressure_index,
    }
    return Finding(shown=cells[column])


@computation
def geometry(results: Results, cylinder: str, column: str) -> Finding:
    """Dead volume as a tenth of half the stroke, m^3, or heat transfer area in mid-stroke, m^2."""
    c = _first(results, cylinder).plant.cylinder
    return Finding(0.1 * c.A_A * c.stroke / 2 if column == "V_d" else heat_area(0.0, c))


@computation
def heat_transfer_coefficient(results: Results, cylinder: str, k_0: str) -> Finding:
    """lambda_0 = k_0 / A_q(x_0), W/(m^2 K): eq (12)."""
    return Finding(float(k_0) / heat_area(0.0, _first(results, cylinder).plant.cylinder))


# Section 2: flow and equilibrium


@computation
def critical_pressure_ratio(results: Results) -> Finding:
    """Pressure ratio of sonic flow for gamma = 1.4."""
    return Finding(critical_ratio(GAMMA))


@computation
def coefficient_of_sonic_flow(results: Results) -> Finding:
    """Exact coefficient of the sonic branch of eq (1), s K^0.5/m."""
    return Finding(sonic_coefficient(R, GAMMA), shown=f"with R = {R:g} J/(kg K)")


@computation
def branches_meet(results: Results) -> Finding:
    """Whether both branches of eq (1) agree at 0.5283, to half a unit of 0.0404."""
    gas = Gas(R, GAMMA, SONIC, CRITICAL)
    sonic = choked_flow(1e-6, P_S, T_AMB, gas)
    subsonic = mass_flow(1e-6, P_S, (CRITICAL + 1e-9) * P_S, T_AMB, gas)
    return Finding(
        holds=abs(subsonic / sonic - 1) <= 0.00005 / SONIC,
        shown=f"subsonic over sonic flow {subsonic / sonic:.5f}",
    )


@computation
def areas_as_printed(results: Results) -> Finding:
    """Whether eq (2) as printed gives no negative area."""
    area = _first(results, "D").plant.valve.k_xu * -1.0
    return Finding(holds=area >= 0, shown=f"at u = -1 V cylinder D's valve has an area of {area:g} m^2")


@computation
def equilibrium_pressure_as_printed(results: Results) -> Finding:
    """0.8077 times the supply pressure, Pa."""
    return Finding(0.8077 * P_S)


@computation
def half_bridge_ratio(results: Results) -> Finding:
    """Root of eq (17) with the exact coefficient, over P_s."""
    exact = equilibrium_pressure(P_S, P_ATM, exact_gas(R, GAMMA)) / P_S
    printed = equilibrium_pressure(P_S, P_ATM, Gas(R, GAMMA, SONIC, CRITICAL)) / P_S
    return Finding(exact, shown=f"{printed:.5f} with the printed 0.0404 and R = {R:g} J/(kg K)")


@computation
def three_ranges_from(results: Results) -> Finding:
    """P_s / P_atm at which P_atm / 0.5283 meets 0.5283 P_s."""
    return Finding(CRITICAL**-2)


@computation
def root_in_range(results: Results, ranges: str) -> Finding:
    """Whether the first range of Appendix 2 holds the root of eq (17), or the two others hold none."""
    gas = exact_gas(R, GAMMA)
    root = equilibrium_pressure(P_S, P_ATM, gas)
    if ranges == "first":
        inside = CRITICAL * P_S < root < P_S and P_ATM / root <= CRITICAL
        return Finding(holds=inside, shown=f"P_0 = {root / P_S:.4f} P_s")
    pressures = np.linspace(P_ATM, CRITICAL * P_S, 2001)
    surplus = [
        mass_flow(1.0, P_S, P, T_AMB, gas) / mass_flow(1.0, P, P_ATM, T_AMB, gas) for P in pressures[1:]
    ]
    return Finding(holds=min(surplus) > 1, shown=f"flow in is at least {min(surplus):.2f} times the flow out")


def sonic_factor_as_printed() -> float:
    """Right-hand factor of eq (17) as printed, s K^0.5/m."""
    return 2 / (GAMMA + 1) * (2 * GAMMA / ((GAMMA - 1) * R)) ** 0.5


@computation
def eq_17_as_printed(results: Results) -> Finding:
    """Whether the sonic factor printed in eq (17) is the 0.0404 of eq (1)."""
    factor = sonic_factor_as_printed()
    return Finding(holds=abs(factor - SONIC) <= 0.00005, shown=f"it is {factor:.4f}")


@computation
def largest_flow(results: Results, cylinder: str) -> Finding:
    """Choked flow from supply at the largest command, standard litres per minute."""
    plant = _first(results, cylinder).plant
    flow = SONIC * P_S * plant.valve.k_xu * plant.valve.u_max / T_AMB**0.5
    density = STANDARD[0] / (R * STANDARD[1])
    return Finding(flow / density * 6e4)


@computation
def units_as_printed(results: Results) -> Finding:
    """Whether mm/V for k_x and for k_u makes k_x k_u u an area."""
    length, volt = 1 + 1, -1 - 1 + 1  # exponents of mm/V times mm/V times V
    return Finding(holds=(length, volt) == (2, 0), shown="mm/V times mm/V times V is mm^2/V, not an area")


# Sections 2.3 and 3: equations


@computation
def pressure_equation_keeps_energy(results: Results) -> Finding:
    """Whether eq (4), with wall heat counted into the air, is the energy balance."""
    g = GAMMA
    holds = all(
        _close(
            dP_dt(s.P, s.T, s.V, s.dV_dt, s.m_in, s.m_out, s.T_in, s.heat, g, g, g, R, g),
            balances(s)[0],
            _terms(s),
        )
        for s in sample()
    )
    return Finding(holds=holds, shown="20 states")


def temperature_rate(s: State, factor_T: bool) -> float:
    """Rate of eq (5), K/s, with or without a factor T in its last term."""
    without_heat = dT_dt(s.P, s.T, s.V, s.dV_dt, s.m_in, s.m_out, s.T_in, 0.0, R, GAMMA)
    return without_heat + (GAMMA - 1) / (s.P * s.V) * s.heat * (s.T if factor_T else 1.0)


def temperature_equation_fits(factor_T: bool) -> bool:
    """Whether eq (5) follows from the balances, with or without a factor T in its last term."""
    return all(_close(temperature_rate(s, factor_T), balances(s)[1], s.T * _terms(s) / s.P) for s in sample())


@computation
def temperature_equation_as_printed(results: Results) -> Finding:
    """Whether eq (5) as printed, its sign of wall heat aside, follows from the balances."""
    return Finding(
        holds=temperature_equation_fits(factor_T=False), shown="the last term has the unit 1/s, not K/s"
    )


def wall_heat_rate(T: float, sign: float) -> float:
    """Rate of temperature by wall heat alone, K/s, with Q of eq (7) times a sign."""
    heat = sign * wall_heat(T, 0.5, T_AMB)
    return dT_dt(P_0, T, 1e-5, 0.0, 0.0, 0.0, T_AMB, heat, R, GAMMA)


def wall_heat_pressure_rate(T: float, sign: float) -> float:
    """Rate of pressure by wall heat alone in M7, Pa/s, with k_0 (T_amb - T) times a sign."""
    return (GAMMA - 1) / 1e-5 * sign * wall_heat(T, 0.5, T_AMB)


@computation
def wall_heat_as_printed(results: Results, equations: str) -> Finding:
    """Whether wall heat, signed as printed, brings hot and cold air back to ambient temperature."""
    rate = wall_heat_rate if equations == "full" else wall_heat_pressure_rate
    rates = {T: rate(T, -1.0) for T in (T_AMB - 20, T_AMB + 20)}
    holds = all(value * (T_AMB - T) > 0 for T, value in rates.items())
    unit = "K/s" if equations == "full" else "Pa/s"
    words = ", ".join(f"{value:+.3g} {unit} at {T:g} K" for T, value in rates.items())
    return Finding(holds=holds, shown=words)


@computation
def gas_law_differentiated(results: Results) -> Finding:
    """Whether eq (9), fed with the balance of temperature, gives the balance of pressure."""
    holds = True
    for s in sample():
        rate_P, rate_T = balances(s)
        eq_9 = -s.P / s.V * s.dV_dt + R / s.V * s.T * (s.m_in - s.m_out) + s.P / s.T * rate_T
        holds &= _close(eq_9, rate_P, _terms(s))
    return Finding(holds=holds, shown="20 states")


@computation
def polytropic_pressure_equation(results: Results) -> Finding:
    """Whether eq (10), as M5 has it, solves eq (9) with dT/dt from eq (6)."""
    holds = True
    for s in sample():
        for n in (1.0, 1.2, 1.4):
            row = lane(MODELS["M5"], n, GAMMA)
            T = temperature(s.P, P_0, T_AMB, row.a)
            rate = model_dP_dt(
                s.P, T, s.V, s.dV_dt, s.m_in, s.m_out, 1.0, 0.5, P_0, T_AMB, T_AMB, T_AMB, R, GAMMA, row
            )
            rate_T = (n - 1) / n * T / s.P * rate  # (6), differentiated
            eq_9 = -s.P / s.V * s.dV_dt + R / s.V * T * (s.m_in - s.m_out) + s.P / T * rate_T
            holds &= _close(eq_9, rate, _terms(s))
    return Finding(holds=holds, shown="20 states at n = 1, 1.2 and 1.4")


@computation
def wall_laws_agree(results: Results) -> Finding:
    """Whether eqs (7), (11) and (13) give one conductance at P_0, T_0 and x_0."""
    laws = [wall_conductance(0.5, 1.0, 1.0, e_A, e_PT) for e_A, e_PT in ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5))]
    return Finding(holds=len(set(laws)) == 1)


@computation
def same_right_hand_side(results: Results, one: str, other: str, n: float, k_0: float) -> Finding:
    """Whether two models have the same rate of pressure at one n and k_0."""
    holds = True
    for s in sample():
        rates = []
        for name in (one, other):
            row = lane(MODELS[name], n, GAMMA)
            T = temperature(s.P, P_0, T_AMB, row.a)
            rates.append(
                model_dP_dt(
                    s.P, T, s.V, s.dV_dt, s.m_in, s.m_out, 1.3, k_0, P_0, T_AMB, s.T_in, T_AMB, R, GAMMA, row
                )
            )
        holds &= _close(rates[0], rates[1], _terms(s))
    return Finding(holds=holds, shown="20 states")


# Section 4: counts and the set-up


@computation
def excitation_bandwidth(results: Results) -> Finding:
    """Half the rate of new random values, Hz."""
    experiment = _first(results, "D")
    return Finding(1 / (2 * experiment.excitation.every * experiment.h))


@computation
def conductances_enclose(results: Results, low: float, high: float) -> Finding:
    """Whether the two middle conductances enclose a range that the two others leave out."""
    found = sorted({experiment.plant.k_0 for experiment in results.study.experiments.values()})
    if len(found) != 4:
        raise Absent("this study has not the paper's four conductances")
    holds = found[0] < found[1] <= low and high <= found[2] < found[3]
    return Finding(holds=holds, shown=f"{found[1]:g} to {found[2]:g} W/K")


@computation
def step_of_n(results: Results) -> Finding:
    """Step of the grid of n."""
    return Finding(float(np.round(np.diff(results.study.n).mean(), 9)))


@computation
def number_of_n(results: Results) -> Finding:
    """Count the values of n."""
    return Finding(len(results.study.n))


@computation
def models_with_n(results: Results) -> Finding:
    """Count the models that carry n."""
    names = [model.name for model in MODELS.values() if model.has_n]
    return Finding(len(names), shown=", ".join(names))


@computation
def models_without_n(results: Results) -> Finding:
    """Count the models that carry no n."""
    names = [model.name for model in MODELS.values() if not model.has_n]
    return Finding(len(names), shown=", ".join(names))


@computation
def number_of_runs(results: Results) -> Finding:
    """Experiments times (models with n times values of n, plus models without)."""
    carrying = sum(model.has_n for model in MODELS.values())
    experiments = len(read_table(6))
    values = len(results.study.n)
    runs = experiments * (carrying * values + len(MODELS) - carrying)
    return Finding(runs, shown=f"{experiments} ({carrying} x {values} + {len(MODELS) - carrying})")


@computation
def simplest(results: Results, models: Sequence[str], claimed: str) -> Finding:
    """Whether a model carries the fewest processes."""
    count = {model: features(model) for model in models}
    alone = all(count[claimed] < count[model] for model in models if model != claimed)
    return Finding(
        holds=alone, shown=", ".join(f"{model} carries {number}" for model, number in count.items())
    )


def rows_within(divisor_is_N: bool) -> tuple[int, int]:
    """Rows of Tables 7 and 9 that eq (16) can produce, of how many.

    mu^2 + sigma^2 = MSE + s^2/N with the sample variance s^2 of the N means, which lies between 0 and
    sigma^2; with N as divisor of the variance, mu^2 + sigma^2 = MSE.
    """
    rows = [(table7().sel(model=model), 16) for model in MODELS]
    levels = table9()
    rows += [
        (levels.sel(level=level, model=model), 8) for level in levels["level"].values for model in MODELS
    ]
    fits = 0
    for row, N in rows:
        mu, sigma, mse = (float(row[name]) for name in ("mean_error", "std", "mse"))
        d_mu, d_sigma, d_mse = (float(row[f"{name}_half_unit"]) for name in ("mean_error", "std", "mse"))
        low = max(abs(mu) - d_mu, 0) ** 2 + (sigma - d_sigma) ** 2 - (mse + d_mse)
        high = (abs(mu) + d_mu) ** 2 + (sigma + d_sigma) ** 2 - (mse - d_mse)
        fits += low <= (0 if divisor_is_N else (sigma + d_sigma) ** 2 / N) and high >= 0
    return fits, len(rows)


@computation
def rows_fit_eq_16(results: Results) -> Finding:
    """Whether every row of Tables 7 and 9 is what eq (16) can give."""
    fits, rows = rows_within(divisor_is_N=False)
    other, _ = rows_within(divisor_is_N=True)
    return Finding(holds=fits == rows, shown=f"{fits} of {rows} rows fit with N - 1, {other} with N")
