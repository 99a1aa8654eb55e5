"""Green, yellow and red lights of fitted parameters: how well the record determines each."""

from collections.abc import Sequence

import numpy as np

from pneumo.configuration.parameters import Accuracy
from pneumo.fitting.fit_problem import Problem
from pneumo.fitting.fit_result import Estimate, Light, first_words
from pneumo.fitting.fitted_parameters import PARAMETERS, STARTS
from pneumo.fitting.settings import OF_STATED, ROUGH, ROUGH_PART, VAGUE, VAGUE_PART
from pneumo.statistics.intervals import Interval

ADDS_LITTLE = "the record adds little to the stated accuracy"


def lights(
    problem: Problem, estimate: Estimate, known: Accuracy, warnings: Sequence[str]
) -> dict[str, tuple[Light, str]]:
    """Lights of the full order's parameters, and their reasons, by the intervals and the rig's warnings."""
    concerned = [(text, getattr(text, "parameters", ())) for text in warnings]
    result: dict[str, tuple[Light, str]] = {}
    for name, searched in zip(problem.names, np.diff(problem.bounds(), axis=0)[0].tolist(), strict=True):
        low, high = estimate.low.get(name, np.nan), estimate.high.get(name, np.nan)
        doubts = [text for text, of in concerned if not of or name in of]
        prior = name in problem.priors and name not in problem.also
        stated = 2 * getattr(known, name) if prior else np.inf
        if name not in STARTS:
            ends = Interval(estimate.estimates[name], low, high)
            result[name] = light_and_reason(name, ends, doubts, searched, stated)
    return result


def light_and_reason(
    name: str, ends: Interval, doubts: Sequence[str] = (), searched: float = np.inf, stated: float = np.inf
) -> tuple[Light, str]:
    """Light of a parameter by the width of its interval and by `doubts`, and the reason if it is not green.

    `searched` is the width of the search, `stated` that of the interval which the configuration states, both
    on the scale of the search. An interval with an open end is "red", but a search that begins at zero needs
    no lower end. A parameter that is fitted within a stated accuracy is known that well in any case: it is
    "yellow" where the record adds little, or where the interval would be red else.
    """
    search, low, high = PARAMETERS[name].search, ends.low, ends.high
    low = 0.0 if search.low == 0 and np.isnan(low) else low
    width = float(np.log(high / low)) if search.logarithmic and low > 0 else high - low
    limits = VAGUE_PART * searched, ROUGH_PART * searched
    vague, rough = np.log([VAGUE, ROUGH]) if search.logarithmic else limits
    if not np.isfinite(width) or (not np.isfinite(stated) and width > vague):
        return "red", "open or too wide an interval"
    if doubts:
        return "yellow", first_words(doubts[0])
    if width > OF_STATED * stated:
        return "yellow", ADDS_LITTLE
    return ("yellow", "wide interval") if width > (vague if np.isfinite(stated) else rough) else ("green", "")
