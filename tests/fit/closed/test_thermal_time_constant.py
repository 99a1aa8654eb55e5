"""The seven steps on records whose conductance is known."""

import numpy as np
import pytest

from paper.study.paper_2007 import simulated_example as example
from pneumo.errors import InputError
from pneumo.fit.closed.thermal_time_constant import exponential, mean_pressure, seven_steps, transient
from pneumo.fit.record.measurement import Measurement

T = 1e-3 * np.arange(6001)
VOLUME = example.V_D + example.AREA * example.STROKE / 2


def test_an_exact_exponential_is_found():
    P = 2e5 + 5e4 * np.exp(-T / 0.7)
    free, fixed = exponential(T, P), exponential(T, P, 2e5)
    for fit in (free, fixed):
        assert fit[:3] == pytest.approx((2e5, 5e4, 0.7), rel=1e-6)
    assert free.jacobian.shape == (len(T), 3) and fixed.jacobian.shape == (len(T), 2)
    t_ss = 0.7 * np.log(100)
    mean = P[t_ss >= T].mean()
    assert mean_pressure(*free[:2]) == pytest.approx(mean, rel=1e-4)  # a sample is 1e-3 of the settling time


def test_steps_give_back_the_mass_volume_and_conductance_of_an_exponential_record():
    m, V_d, k, bore = 5e-5, 2e-6, 0.12, 0.02
    area, T_amb, R, c_v = np.pi / 4 * bore**2, 293.0, 287.0, 717.5
    swept_i = m * R * T_amb / 1e5 - V_d
    P_f = m * R * T_amb / (V_d + swept_i / 2)
    gas = {"bore": bore, "T_amb": T_amb, "c_v": c_v, "R": R, "P_0": P_f, "T_0": T_amb}
    steps = seven_steps(1e5, swept_i, swept_i / 2, (P_f, 0.0, m * c_v / k), **gas)
    assert (steps.m, steps.V_d, steps.k_av) == pytest.approx((m, V_d, k), rel=1e-9)
    # Two end faces and the mantle of the plain cylinder that holds V_f.
    assert steps.A_q == pytest.approx(2 * area + np.pi * bore * steps.V_f / area, rel=1e-12)
    # At P_0 and T_0 throughout, the square-root law changes nothing.
    assert steps.lambda_0 == steps.lambda_av and steps.k_0 == pytest.approx(k, rel=1e-9)


def test_the_held_chamber_follows_the_exact_solution():
    t, P, T_held = example.response("of 2006", 0.037, 3.0)
    assert P / T_held == pytest.approx(P[0] / T_held[0], rel=1e-9)  # neither volume nor mass changes
    P_f = P[0] * example.T_AMB / T_held[0]
    ratio = P_f * example.T_AMB / (example.P_0 * example.T_0)
    at_rest = example.LAMBDA_0 * example.WALL_AREA * ratio**0.5
    m = P_f * VOLUME / (example.R * example.T_AMB)
    tau = m * example.R / (example.GAMMA - 1) / at_rest
    # By the square-root law P T is proportional to T^2, and T follows the logistic equation.
    np.testing.assert_allclose(P_f / (1 - (1 - P_f / P[0]) * np.exp(-t / tau)), P, rtol=1e-6)


@pytest.mark.parametrize("window", [3.0, 8.0])
def test_means_over_the_settling_time_halve_the_error_of_final_values(window):
    t, P, _ = example.response("of 2006", 0.037, window)
    fit, steps = example.estimated(t, P, "free")
    truth = example.LAMBDA_0 * example.WALL_AREA
    at_end = steps.k_av * (example.P_0 * example.T_0 / (fit.P_f * example.T_AMB)) ** 0.5
    assert 0 < steps.k_0 / truth - 1 < 0.6 * (at_end / truth - 1)


def decay(tau, span=3.0, change=5e4, noise=0.0, x=None, samples=601):
    t = np.linspace(0.0, span, samples)
    P = 2e5 + change * np.exp(-t / tau) + noise * np.random.default_rng(1).normal(size=samples)
    x = np.zeros(samples) if x is None else x
    return Measurement("m.csv", t[1], 0 * t, x, np.array([P, P]))


