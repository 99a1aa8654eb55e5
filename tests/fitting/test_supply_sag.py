"""A supply that sags unseen: what a fit then says of the valve."""

from dataclasses import replace

import numpy as np
import pytest

from pneumo import simulate
from pneumo.fitting.estimate import estimate
from pneumo.fitting.fit_problem import Problem, fit
from pneumo.fitting.least_squares import solution_at
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import stage_signals
from pneumo.fitting.supply_sag import sagging_supply
from pneumo.physics.models import FULL
from pneumo.quantities.table import VALVE
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import load_plant

H, SAG, NOISE = 5e-4, 0.04, 200.0  # s, fraction at full flow, Pa
T = H * np.arange(3000)
U = 2.0 * np.sin(9 * T) + 4.0 * np.sin(31 * T)  # V


@pytest.fixture(scope="module")
def record():
    """Signals of a run whose supply sags, and the plant without the sag."""
    plant = load_plant(TEMPLATE)
    run = simulate(plant._replace(sag=SAG), H, command=U)
    P = np.array([run.P_A, run.P_B]) + np.random.default_rng(1).normal(0.0, NOISE, (2, len(T)))
    return stage_signals(Measurement("m.csv", H, U, run.x, P), plant), plant


def problem_of(signals, plant):
    """Flows, exhaust and dead volumes of the cylinder to be fitted to the first two thirds of a record."""
    fixed = {"k_0": plant.k_0} | dict.fromkeys(VALVE, 0.0)
    return Problem(FULL, plant, signals.part(0, 2 * len(T) // 3), fixed, also=("exhaust",))


def test_intervals_hold_what_a_fit_with_the_sag_finds(record):
    signals, plant = record
    problem = problem_of(signals, plant)
    unseen = estimate(problem, signals, intervals=("k_xu", "exhaust", "V_d_A", "V_d_B"))
    with_sag = replace(problem, also=("exhaust", "sag"))
    seen = with_sag.values(fit(with_sag).theta)
    assert unseen.sag == pytest.approx(seen["sag"], rel=0.02) and seen["sag"] == pytest.approx(SAG, rel=0.02)
    assert all(unseen.low[name] < seen[name] < unseen.high[name] for name in unseen.low)
    assert abs(unseen.values["k_xu"] / seen["k_xu"] - 1) > 0.005  # which C alone takes for something else


def test_a_logged_supply_has_no_sag_to_allow_for(record):
    signals, plant = record
    logged = signals._replace(P_s=np.full(signals.u.shape, plant.conditions.P_s))
    assert estimate(problem_of(logged, plant), logged, intervals=("k_xu",)).sag == 0.0


def test_a_replay_that_fails_shows_no_sag(record):
    problem = problem_of(record[0]._replace(motion=3 * record[0].motion), record[1])  # beyond the stroke
    failed = solution_at(problem, problem.guess())
    assert sagging_supply(problem, failed, np.zeros((1, len(failed.theta))))[0] >= 0.0
