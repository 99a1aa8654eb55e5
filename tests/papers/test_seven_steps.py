"""The seven steps of 2007 on records whose conductance is known."""

import numpy as np
import pytest

from paper.study.paper_2007 import simulated_example as example
from paper.study.paper_2007.seven_steps import seven_steps

VOLUME = example.V_D + example.AREA * example.STROKE / 2


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
