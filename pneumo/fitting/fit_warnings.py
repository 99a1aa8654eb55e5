"""Warnings of a fit: reasons not to believe it, with the cause or at least the symptom.

The full-order fit is judged where there is one, else the best reduced model. If the full order follows a
record down to the sensors' noise, its parameters are those of the rig; those of a reduced model also make up
for what that model lacks. Limits were chosen on benches that `make fit-bench` does not judge.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import DEAD_FRACTION
from pneumo.configuration.priors import Accuracy
from pneumo.fitting import settings
from pneumo.fitting.fit_problem import LIMITS, Problem, fit, inapplicable, replayed_pressures
from pneumo.fitting.fit_result import Estimate, FitWarning, equally_good
from pneumo.fitting.position_checks import stated, stated_volume_warnings
from pneumo.fitting.residuals import BLOCK, Residual, residuals
from pneumo.physics.models import FULL
from pneumo.quantities.table import CAUSES, CHOICES, PARAMETERS, QUANTITIES, STARTS, VALVE_CURVE, of_group

CLOSED_TEST = "take k_0 from a closed-chamber test (pneumo fit --closed)"
UNTRUSTED = "do not trust these parameters"
STEPS = 20  # of a search for a cause
BEYOND = 0.02  # of n outside 1..gamma that noise explains
# Parts of a circuit that no parameter describes are known by where they leave residuals.
BEGINNING = 0.2  # of a record, in which a soft start fills the supply
NEAR_END = 0.15  # of the stroke, from either stop, in which a cushion acts
CONFINED = 0.75  # of the sum of squares, in the samples of one of these
MOST = 1 / 3  # of the samples that these may be; else they show no shape


def fit_warnings(
    problem: Problem, estimate: Estimate, known: Accuracy, stops_shown: bool = False
) -> list[str]:
    """Warnings of unexplained residuals and their likely cause; of odd parameters if no cause is found.

    `known` is the accuracy of what is configured; `stops_shown` says whether the record shows both stops.
    """
    name, split = problem.model.name, residuals(problem, problem.inner(estimate.values))
    of_chambers = dict(zip("AB", split, strict=True))
    of_parameters = parameter_warnings(problem, estimate, known, stops_shown)
    if name != FULL.name:
        return residual_warnings(name, of_chambers) + of_parameters
    least = settings.ALLOWED * estimate.of_configuration
    odd = doubtful(split, estimate.remainder, estimate.expected, least=least)
    symptoms = [odd_residual_warning(name, of_chambers, estimate)] if odd else []
    unexplained = any(part.coloured > max(settings.COLOURED * part.noise, least) for part in split)
    cause = cause_warnings(problem, split, estimate) if odd or unexplained else []
    # With a wrong rig all parameters are odd: its cause says more.
    if not cause:
        # Where residuals remain, b, exhaust, P_s and T_in make up for what is wrong elsewhere.
        cause = [] if unexplained else configured_warnings(problem, estimate)
    if not cause:
        symptoms = [FitWarning(f"{s}; {circuit_text(problem, estimate)}", *s.parameters) for s in symptoms]
    return [*symptoms, *(cause or of_parameters)]


def moved_out(problem: Problem, estimate: Estimate, values: Mapping[str, float]) -> tuple[str, ...]:
    """Parameters that `values`, on the scale of the search, put outside their intervals."""
    result: list[str] = []
    for name in (name for name in estimate.low if name in values and name not in STARTS):
        low, high = (problem.scales[name].inner(ends[name]) for ends in (estimate.low, estimate.high))
        if values[name] < low or values[name] > high:
            result.append(name)
    return tuple(result)


def explanation(name: str, value: float, configured: float = 0.0) -> str:
    """What a cause or configured quantity would be, as fitted and as configured, SI units."""
    factor = QUANTITIES[name].factor
    return PARAMETERS[name].explanation.format(factor * value, factor * configured)


def configured_warnings(problem: Problem, estimate: Estimate) -> list[str]:
    """Warnings of configured quantities that the record places outside their stated accuracy."""
    result: list[str] = []
    for name, prior in problem.priors.items():
        fitted, inner = estimate.values[name], problem.scales[name].inner
        low, high = (inner(ends.get(name, fitted)) for ends in (estimate.low, estimate.high))
        own = (high - low) / 2 / LIMITS  # NaN where an end is open: then nothing is contradicted
        off = inner(prior.centre) - inner(fitted)
        if abs(off) > settings.OUTSIDE * np.hypot(prior.deviation, own) and name not in problem.also:
            text = explanation(name, fitted, prior.centre)
            text += f" is outside its stated accuracy (--also {name} fits it freely)"
            # Those that would be different if the configured value were right.
            half, related = estimate.expected.get(name, np.inf), estimate.correlation.get(name, {})
            depend = [other for other, r in related.items() if abs(r * off) > half and other not in STARTS]
            result.append(FitWarning(text, *dict.fromkeys((name, *depend))))
    return result


def doubtful(
    split: Sequence[Residual],
    remainder: Mapping[str, float],
    expected: Mapping[str, float],
    factor: float = 1.0,
    least: float = 0.0,
) -> bool:
    """Whether residuals that are not noise may move a parameter too far.

    Shifts, in `remainder`, are too far beyond `factor` times `TOLERATED` and half of the interval from noise
    and configuration alone, in `expected`; all are on the scale of the search. Residuals below `least`, Pa,
    do not count: a configuration within its accuracy can leave them.
    """
    seen = any(residual.coloured > max(settings.SEEN * residual.noise, least) for residual in split)
    return seen and any(
        remainder.get(name, 0.0) > max(factor * most, expected.get(name, 0.0))
        for name, most in settings.TOLERATED.items()
    )


def odd_residual_warning(name: str, of_chambers: Mapping[str, Residual], estimate: Estimate) -> FitWarning:
    """Warning of residuals that are not noise; it concerns the parameters that they may move too far."""
    split, remainder = list(of_chambers.values()), estimate.remainder
    if doubtful(split, remainder, estimate.expected, settings.DISTRUST):
        return FitWarning(residual_warning(name, of_chambers))
    moved = [p for p, half in remainder.items() if half > estimate.expected[p] and p not in STARTS]
    shifts = {p: f"{100 * np.expm1(remainder[p]):.0f} %" for p in settings.TOLERATED if p in remainder}
    effects = ", ".join(f"{QUANTITIES[p].heading} by {shift}" for p, shift in shifts.items())
    return FitWarning(residual_warning(name, of_chambers, f"this moves {effects}, or more"), *moved)


def residual_warning(name: str, residual_of: Mapping[str, Residual], effect: str = UNTRUSTED) -> str:
    """Warning of residuals of a model, by chamber, that are not noise: their size and effect."""
    rms, coloured, noise = (
        " and ".join(f"{size / 1e3:.2g}" for size in sizes)
        for sizes in zip(*residual_of.values(), strict=True)
    )
    chambers = " and ".join(f"P_{chamber}" for chamber in residual_of)
    return (
        f"{chambers}: {name} is off by {rms} kPa rms, of which {coloured} kPa are not noise (sensor: {noise}"
        f" kPa): rig, record or configuration is not as assumed; {effect}"
    )


def residual_warnings(name: str, residual_of: Mapping[str, Residual]) -> list[str]:
    """Warning of residuals of a model, by chamber, that the sensors' noise does not explain."""
    odd = {side: part for side, part in residual_of.items() if part.coloured > settings.COLOURED * part.noise}
    return [residual_warning(name, odd)] if odd else []


