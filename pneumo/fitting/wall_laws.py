"""Laws of a wall's conductance that explain a record.

Nobody knows the law of a cylinder's wall: its conductance may be constant, or follow the area, or area and
root of P T, as eq (8) has it. All follow a record closely, but the sensors' noise mostly tells which. A fit
has the law with the lowest sum of squares; its intervals hold the others that fit about as well too.
"""

from dataclasses import replace
from functools import partial

from pneumo.fitting.fit_problem import TOLERANCE, TRIALS, Problem
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.least_squares import Solution, solve
from pneumo.fitting.settings import AS_GOOD, LAWS_ALIKE
from pneumo.physics.models import FULL, Wall

# As a note says them, the full order's first.
WALL_LAWS: dict[Wall, str] = {
    FULL.wall: "in proportion to its area and the root of P T",
    "k_0": "constant",
    "lambda_0 A_q": "in proportion to its area",
}
FAR_OFF = 1.5  # sum of squares over the lowest, beyond which no law will fit as well


def wall_law_fits(problem: Problem, best: Solution) -> dict[Wall, Solution]:
    """Fits by law of the wall, of those laws that fit about as well as the best.

    The minimum of another law may be far along the valley of b, C and k_0, so each is searched from the
    minimum of the full order's law and from the configured values, thoroughly where it comes near the best.
    """
    fits: dict[Wall, Solution] = {FULL.wall: best}
    for wall in tuple(WALL_LAWS)[1:]:
        of_law = replace(problem, model=FULL._replace(wall=wall))
        far = FAR_OFF * min(fitted.squares for fitted in fits.values())
        search = partial(solve, of_law, tolerance=TOLERANCE, most=TRIALS, hopeless=far)
        fits[wall] = min(map(search, (best.theta, of_law.guess())), key=lambda found: found.squares)
    most = AS_GOOD**2 * min(fitted.squares for fitted in fits.values())
    return {wall: fitted for wall, fitted in fits.items() if fitted.squares <= most}


def wall_law_notes(full: Estimate) -> list[str]:
    """Note on the law of the wall where others, with another k_0, fit the record about as well."""
    replayed = full.values["k_0"]
    others = [
        f"{k_0:.3g} W/K with one {WALL_LAWS[law]}"
        for law, k_0 in full.k_0_by_law.items()
        if abs(k_0 / replayed - 1) > LAWS_ALIKE and law != full.wall
    ]
    text = (
        f"k_0 depends on the law of the wall: a conductance {WALL_LAWS[full.wall]} fits the record best, with"
        f" {replayed:.3g} W/K, and is what all values and `fitted.yaml` (wall_law) have; as good within"
        f" {100 * (AS_GOOD - 1):.0f} % would be {', and '.join(others)}"
    )
    return [text] if others else []