def test_a_transient_that_does_not_settle_is_refused(plant):
    assert transient(decay(2.9 * 3.0), plant, "A").tau == pytest.approx(2.9 * 3.0, rel=1e-4)
    with pytest.raises(InputError, match=r"m\.csv: pressure B does not settle within the record's 3 s"):
        transient(decay(3.1 * 3.0), plant, "B")


def test_a_transient_within_its_noise_is_refused(plant):
    # Noise of 15 % of the change moves tau by 7 % here; twice that is allowed.
    assert transient(decay(0.5, change=2e3, noise=300.0), plant, "A").tau == pytest.approx(0.5, rel=0.15)
    with pytest.raises(InputError, match=r"pressure A changes by .* Pa at a noise of \d+ Pa: too little"):
        transient(decay(0.5, change=300.0, noise=300.0), plant, "A")


def test_a_transient_needs_fifty_samples_after_its_begin(plant):
    record = decay(0.5)
    rest = transient(record, plant, "A", begin=1.0)
    # What is left of an exponential is one with the same time constant.
    assert rest.tau == pytest.approx(0.5, rel=1e-6) and rest.P_inf == pytest.approx(2e5, rel=1e-6)
    assert transient(record, plant, "A", begin=2.755).tau == pytest.approx(0.5, rel=1e-3)
    with pytest.raises(InputError, match=r"--closed-from 2\.76 s: leaves 49 samples: must be at least 50"):
        transient(record, plant, "A", begin=2.76)


def test_an_interval_of_a_time_constant_holds_the_truth_and_shrinks_with_the_noise(plant):
    wide, narrow = (transient(decay(0.5, noise=noise), plant, "A") for noise in (500.0, 50.0))
    for found in (wide, narrow):
        assert found.tau_low < 0.5 < found.tau_high and found.k_0_low < found.k_0 < found.k_0_high
        assert found.k_0 / found.k_0_low == pytest.approx(found.tau / found.tau_low, rel=1e-9)
    ratio = np.log(wide.tau_high / wide.tau_low) / np.log(narrow.tau_high / narrow.tau_low)
    assert ratio == pytest.approx(10.0, rel=0.05)  # the same noise, but for a curve that is not straight
    assert (wide.rms, narrow.rms) == pytest.approx((500.0, 50.0), rel=0.1)  # 601 samples know it to 3 %


@pytest.mark.parametrize(("side", "sign", "other"), [("A", 1, "B"), ("B", -1, "A")])
def test_a_conductance_is_that_of_mass_area_and_mean_pressure_of_a_chamber_off_mid_stroke(
    side, sign, other, plant
):
    """By hand: k = m c_v / tau, over the area ratio and the root of P T at their means."""
    c, gas, at = plant.cylinder, plant.gas, plant.conditions
    tau, x = 0.5, 0.2 * c.stroke
    found = transient(decay(tau, x=np.full(601, x)), plant, side)
    V = getattr(c, f"V_d_{side}") + getattr(c, f"A_{side}") * (c.stroke / 2 + sign * x)
    m = 2e5 * V / (gas.R * at.T_amb)
    k_av = m * gas.R / (gas.gamma - 1) / tau
    P = 2e5 + 5e4 * (1 - 0.01) / np.log(100)  # mean over the settling time to 1 %
    PT = P * at.T_amb * P / 2e5
    area = (c.bore / 2 + c.stroke / 2 + sign * x) / (c.bore / 2 + c.stroke / 2)
    k_0 = k_av / (area * (PT / (at.P_0 * at.T_0)) ** 0.5)
    assert (found.k_av, found.k_0) == pytest.approx((k_av, k_0), rel=1e-6)


def test_a_transient_from_a_later_begin_is_that_of_a_record_that_begins_there(plant):
    record = decay(0.5)
    first = 200
    rest = record._replace(u=record.u[first:], x=record.x[first:], P=record.P[:, first:])
    later, alone = transient(record, plant, "A", begin=record.t[first]), transient(rest, plant, "A")
    assert (later.k_0, later.tau, later.P_inf) == pytest.approx((alone.k_0, alone.tau, alone.P_inf), rel=1e-9)


def test_a_pressure_that_would_end_below_zero_does_not_settle(plant):
    record = decay(3.0, span=2.0)
    with pytest.raises(InputError, match="does not settle within the record's 2 s"):
        transient(record._replace(P=record.P - 2.1e5), plant, "A")
