"""Replays of several sets of parameters at once, their derivatives, and where a search begins and may go."""

import numpy as np
import pytest

from pneumo.configuration.parameters import accuracy
from pneumo.fit import fit_problem
from pneumo.fit.fit_problem import (
    FULL,
    Problem,
    as_logged,
    leaked_volume,
    pressure_and_jacobian,
    priors,
    replayed_pressures,
    sagging_supply,
    si_value,
)
from pneumo.fit.fitted_parameters import CAUSES
from pneumo.fit.stage_signals import StageSignals, stage_signals
from pneumo.physics.cylinder import heat_area
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation.fitted_pressures import pressures_on_flows

PERIOD, SAMPLES = 1e-3, 120
T = PERIOD * np.arange(SAMPLES)
MOVING = 0.03 * np.sin(20 * T)


def problem_of(plant, model=FULL, *, P=(3e5, 4e5), m=None, also=(), period=PERIOD):
    P = np.broadcast_to(np.array(P).reshape(2, -1), (2, SAMPLES))
    u = np.where(T < 0.05, 4.0, -4.0)
    return Problem(model, plant, stage_signals(period, u, MOVING, P, plant, m=m), {}, also=also)


@pytest.fixture(scope="module")
def sets(plant):
    """Sets of all parameters of the full order, each with another one changed, and their pressures."""
    problem = problem_of(plant, also=CAUSES)
    (low, high), first = problem.bounds(), problem.guess()
    middle = np.clip(first, low + 0.01 * (high - low), high)  # a lag, leaks and a dead band
    thetas = middle + 0.02 * np.concatenate([np.zeros((1, len(low))), np.diag(high - low)])
    return problem, thetas, replayed_pressures(problem, thetas)[0]


def test_a_set_in_company_is_replayed_as_alone_and_every_parameter_counts(sets):
    problem, thetas, P = sets
    for theta, pressure in zip(thetas, P, strict=True):
        np.testing.assert_allclose(pressure, replayed_pressures(problem, theta[None])[0, 0], rtol=1e-12)
    for name, pressure in zip(problem.names, P[1:], strict=True):
        moved = np.abs(pressure - P[0]).max(axis=1) > 1e-3  # Pa
        # The chambers share the valve and its supply alone.
        expected = {"A": [True, False], "B": [False, True]}.get(name[-1], [True, True])
        assert moved.tolist() == expected, name


def test_an_offset_is_added_to_the_pressure_of_its_sensor(sets):
    problem, _, P = sets
    low, high = problem.bounds()
    for side, name in enumerate(("offset_A", "offset_B")):
        i = problem.names.index(name)
        np.testing.assert_allclose((P[i + 1] - P[0])[side], 0.02 * (high[i] - low[i]), rtol=1e-6)


def test_a_wider_side_of_B_fills_and_empties_B_as_a_wider_valve_would(plant):
    problem = problem_of(plant, also=("C_B",))
    values = problem.values(problem.guess()) | dict.fromkeys(("lag", "dead_time", "null"), 0.0)
    wider, both = values | {"C_B": 1.5}, values | {"C_B": 1.0, "k_xu": 1.5 * values["k_xu"]}
    own, found, wide = replayed_pressures(
        problem, np.array([problem.inner(v) for v in (values, wider, both)])
    )[0]
    np.testing.assert_allclose(found, [own[0], wide[1]], rtol=1e-12)


def test_a_wall_conducts_its_k_0_where_flows_were_measured(plant):
    m = 1e-4 * np.sin(30 * T + np.array([[0.0], [1.0]]))
    problem = problem_of(plant, MODELS["M9"], m=m)
    values = problem.values(problem.guess()) | {"k_0": 3.0}
    found = replayed_pressures(problem, problem.inner(values)[None])[0]
    s, V_d, start = (
        problem.signals,
        *np.array([[[values[f"{key}_{c}"] for c in "AB"]] for key in ("V_d", "start")]),
    )
    lanes = lane_array([lane(MODELS["M9"], values["n"], plant.gas.gamma)])
    expected = pressures_on_flows(s.motion, s.flow, lanes, V_d, plant._replace(k_0=3.0), s.h, s.stride, start)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_derivatives_are_differences_of_each_parameter_alone_between_the_bounds(plant, monkeypatch):
    problem = problem_of(plant, also=("A_B", "C_B", "offset_A"))
    low, high = problem.bounds()
    rng, shape = np.random.default_rng(2), (2, *problem.signals.P.shape)  # of two motions
    slope = rng.normal(size=(*shape, len(low)))
    for i, name in enumerate(problem.names):
        if name[-1] in "AB":  # of one chamber
            slope[:, 1 if name[-1] == "A" else 0, :, i] = 0.0

    def linear(_problem, thetas):
        assert np.all((thetas >= low) & (thetas <= high))
        P = 1.0 + np.einsum("mcsp,tp->mtcs", slope, thetas)
        P[..., -1] = np.nan
        P[:, 1::2, :, -2], P[:, 2::2, :, -2] = np.inf, -np.inf
        return P

    monkeypatch.setattr(fit_problem, "scaled_pressures", linear)
    for theta in (low, high, 0.6 * low + 0.4 * high):
        P, J = pressure_and_jacobian(problem, theta)
        np.testing.assert_allclose(P[..., :-2], (1.0 + slope @ theta)[..., :-2], rtol=1e-9)
        # Rounding of an offset of 1e5 Pa over a step of 1e-4.
        np.testing.assert_allclose(J[:, :, :-2], slope[:, :, :-2], rtol=0, atol=1e-5)
        assert not J[:, :, -2:].any()  # after a pressure that was not positive nothing is known


