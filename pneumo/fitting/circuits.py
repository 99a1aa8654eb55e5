"""Parts of a circuit that no parameter describes, by their effect on a fit: throttle, soft start, cushion."""

import numpy as np

from pneumo.fitting.fit_problem import Problem, replayed_pressures
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.residuals import BLOCK
from pneumo.fitting.settings import OUTSIDE

BEGINNING = 0.2  # of a record, in which a soft start fills the supply
NEAR_END = 0.15  # of the stroke, from either stop, in which a cushion acts
CONFINED = 0.75  # of the sum of squares, in the samples of one of these
MOST = 1 / 3  # of the samples that these may be; else they show no shape


def circuit_text(problem: Problem, estimate: Estimate) -> str:
    """Half sentence on the part of a circuit that residuals of a full order look like, if on any."""
    prior = problem.priors.get("exhaust")
    if prior and np.log(estimate.values["exhaust"] / prior.centre) < -OUTSIDE * prior.deviation:
        ratio = estimate.values["exhaust"] / prior.centre
        return f"the exhaust passes {ratio:.2g} times what is configured, as behind a throttle"
    signals = problem.signals
    replayed = replayed_pressures(problem, problem.inner(estimate.values)[None])[0]
    x = signals.motion[:: signals.stride, 0, 0]
    return place_text(signals.residual(replayed), x, problem, signals.period)


def place_text(residual: np.ndarray, x: np.ndarray, problem: Problem, period: float) -> str:
    """Half sentence on where a residual is: `residual`, Pa, by (chamber, sample), at positions `x`, m."""
    length = max(1, round(BLOCK / period))
    blocks = len(x) // length
    means = residual[:, : blocks * length].reshape(2, blocks, length).mean(axis=2)
    squares = np.sum(means**2, axis=0)
    c = problem.plant.cylinder
    travel = (x[: blocks * length : length] - c.x_min) / c.stroke
    places = {
        f"the residual is in the first {BEGINNING * len(x) * period:.2g} s, as with a soft start": (
            np.arange(blocks) < BEGINNING * blocks
        ),
        "the residual is near the ends of the stroke, as with cushions": (
            np.minimum(travel, 1 - travel) < NEAR_END
        ),
    }
    for text, inside in places.items():
        if 0 < inside.mean() <= MOST and squares[inside].sum() >= CONFINED * squares.sum():
            return text
    return "none of the causes that pneumo knows explains it"
