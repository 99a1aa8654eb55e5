"""What a circuit has and no parameter describes is named by where the residuals of a fit are."""

import numpy as np
import pytest

from pneumo.configuration.parameters import load, study
from pneumo.fitting.fit_problem import Prior, Problem
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.fit_warnings import circuit_text, place_text
from pneumo.fitting.stage_signals import StageSignals
from pneumo.physics.models import FULL
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

PLANT = configured_plant(study(load(TEMPLATE)))
COUNT, PERIOD = 4000, 1e-3
X = PLANT.cylinder.stroke * (np.abs(2 * (np.arange(COUNT) / 1000 % 1) - 1) - 0.5)  # from stop to stop
NEAR = np.abs(X) > 0.45 * PLANT.cylinder.stroke
T = PERIOD * np.arange(COUNT)
UNKNOWN = "none of the causes that pneumo knows explains it"
SIGNALS = StageSignals(
    PERIOD, PERIOD, np.zeros((1, 3)), np.zeros((1, 3, 2)), np.zeros((2, 2)), np.ones((2, 2))
)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (np.exp(-T / 0.2), "in the first 0.8 s, as with a soft start"),
        (NEAR * 1.0, "near the ends of the stroke, as with cushions"),
        (np.ones(COUNT), UNKNOWN),
        (1.0 * ~NEAR, UNKNOWN),
    ],
)
def test_residuals_of_a_soft_start_and_of_cushions_are_known_by_their_place(size, said):
    problem = Problem(FULL, PLANT, SIGNALS, {})
    noise = np.random.default_rng(1).normal(0.0, 1e3, (2, COUNT))
    residual = 8e3 * size * np.sin(T * 40) + noise
    assert said in place_text(residual, X, problem, PERIOD)


def test_an_exhaust_that_passes_far_less_is_called_a_throttle():
    problem = Problem(FULL, PLANT, SIGNALS, {}, priors={"exhaust": Prior(1.0, 0.025, 1.0)})
    estimate = Estimate({"exhaust": 0.3}, {}, {}, np.zeros(2), np.zeros(2), np.zeros((2, 0)))
    assert "0.3 times what is configured, as behind a throttle" in circuit_text(problem, estimate)
