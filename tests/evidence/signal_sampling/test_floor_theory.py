"""Floor of signal sampling without a replay: linear theory along a run, and the closed formula."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paper_study import lasting

import pneumo
from pneumo.errors import InputError
from pneumo.evidence.signal_sampling import floor_theory as theory
from pneumo.evidence.signal_sampling.error_budget import refined
from pneumo.evidence.signal_sampling.jump_errors import jump_errors, mean_of_ramp, pressure_rates
from pneumo.selection.runs import Run
from pneumo.simulation.chamber_replay import replay_chambers
from pneumo.simulation.full_order import record


def rms(error):
    return np.sqrt(np.mean(error**2))


@pytest.fixture(scope="module")
def fine():
    """Cylinder D in closed loop: jumps beyond the limiter, at a fine step."""
    e = refined(lasting("E10", 0.6), 20)
    return e, record(e)


@pytest.mark.uncompiled
def test_a_ramp_by_hand():
    assert mean_of_ramp(0.0, 20.0, 10.0) == (7.5, 0.0)
    assert mean_of_ramp(10.0, -10.0, 10.0) == (2.5, 2.5)
    assert mean_of_ramp(-40.0, -20.0, 10.0) == (0.0, 10.0)


volts = st.floats(-50, 50).map(lambda u: round(u, 3))


@pytest.mark.uncompiled
@given(volts, volts, st.floats(0.1, 20))
def test_a_ramp_has_the_mean_of_its_limited_values(u, w, u_max):
    if u == w:
        return
    line = np.linspace(u, w, 20_001).clip(-u_max, u_max)
    positive, negative = mean_of_ramp(u, w, u_max)
    # Trapezoids miss a kink by at most |w - u| / 20_000 in a mean.
    assert positive == pytest.approx(np.trapezoid(line.clip(0), dx=1 / 20_000), abs=5e-3)
    assert negative == pytest.approx(np.trapezoid((-line).clip(0), dx=1 / 20_000), abs=5e-3)


def test_jumps_on_samples_leave_a_held_command_right_and_the_start_is_one_without_delay(fine):
    _, recording = fine
    assert not jump_errors(recording, 20, False, 0.0, False, 1).any()
    late = jump_errors(recording, 20, False, 1.0, False, 1)
    early = jump_errors(recording, 20, True, 0.0, False, 1)
    assert rms(late) > rms(early) > rms(late) / 2 > 0  # more than half: the limiter cuts the lines
    _, recording = fine
    with_start = jump_errors(recording, 1, False, 0.0, True, 1)
    only_start = with_start - jump_errors(recording, 20, False, 1.0, False, 1)
    rates = pressure_rates(recording, 1)
    np.testing.assert_allclose(only_start[:, 0], rates[:, 0], rtol=1e-12)
    assert (abs(only_start[:, -1]) < 0.1 * abs(only_start[:, 0])).all()  # ten openings of the valve later


def test_everything_late_together_is_the_rate_of_pressure_and_averages_are_the_runs(fine):
    # Jumps and rest both late by one sample: full-order less replayed pressure is the rise of one sample.
    _, recording = fine
    jumps = jump_errors(recording, 1, False, 0.0, True, 1)
    rates = pressure_rates(recording, 1)
    hold = theory.predicted_error(recording, 1e-3, "hold")
    np.testing.assert_allclose(2 * hold / 1e-3 + jumps, rates, rtol=1e-12, atol=1e-6)
    rise = np.diff(recording.states[:, [2, 4]], axis=0).T / recording.h
    assert rms(rates[:, :-1] - rise) < 0.02 * rms(rise)  # a step of 50 us in transients of some ms
    e, recording = fine
    known = theory.averages(recording, e.excitation.every)
    draws = recording.reference[:: e.excitation.every]
    x = recording.states[:: e.excitation.every, 0]
    before, after = (e.drive.k_p * (r - x[1:]) for r in (draws[:-1], draws[1:]))
    jumps = after.clip(-10, 10) - before.clip(-10, 10)
    assert known.jump == pytest.approx(np.sqrt(np.mean(jumps**2)))
    assert known.draw == pytest.approx(0.05)
    assert 0.5 < known.early < 1  # jumps beyond the limiter
    assert known.opening == pytest.approx(abs(recording.u.clip(-10, 10)).mean())
    assert known.speed == pytest.approx(np.sqrt(np.mean(recording.states[:, 1] ** 2)))
    assert 0.7 < known.V / 1.728e-5 < 1  # of the volume at mid-stroke; the smaller ones weigh more


@pytest.mark.parametrize("name", ["E09", "E10", "E11", "E12"])
@pytest.mark.parametrize("sampling", ["linear", "hold", "delay"])
def test_theory_meets_replays_and_better_the_finer_the_samples(name, sampling):
    e = refined(lasting(name, 0.6), 20)
    recording = record(e)

    def deviation(period):
        every = round(period / e.h)
        replayed = replay_chambers(recording, theory.SHIFTS[sampling].sampling._replace(every=every))
        error = recording.states[:, [2, 4]].T - replayed
        predicted = theory.predicted_error(recording, period, sampling)
        return rms(predicted) / rms(error) - 1

    # First order in the period: 20 % is what is claimed up to 10 ms, and 1 ms is a tenth of that.
    assert abs(deviation(1e-3)) < 0.05
    assert abs(deviation(1e-2)) < 0.2


def test_hold_next_is_for_samples_at_every_step(plant):
    run = pneumo.simulate(plant, 1e-3, command=np.full(30, 0.3))
    with pytest.raises(InputError, match=r"period = 0\.002 s: must be h = 0\.001 s"):
        pneumo.sampling_floor(run, 2e-3, "hold_next")


def test_a_command_that_never_jumps_leaves_nothing_behind(plant):
    run = pneumo.simulate(plant, 1e-3, command=np.full(300, 0.3))
    assert pneumo.sampling_floor(run, 1e-3) == (0.0, 0.0)


ENDS = {"jump": (0.01, 20), "opening": (0.01, 10), "draw": (0.005, 1), "speed": (0, 2), "P_rate": (0, 1e7)}
ENDS |= {"V": (1e-6, 1e-3), "area": (1e-4, 1e-2)}
known = st.builds(theory.Averages, **{name: st.floats(*ends) for name, ends in ENDS.items()})
samplings = st.sampled_from(sorted(theory.SHIFTS))


@given(known, samplings, st.floats(1e-5, 1e-1), st.floats(0.1, 10), st.booleans())
def test_floor_is_proportional_to_the_time_between_samples(plant, known, sampling, period, factor, between):
    delays = theory.sensitivities(plant, known)
    one, other = (theory.floor(delays, s, sampling, between=between) for s in (period, factor * period))
    assert other == pytest.approx(factor * one, rel=1e-12)


@given(known, st.floats(1.1, 10))
def test_jumps_count_in_proportion_and_the_valve_less(plant, known, factor):
    delays = theory.sensitivities(plant, known)
    higher = theory.sensitivities(plant, known._replace(jump=factor * known.jump))
    assert higher.jump == pytest.approx(factor * delays.jump, rel=1e-12)
    assert higher.apart == pytest.approx(factor * delays.apart, rel=1e-12)
    valve = plant.valve._replace(k_xu=factor * plant.valve.k_xu)
    larger = theory.sensitivities(plant._replace(valve=valve), known)
    # A larger valve lets more wrong air in and levels it faster.
    assert sqrt(factor) * (1 - 1e-12) <= larger.jump / delays.jump <= factor * (1 + 1e-12)
    assert larger.rest == delays.rest == higher.rest


@given(known, st.floats(1e-5, 1e-1))
def test_without_jumps_lines_leave_nothing(plant, known, period):
    delays = theory.sensitivities(plant, known._replace(jump=0.0))
    assert theory.floor(delays, period, "linear") == 0.0
    assert theory.floor(delays, period, "linear", between=True) == 0.0
    assert theory.floor(delays, period, "hold") == pytest.approx(period / 2 * delays.rest)


@given(known, st.floats(1e-3, 1e3))
def test_wall_heat_takes_gamma_to_one(plant, known, k_0):
    plants = [plant._replace(k_0=k) for k in (0.0, k_0, 1e12)]
    adiabatic, some, isothermal = (theory.sensitivities(p, known).jump for p in plants)
    assert isothermal <= some * (1 + 1e-9) and some <= adiabatic
    assert adiabatic == pytest.approx(1.4 * isothermal, rel=1e-6)


def test_formula_by_hand(plant):
    # Cylinder D at mid-stroke, 0.8 V up and down at 20 draws a second, on paper to four digits.
    jump, V = 2**0.5 * 0.8, 1.728e-5
    flow = 0.0404 * 0.8077 * 7e5 * 1e-7 / 293**0.5  # 1.334e-4 kg/(s V), choked, and 1.28 flow/P_0 its slope
    assert flow == pytest.approx(1.334e-4, rel=1e-3)
    adiabatic = 1.4 * 287 * 293 / V * flow * jump  # 1.029e6 Pa/s
    wall, level = 0.4 * 0.5 * 293 / (565390 * V), 1.28 * 287 * 293 / V * flow * 0.8 / 565390  # 6.00, 1.18 1/s
    kept_wall, kept_level = (1 - 0.5 * r + r**2 / 6 for r in (0.05 * wall, 0.05 * level))
    J = adiabatic * sqrt((1 + 0.96 * kept_wall) / 1.96 * kept_level / 2)
    known = theory.Averages(jump, 0.8, 0.05, 0.05, 6e5, V, plant.cylinder.A_A)
    delays = theory.sensitivities(plant, known)
    assert delays.jump == pytest.approx(J, rel=3e-3)  # three digits of slope and series
    assert theory.floor(delays, 1e-3, "linear") == pytest.approx(346, rel=3e-3)  # Pa
    assert delays.rest == pytest.approx(1.4 * 565390 * plant.cylinder.A_A * 0.05 / V, rel=1e-12)


def test_floor_of_ones_own_run_and_what_it_refuses(fine):
    e, recording = fine
    run = Run(recording, simulated=True)
    both = np.mean(np.square(pneumo.sampling_floor(run, 1e-3, "delay"))) ** 0.5
    assert both == pytest.approx(rms(theory.predicted_error(recording, 1e-3, "delay")))
    assert pneumo.sampling_floor(run, e.h / 2)[0] == pytest.approx(pneumo.sampling_floor(run, e.h)[0] / 2)
    measured = pneumo.recorded(e.plant, e.h, u=run.u, x=run.x, v=run.v)
    for source, period, sampling, words in (
        (run, 1e-3, "cubic", r"^sampling = 'cubic': must be one of linear, hold, delay, hold_next$"),
        (run, -1.0, "linear", r"^period = -1: must be a positive number$"),
        (run, 7.7e-5, "linear", r"^period = 7.7e-05 s: must be a multiple or a whole fraction of"),
        (measured, 1e-3, "linear", r"^run: must come from simulate"),
    ):
        with pytest.raises(InputError, match=words):
            pneumo.sampling_floor(source, period, sampling)
