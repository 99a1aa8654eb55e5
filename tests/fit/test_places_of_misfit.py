"""Where a misfit is placed: samples, not the stages between them, count, however slow the logger is."""

import numpy as np
import pytest

from pneumo.fit import fit_warnings as warnings
from pneumo.fit.fit_problem import FULL, Problem
from pneumo.fit.fit_result import Estimate
from pneumo.fit.stage_signals import StageSignals

STAGES = np.array([0.0, 0.5, 1.0])
TWO = np.zeros(2)


def stages_of(samples):
    """Values at the stages of two steps between each two samples, on a line."""
    at = (np.arange(2 * len(samples) - 2)[:, None] + STAGES) / 2
    return np.interp(at, np.arange(len(samples)), samples)


def placed(plant, where, *, u=0.5, x=0.0, P=3e5, period=0.02):
    """Place of a misfit in the samples `where`; command over its limit, position over half the stroke."""
    u, x, P = (np.broadcast_to(signal, where.shape) for signal in (u, x, P))
    motion = np.stack([stages_of(x) * plant.cylinder.stroke / 2, np.zeros((2 * len(where) - 2, 3))], axis=-1)
    u = stages_of(u * plant.valve.u_max)
    signals = StageSignals(period, period / 2, u, motion, np.array([P, 0.5 * P]), 0.0, 0.0)
    residual = np.where(where, 2e3, 2.0) * np.array([[1.0], [-1.0]])
    estimate = Estimate({}, {}, {}, TWO, TWO, signals.P - residual)
    return warnings.place_of_misfit(Problem(FULL, plant, signals, {}), estimate)


def samples(*at, count=100):
    return np.isin(np.arange(count), at)


def test_a_command_is_small_at_its_samples_and_at_the_last(plant):
    at = samples(50, 99)
    # On a line to the next sample it is no longer small after a quarter of the time.
    text = placed(plant, at, u=np.where(at, 0.09, 1.0))
    assert text == ", 100 % of it where u is below 10 % of its limit (2 % of the time)"


def test_a_stop_is_met_at_a_sample_or_at_the_last(plant):
    stop, after = samples(50, 99), samples(50, 51, 52, 99)  # 50 ms later at most
    text = placed(plant, after, x=np.where(stop, 0.985, 0.0))
    assert text == ", 100 % of it within 50 ms of a stop (4 % of the time)"


@pytest.mark.parametrize(("period", "after"), [(0.02, (39, 40, 41)), (0.2, (39, 40))])
def test_a_reversal_has_an_end_and_the_end_of_the_record_is_none(plant, period, after):
    u = np.where(np.arange(100) < 40, 0.5, -0.5)
    text = placed(plant, samples(40), u=u, period=period)
    assert text == f", 100 % of it within 50 ms of a reversal of u ({len(after)} % of the time)"
    text = placed(plant, samples(*after), u=u, period=period)
    assert text.startswith(", 100 % of it within 50 ms of a reversal")


@pytest.mark.parametrize(("count", "per_cent"), [(116, 46), (117, 47)])
def test_a_place_in_almost_half_of_the_time_is_said_in_per_cent_of_it(plant, count, per_cent):
    at = np.arange(250) < count
    text = placed(plant, at, u=np.where(at, 0.05, 0.5))
    assert text == f", 100 % of it where u is below 10 % of its limit ({per_cent} % of the time)"
    more = np.arange(250) < 126  # more than half
    assert placed(plant, more, u=np.where(more, 0.05, 0.5)) == ""


def test_a_place_with_less_than_half_of_the_misfit_is_not_named_and_of_two_the_worse_is(plant):
    small, high = samples(*range(8)), samples(*range(50, 58))
    signals = {"u": np.where(small, 0.05, 0.5), "P": np.where(high, 6e5, 3e5)}
    assert placed(plant, samples(*range(4), *range(20, 26)), **signals) == ""
    text = placed(plant, samples(*range(8), *range(50, 52)), **signals)
    assert text.startswith(", 80 % of it where u is below")
    both = {"u": np.where(small, 0.05, 0.5), "P": np.where(small | high, 6e5, 3e5)}
    text = placed(plant, samples(*range(8), *range(50, 55)), **both)
    assert text.startswith(", 100 % of it above 480 kPa")


@pytest.mark.parametrize(("kPa", "said"), [(500.6, "501"), (500.4, "500")])
def test_a_high_pressure_is_said_to_its_third_digit(plant, kPa, said):
    at = samples(50)
    assert f"above {said} kPa" in placed(plant, at, P=np.where(at, kPa * 1e3 / 0.8, 3e5))