def cause_warnings(problem: Problem, split: Sequence[Residual], estimate: Estimate) -> list[str]:
    """Warning that names the cause which, fitted too, explains most of a full-order fit's residuals.

    It concerns the parameters that are outside their intervals with the cause.

    Empty if no cause does. Causes that explain about as much are named together: the record does not
    distinguish them. A curve of the valve can imitate others, so it must explain much more than these; its
    search begins at the fitted values.
    """
    before = _coloured(split)
    explained: dict[str, tuple[float, str, tuple[str, ...]]] = {}
    for cause in (*CAUSES, VALVE_CURVE):
        names = CHOICES[cause]
        if {*names} & {*problem.also} or inapplicable(cause, problem.plant, problem.signals):
            continue
        trial = replace(problem, also=(*problem.also, *names))
        start = None
        enough = settings.EXPLAINED * before
        if cause == VALVE_CURVE:
            start = trial.inner(trial.values(trial.guess()) | estimate.values)
            enough = settings.EXPLAINED * min([before, *(after for after, *_ in explained.values())])
        fitted = fit(trial, tolerance=1e-3, most=STEPS, start=start)
        after = _coloured(residuals(trial, fitted.theta))
        if after < enough:
            value, configured = trial.values(fitted.theta)[names[0]], trial.values(trial.guess())[names[0]]
            text = f"{explanation(names[0], value, configured)} (--also {cause} fits it)"
            explained[cause] = after, text, moved_out(problem, estimate, trial.named(fitted.theta))
    if not explained:
        return []
    noise = float(np.sqrt(np.mean([residual.noise**2 for residual in split])))
    least = min(after for after, *_ in explained.values())
    most = max(settings.TIED * least, settings.SEEN * noise)
    alike = [one for one in sorted(explained.values()) if one[0] <= most]
    change = f"would reduce what is not noise from {before / 1e3:.2g} to {least / 1e3:.2g} kPa rms"
    tied = ": this record cannot tell which" if len(alike) > 1 else ""
    concerned = dict.fromkeys(name for *_, moved in alike for name in moved)
    return [FitWarning(f"{' or '.join(text for _, text, _ in alike)} {change}{tied}", *concerned)]


