"""Lights of fitted parameters: how well the record determines each, and which are known as stated only."""

from collections.abc import Mapping, Sequence

import numpy as np

from pneumo.configuration.priors import Accuracy
from pneumo.fitting.fit_problem import Problem
from pneumo.fitting.fit_result import AS_STATED, COMMANDS_END, Estimate, Light
from pneumo.fitting.settings import OF_STATED, REACHED, ROUGH, ROUGH_PART, VAGUE, VAGUE_PART
from pneumo.quantities.table import PARAMETERS, STARTS
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
        stated = 2 * known[name] if prior else np.inf
        if name not in STARTS:
            ends = Interval(estimate.values[name], low, high)
            result[name] = light_and_reason(name, ends, doubts, searched, stated)
    return result


def light_and_reason(
    name: str, ends: Interval, doubts: Sequence[str] = (), searched: float = np.inf, stated: float = np.inf
) -> tuple[Light, str]:
    """Light of a parameter by the width of its interval and by `doubts`, and the reason if it is not green.

    `searched` is the width of the search, `stated` that of the interval which the configuration states, both
    on the scale of the search. An interval with an open end is "red", but a search that begins at zero needs
    no lower end. A parameter that is fitted within a stated accuracy is known that well in any case: it is
    "as stated" where the record adds little, or where the interval would be red else.
    """
    row, low, high = PARAMETERS[name], ends.low, ends.high
    low = 0.0 if row.low == 0 and np.isnan(low) else low
    width = float(np.log(high / low)) if row.logarithmic and low > 0 else high - low
    limits = VAGUE_PART * searched, ROUGH_PART * searched
    vague, rough = np.log([VAGUE, ROUGH]) if row.logarithmic else limits
    if not np.isfinite(width) or (not np.isfinite(stated) and width > vague):
        return "red", "open or too wide an interval"
    light: Light = "green"
    reason = ""
    if width > min(OF_STATED * stated, vague):
        light, reason = AS_STATED, ADDS_LITTLE
    elif width > rough and not np.isfinite(stated):
        light, reason = "yellow", "wide interval"
    if doubts:
        light = "yellow"
        reason += ("; " if reason else "") + f"see the warning{'s' if len(doubts) > 1 else ''}"
    return light, reason


def within_commands(
    judgements: Mapping[str, tuple[Light, str]], reached: float, u_max: float
) -> dict[str, tuple[Light, str]]:
    """Lights where commands end at `reached`, V: the valve's coefficient is not determined beyond."""
    result = dict(judgements)
    if "k_xu" in result and result["k_xu"][0] == "green" and reached < REACHED * u_max:
        result["k_xu"] = "yellow", f"{COMMANDS_END} {reached:.3g} of {u_max:g} V"
    return result
