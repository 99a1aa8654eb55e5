"""The Butcher tableau, and its order of convergence."""

import numpy as np
import pytest
from array_equations import integrated
from paper_study import STUDY

from pneumo.simulation.full_order import equilibrium, run
from pneumo.simulation.tableau import DORMAND_PRINCE


def test_dormand_prince():
    # Dormand and Prince (1980), Table 2; c is summed from a row of up to five rounded fractions of size 12.
    np.testing.assert_allclose(DORMAND_PRINCE.c, [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1], rtol=0, atol=1e-14)
    assert DORMAND_PRINCE.A.shape == (6, 6) and DORMAND_PRINCE.b.shape == (6,)
    assert not np.triu(DORMAND_PRINCE.A).any()  # explicit


def test_order_five_on_a_smooth_problem():
    # y' = -2 t y^2 from 1 has the solution 1/(1 + t^2). The largest error along the way, as the error at
    # one point may happen to pass through zero. 4.7 to 5.4 leaves the h^6 term its share at the coarsest
    # step and rounding (1e-16) its at the finest; orders 4 and 6 lie well outside.
    steps = np.array([16, 32, 64, 128])
    errors = []
    for n in steps:
        t = (np.arange(n)[:, np.newaxis] + DORMAND_PRINCE.c) * 2.0 / n
        y = integrated(lambda y, k, i, t=t: -2 * t[k, i] * y**2, np.ones(1), n, 2.0 / n)[:, 0]
        errors.append(abs(y - 1 / (1 + np.linspace(0, 2, n + 1) ** 2)).max())
    assert 4.7 < -np.polyfit(np.log(steps), np.log(errors), 1)[0] < 5.4


@pytest.mark.parametrize("name", ["E09", "E11"])
def test_order_five_on_the_full_order_system(name):
    # Smooth: 0.2 of the limiter's voltage from equilibrium, A fills below the sonic limit and below supply
    # pressure, B empties far above it, and the piston swings at its 40 to 80 rad/s, away from the stops.
    e = STUDY.experiments[name]
    conditions = e.plant.conditions
    t_end = 0.064
    steps = np.array([8, 16, 32, 64])  # 8 ms to the study's 1 ms: omega h from 0.6 down to 0.04

    def final(n):
        states = run(equilibrium(e.plant), np.full(n + 1, 2.0), 0.0, e.drive, e.plant, t_end / n).states
        assert (np.abs(states[:, 0]) < 0.9 * e.plant.cylinder.x_max).all()
        ratio_in, ratio_out = states[:, 2] / conditions.P_s, conditions.P_atm / states[:, 4]
        assert (ratio_in > 0.6).all() and (ratio_in < 0.95).all() and (ratio_out < 0.45).all()
        return states[-1]

    exact = final(1024)
    ends = np.array([final(n) for n in steps])
    scale = np.array([0.1, 1, *[conditions.P_0, conditions.T_0] * 2])
    errors = np.sqrt((((ends - exact) / scale) ** 2).mean(axis=1))
    assert 4.7 < -np.polyfit(np.log(steps), np.log(errors), 1)[0] < 5.4