def circuit_text(problem: Problem, estimate: Estimate) -> str:
    """Half sentence on the part of a circuit that residuals of a full order look like, if on any."""
    prior = problem.priors.get("exhaust")
    if prior and np.log(estimate.values["exhaust"] / prior.centre) < -settings.OUTSIDE * prior.deviation:
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
    first = np.arange(blocks) < BEGINNING * blocks
    near_ends = np.minimum(travel, 1 - travel) < NEAR_END
    places = {
        f"the residual is in the first {BEGINNING * len(x) * period:.2g} s, as with a soft start": first,
        "the residual is near the ends of the stroke, as with cushions": near_ends,
    }
    for text, inside in places.items():
        if 0 < inside.mean() <= MOST and squares[inside].sum() >= CONFINED * squares.sum():
            return text
    return "none of the causes that pneumo knows explains it"


def _coloured(split: Sequence[Residual]) -> float:
    """Root mean square of both chambers' residuals that are not noise, Pa."""
    return float(np.sqrt(np.mean([residual.coloured**2 for residual in split])))


def parameter_warnings(problem: Problem, estimate: Estimate, known: Accuracy, stops_shown: bool) -> list[str]:
    """Warnings of parameters on a bound, or unlikely for this cylinder."""
    values = estimate.values
    plant = problem.plant
    period = problem.signals.period
    measured_volumes = problem.model.name == FULL.name and stated(plant)
    result = stated_volume_warnings(plant, estimate, known, stops_shown) if measured_volumes else []
    fitted = {name: values[name] for name in problem.names}
    at_bound = problem.at_bound(problem.inner(values))
    result += odd_values(fitted, at_bound, plant, volumes=not measured_volumes, meaning="no gas does this")
    if estimate.high.get("dead_time", np.nan) < -settings.EARLY * period and values["dead_time"] <= -period:
        text = (
            "the valve acts before its command was logged: check the time stamps; if the command was not"
            " held between samples: --command linear"
        )
        result.append(FitWarning(text, "dead_time"))
    return result


def odd_values(
    values: Mapping[str, float], at_bound: Iterable[str], plant: Plant, *, meaning: str, volumes: bool = True
) -> list[str]:
    """Warnings of fitted values on a bound, and of dead volumes and an n that no such cylinder has.

    `meaning` says what an odd n shows; dead volumes are judged if `volumes`.
    """
    result: list[str] = []
    for name, value in values.items():
        quantity = QUANTITIES[name]
        if name in at_bound:
            text = f"{quantity.name} is on the bound of the search: {value:.3g} {quantity.unit}"
            # A start on its bound says nothing of one parameter.
            result.append(FitWarning(text, *([] if name in STARTS else [name])))
        if volumes and name in of_group("dead volume"):
            result += dead_volume_warnings(name, value, plant)
        if name == "n" and not 1 - BEYOND < value < plant.gas.gamma + BEYOND:
            result.append(f"n = {value:.3g} is outside 1 to {plant.gas.gamma:g}: {meaning}")
    return result


def undetermined_notes(
    estimate: Estimate, names: Iterable[str], remedy: str = "excite the cylinder more, or record longer"
) -> list[str]:
    """Notes on the parameters in `names` that have an interval, but a wide or open one, with a remedy."""
    return [
        f"this record does not determine {QUANTITIES[name].name}: {CLOSED_TEST if name == 'k_0' else remedy}"
        for name in names
        if name in estimate.low and name not in estimate.at_bound
        if not estimate.high[name] < settings.VAGUE * estimate.low[name]
    ]


def dead_volume_warnings(name: str, volume: float, plant: Plant) -> list[str]:
    """Warning of a dead volume, m3, far from the configured one, or else from the default."""
    ratio = volume / getattr(plant.cylinder, name)
    named = QUANTITIES[name].name.removeprefix("the ")
    if 1 / settings.UNLIKELY < ratio < settings.UNLIKELY:
        return []
    remedy = "check the stroke and the zero of x; is there a hose to the valve?"
    configured = "the configured one"
    if not stated(plant):
        configured = f"the default of {100 * DEAD_FRACTION:g} % of half the stroke, since none is configured"
        remedy = f"give {PARAMETERS[name].key.rpartition('.')[2]} (with hoses), or {remedy.partition(';')[0]}"
    return [FitWarning(f"the fitted {named} is {ratio:.2g} times {configured}: {remedy}", name)]


def apart(ends: Iterable[tuple[float, float]]) -> bool:
    """Whether intervals, one or more, have no value in common; a NaN end is open."""
    low, high = np.array(list(ends)).T
    return bool(np.nan_to_num(low, nan=-np.inf).max() > np.nan_to_num(high, nan=np.inf).min())


def disagreements(
    estimates: Mapping[str, Estimate], parameters: Sequence[str] = ("k_0", "k_xu")
) -> list[str]:
    """Warnings of `equally_good` models whose intervals of a parameter do not overlap."""
    result: list[str] = []
    for parameter in parameters:
        having = {n: estimates[n] for n in equally_good(estimates) if parameter in estimates[n].low}
        if having and apart((e.low[parameter], e.high[parameter]) for e in having.values()):
            remedy = f": {CLOSED_TEST}" if parameter == "k_0" else ""
            result.append(
                f"{'; '.join(having)}: equally good, but their intervals of {QUANTITIES[parameter].name}"
                f" do not overlap{remedy}"
            )
    return result