@pytest.mark.parametrize(("period", "first"), [(1e-3, 3.1e5), (2e-3, 3e5), (1e-2, 3e5), (0.5e-3, 3.3e5)])
def test_a_search_begins_at_the_mean_pressure_of_2_ms_or_of_one_sample(plant, period, first):
    P = np.array([[3e5, 3.2e5, 3.4e5, 3.6e5, 9e5, 9e5]] * 2)
    signals = StageSignals(period, period, np.zeros((5, 3)), np.zeros((5, 3, 2)), P, 0.0, 0.0)
    problem = Problem(FULL, plant, signals, {})
    assert problem.values(problem.guess())["start_B"] == pytest.approx(first, rel=1e-9)


def test_a_search_begins_between_its_bounds_whatever_was_measured(plant):
    problem = problem_of(plant, P=(10 * plant.conditions.P_0, 0.01 * plant.conditions.P_0))
    (low, high), first = problem.bounds(), problem.guess()
    assert np.all((low < first) & (first < high))


def test_bounds_are_multiples_of_what_is_configured_or_of_the_walls_area(plant):
    problem = problem_of(plant, also=("dead_band",))
    for name, scale, ends in (
        ("lag", 1.0, (0.0, 0.05)),
        ("k_0", heat_area(0.0, plant.cylinder), (0.3, 1000.0)),
        ("k_xu", plant.valve.k_xu, (0.05, 20.0)),
        ("dead_band", plant.valve.u_max, (0.0, 0.2)),
    ):
        found = problem.bounds()[:, problem.names.index(name)]
        assert [si_value(name, end) for end in found] == pytest.approx(
            [scale * end for end in ends], rel=1e-9
        )


def test_a_measured_supply_is_not_fitted_but_all_else_that_is_configured(plant):
    signals = problem_of(plant).signals
    elliptic = plant._replace(gas=plant.gas._replace(elliptic=True))
    measured = signals._replace(P_s=np.full(signals.u.shape, 7e5))
    assert list(priors(elliptic, signals, accuracy(), 1e3)) == ["b", "P_s", "exhaust", "T_in"]
    assert list(priors(elliptic, measured, accuracy(), 1e3)) == ["b", "exhaust", "T_in"]


def test_a_supply_sags_by_the_command_at_the_beginning_of_each_step(plant):
    P_s, b, u_max = plant.conditions.P_s, plant.gas.critical_ratio, plant.valve.u_max
    P = np.array([np.full(2000, 0.5 * b * P_s), np.full(2000, 1.1 * P_s)])  # B is above the supply
    zero = np.zeros(2000)
    signals = stage_signals(1e-3, zero, zero, P, plant)

    def sag(u):
        signal = np.tile(np.array([u, -u, -u]), (len(signals.u), 1))
        return 1 - sagging_supply(signals, signal, plant, 0.2)[-1, 0] / P_s

    for u in (u_max, 0.05 * u_max):
        assert sag(u) == pytest.approx(0.2 * u / u_max, rel=1e-9)  # A is filled
        assert sag(-u) == pytest.approx(0.0, abs=1e-12)


def test_a_valve_leaks_from_the_supply_and_to_the_exhaust(plant):
    """A chamber at 2 bar, to which and from which the flow is sonic, beside a leaking piston."""
    count, part = 50, 0.02
    zero, c, gas = np.zeros(count), plant.conditions, plant.gas
    supply = np.linspace(6e5, 8e5, count)
    signals = stage_signals(2e-3, zero, zero, np.full((2, count), 2e5), plant, P_s=supply)
    sonic = gas.sonic_coefficient * plant.valve.k_xu * plant.valve.u_max / c.T_amb**0.5  # (1)
    found = leaked_volume(signals, plant, {"valve_leak": part})
    at = np.interp(signals.h * np.arange(len(found)), 2e-3 * np.arange(count), supply)
    expected = part * sonic * (2e5 - at) * gas.R * c.T_amb / 2e5
    np.testing.assert_allclose(found, np.column_stack([expected, expected]), rtol=1e-11)
    constant = leaked_volume(signals._replace(P_s=None), plant, {"valve_leak": part})
    np.testing.assert_allclose(constant, part * sonic * (2e5 - c.P_s) * gas.R * c.T_amb / 2e5, rtol=1e-11)
    # Past the piston at a ratio half way from b to 1, as an ellipse has it, in either direction.
    ratio = 0.5 + 0.5 * gas.critical_ratio
    for high in (0, 1):
        P = np.full((2, count), ratio * 4e5)
        P[high] = 4e5
        both = signals._replace(P=P, P_s=np.full_like(signals.u, 7e5))
        alone = leaked_volume(both, plant, {"piston_leak": part})
        flow = part * sonic * 4e5 * 0.75**0.5 * gas.R * c.T_amb
        np.testing.assert_allclose(alone[:, high], flow / 4e5, rtol=1e-11)
        np.testing.assert_allclose(alone[:, 1 - high], -flow / (ratio * 4e5), rtol=1e-11)
        leaks = [leaked_volume(both, plant, {name: part}) for name in ("piston_leak", "valve_leak")]
        together = leaked_volume(both, plant, dict.fromkeys(("piston_leak", "valve_leak"), part))
        np.testing.assert_allclose(together, sum(leaks), rtol=1e-11)


def test_pressures_logged_earlier_are_on_lines_between_the_samples():
    P = np.arange(20.0) ** 2
    late, early = (as_logged(P[None], 1e-3, {"skew": sign * 0.5e-3})[0] for sign in (1, -1))
    at = np.arange(20)
    np.testing.assert_allclose(late, np.interp(at + 0.5, at, P), rtol=1e-12)
    np.testing.assert_allclose(early, np.interp(at - 0.5, at, P), rtol=1e-12)
