"""Sentences on a fit: its answer, and the next experiment."""

from pneumo.fitting.fit_result import FitResult, rms_of_chambers
from pneumo.publish.text.formatting import KILO
from pneumo.publish.text.terminal_tables import lights_text, rig_rows
from pneumo.quantities.table import FULL_ORDER, PARAMETERS, QUANTITIES

MOST_ADVICE = 2  # lines on what to do next
EXPERIMENTS = {  # that determine a group of parameters
    "wall": "fill a chamber fast, shut it off and wait, then fit that (pneumo fit --closed-from)",
    "flow": "record full strokes with the valve fully open",
    "dead volume": "record strokes up to both stops, and rests there",
    "valve": "record small steps of the command on both sides of zero, at 1 kHz or more",
    "configured": "record full strokes with the valve fully open, and the supply pressure with them",
}


def answer_text(fit: FitResult) -> str:
    """Best model on the part held out, best reduced one, and how many parameters have each light."""
    first, best = fit.models[0], fit.best_model
    swing = rms_of_chambers(fit.data["P"].std("t").values)
    error = fit.error(first)
    name = "The full order" if first == FULL_ORDER else first[0].upper() + first[1:]
    text = f"{name} predicts the part held out best: {error / KILO:.3g} kPa RMS with the sensors' noise"
    text += f", {100 * error / swing:.2g} % of the pressures' swing"
    if best != first:
        other = "law" if fit.closed else "reduced model"
        text += f". Best {other}: {best}, {fit.error(best) / KILO:.3g} kPa"
    if fit.judgements:
        text += f". Parameters of the rig: {lights_text(rig_rows(fit))}"
    return f"{text}."


def next_experiments(fit: FitResult) -> list[str]:
    """At most `MOST_ADVICE` lines of advice: those that would determine most parameters with wide intervals.

    A parameter that is not green only because of a warning has no line: the warning says what to do. Nor has
    one of which the record adds little to the stated accuracy: it is known that well.
    """
    advised: dict[str, list[str]] = {}
    for name, (_, reason) in fit.judgements.items():
        experiment = EXPERIMENTS.get(PARAMETERS[name].group)
        if experiment and reason.endswith("interval"):
            advised.setdefault(experiment, []).append(QUANTITIES[name].heading)
    most = sorted(advised.items(), key=lambda pair: -len(pair[1]))[:MOST_ADVICE]
    return [f"{', '.join(headings)}: {experiment}." for experiment, headings in most]
