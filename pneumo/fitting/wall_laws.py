"""Laws of a wall's conductance that explain a record: their fits, their weights, and the mean over them.

Nobody knows the law of a cylinder's wall: its conductance may be constant, or follow the area, or area and
root of P T, as the full order has it. All follow a record closely, but the sensors' noise mostly tells which.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneumo.fitting.fit_problem import FULL, Problem, fit
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.least_squares import Solution, white_variance
from pneumo.fitting.settings import AS_GOOD, LAWS_ALIKE
from pneumo.physics.models import Wall

# As a note says them, the full order's first.
WALL_LAWS: dict[Wall, str] = {
    FULL.wall: "in proportion to its area and the root of P T",
    "k_0": "constant",
    "lambda_0 A_q": "in proportion to its area",
}


def wall_law_fits(problem: Problem, best: Solution) -> dict[Wall, Solution]:
    """Fits by law of the wall: first the full order's law, then the other laws that fit about as well.

    The minimum of another law may be far along the valley of b, C and k_0, so each is searched from the
    minimum of the full order's law and from the configured values.
    """
    fits: dict[Wall, Solution] = {}
    for wall in WALL_LAWS:
        of_law = replace(problem, model=FULL._replace(wall=wall))
        searches = [best] if wall == FULL.wall else [fit(of_law, start=start) for start in (best.theta, None)]
        fits[wall] = min(searches, key=lambda found: found.squares)
    most = AS_GOOD**2 * min(fitted.squares for fitted in fits.values())
    return {wall: fitted for wall, fitted in fits.items() if wall == FULL.wall or fitted.squares <= most}


def likelihoods(fits: Sequence[Solution]) -> np.ndarray:
    """Likelihoods of fits if the sensors' noise is white, divided by their sum.

    The noise's variance is that of the best fit's residual.
    """
    squares = np.array([fitted.squares for fitted in fits])
    noise = white_variance(fits[int(squares.argmin())])
    weights = np.exp(-(squares - squares.min()) / (2 * max(noise, np.finfo(float).tiny)))
    return weights / weights.sum()


def wall_law_notes(full: Estimate) -> list[str]:
    """Note on the wall's law where the estimate of k_0 is not that of the full order's law."""
    replayed = full.values["k_0"]
    if not full.averaged or abs(full.averaged["k_0"] / replayed - 1) <= LAWS_ALIKE:
        return []
    best = max(full.laws, key=lambda law: full.laws[law])
    return [
        f"k_0 depends on the law of the wall, and a conductance that is {WALL_LAWS[best]} fits the record"
        " best; the table has averages over three laws, weighted by likelihood. The full order as replayed"
        f" and exported has a conductance {WALL_LAWS[FULL.wall]}: `fitted.yaml` has the values fitted with"
        f" that, k_0 = {replayed:.3g} W/K, which belong together"
    ]
