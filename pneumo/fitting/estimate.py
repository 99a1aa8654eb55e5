"""A model fitted to a record: its estimates, their intervals, and its error on the part held out."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import gammaincinv

from pneumo.configuration.experiment import Plant
from pneumo.configuration.priors import Accuracy
from pneumo.fitting.configured_quantities import changes_of, configured_shifts
from pneumo.fitting.fit_problem import LIMITS, Problem, fit, replayed_pressures, settled
from pneumo.fitting.fit_result import Estimate, rms_of_chambers
from pneumo.fitting.least_squares import (
    Solution,
    bounded,
    correlation,
    covariances,
    expected_shifts,
    inverse_curvature,
    parameter_interval,
    remainder_shifts,
)
from pneumo.fitting.residuals import residuals
from pneumo.fitting.settings import LEVEL, MOST_STEPS, PART
from pneumo.fitting.stage_signals import StageSignals
from pneumo.fitting.supply_sag import sagging_supply
from pneumo.fitting.wall_laws import wall_law_fits
from pneumo.physics.models import Model, Wall
from pneumo.quantities.table import FULL_ORDER, PARAMETERS, REPORTED, SHIFTING, STARTS, start_name

ALONE_STEPS = 15  # of a search with one configured quantity free


def estimate(
    problem: Problem,
    record: StageSignals,
    *,
    intervals: Iterable[str] = REPORTED,
    reference: np.ndarray | None = None,
    known: Accuracy | None = None,
    start: np.ndarray | None = None,
) -> Estimate:
    """Estimate of a model, fitted to the signals of a problem, which begin `record`; the rest is replayed.

    Parameters
    ----------
    intervals
        Names of the parameters that get an interval.
    reference : numpy.ndarray, optional
        Best known pressures without noise, Pa, by (chamber, sample). Intervals then allow for the model's
        own error, which is its difference from these, and no parameter is `held` as configured.
    known
        Accuracy of what is configured and not fitted; intervals then allow for it.
    start
        Parameters at which the search begins, on its scale.
    """
    plant, split = problem.plant, problem.signals.P.shape[1] - 1
    best = fit(problem, start=start)
    several = problem.model.name == FULL_ORDER and intervals
    by_law: dict[Wall, Solution] = wall_law_fits(problem, best) if several else {problem.model.wall: best}
    wall = min(by_law, key=lambda law: by_law[law].squares)
    model = problem.model._replace(wall=wall)
    problem = replace(problem, model=model)
    best = by_law[wall] if by_law[wall] is best else settled(problem, by_law[wall])
    fitted = replayed_pressures(problem, best.theta[None])[0]
    changes = changes_of(problem, best, known)
    model_error = 0.0 if reference is None else float(np.nansum((reference[:, : split + 1] - fitted) ** 2))
    moved, misfit = configured_shifts(problem, best, changes, known)
    of_noise = covariances(best, model_error / plant.conditions.P_s**2)
    both = of_noise + moved.T @ moved / LIMITS**2
    at_same_x = moved[[not name.endswith("of x") for name in SHIFTING]]
    of_next = max(of_noise, key=np.trace) + at_same_x.T @ at_same_x / LIMITS**2
    sag, if_sagging = sagging_supply(problem, best, moved)
    laws = np.array([found.theta - best.theta for found in by_law.values()])
    values = problem.values(best.theta)
    low, high, scales = dict[str, float](), dict[str, float](), problem.scales
    for i, name in ((i, name) for i, name in enumerate(problem.names) if name in intervals):
        ends = _own_interval(problem, best, i, both, float(np.linalg.norm(moved[:, i])))
        ends = min(ends[0], if_sagging[0, i]), max(ends[1], if_sagging[1, i])
        ends = ends[0] + laws[:, i].min(), ends[1] + laws[:, i].max()
        if PARAMETERS[name].group == "dead volume" and np.isfinite(ends[1]):  # it is never negative
            ends = max(ends[0], problem.bounds()[0, i]), ends[1]
        low[name], high[name] = (scales[name].si(end) if np.isfinite(end) else np.nan for end in ends)
    held: Mapping[str, float] = {}
    if reference is None:
        held, values = as_configured(problem, best, low, high, both)
        fitted = replayed_pressures(problem, problem.inner(values)[None])[0]
        low |= {name: min(end, values[name]) for name, end in low.items() if np.isfinite(end)}
        high |= {name: max(end, values[name]) for name, end in high.items() if np.isfinite(end)}
    predicted, held_out = prediction(model, plant, record.part(split, record.P.shape[1] - 1), values)

    return Estimate(
        values=values,
        low=low,
        high=high,
        rms=problem.signals.rms(fitted),
        held_out=held_out,
        pressure=np.concatenate([fitted[:, :-1], predicted], axis=1),
        moved={
            name: np.array([scales[name].si(end) for end in ends]) - scales[name].si(at)
            for name, at, ends in zip(problem.names, best.theta, (best.theta + moved).T, strict=True)
        },
        remainder=problem.named(remainder_shifts(best)),
        expected=problem.named(expected_shifts(both[0])),
        correlation=dict(zip(problem.names, map(problem.named, correlation(both)), strict=True)),
        covariance=dict(
            zip(problem.names, map(problem.named, bounded(of_next, problem.bounds())), strict=True)
        ),
        of_configuration=plant.conditions.P_s * misfit,
        at_bound=problem.at_bound(problem.inner(values)),
        held=tuple(held),
        sag=sag,
        wall=wall,
        k_0_by_law={law: problem.values(found.theta).get("k_0", 0.0) for law, found in by_law.items()},
    )


def _own_interval(
    problem: Problem, best: Solution, index: int, both: np.ndarray, shift: float
) -> tuple[float, float]:
    """Ends of a parameter's interval, on the scale of the search; `shift` is by what is configured.

    A zero of x that is off moves a dead volume by as much, so the profile of the noise may be narrower.
    """
    ends = parameter_interval(problem, best, index, both)
    if PARAMETERS[problem.names[index]].group != "dead volume":
        return ends
    least, most = best.theta[index] + np.log(np.maximum([1 - shift, 1 + shift], np.finfo(float).tiny))
    return min(ends[0], least), max(ends[1], most)


def as_configured(
    problem: Problem, best: Solution, low: Mapping[str, float], high: Mapping[str, float], both: np.ndarray
) -> tuple[dict[str, float], dict[str, float]]:
    """Parameters that stay as configured, and all parameters with the others fitted again, SI units.

    Those stay whose interval is open and contains the configured value, and those of the valve's dynamics,
    leaks and the like that may be zero, as zero: `fitted.yaml` leaves these out. Where that adds more to the
    sum of squares than their joint 95 % region allows, the last of them are fitted. `both` is from
    `covariances`.
    """
    configured = problem.values(problem.guess()) | {"k_0": problem.plant.k_0}
    held = dict[str, float]()
    allowed = 0.0
    inverse = inverse_curvature(best)
    for i, name in enumerate(problem.names):
        ends = np.array([low.get(name, np.nan), high.get(name, np.nan)])
        may_be_zero = PARAMETERS[name].start == 0 and (PARAMETERS[name].key or PARAMETERS[name].low == 0)
        value = 0.0 if may_be_zero else configured[name]
        left_open = may_be_zero or (PARAMETERS[name].key and np.isnan(ends).any())
        if name in low and left_open and not ends[0] > value and not ends[1] < value:
            held[name] = value
            allowed = max(allowed, both[:, i, i].max() / inverse[i, i])
    while held:
        rest = replace(problem, fixed={**problem.fixed, **held})
        found = fit(rest, start=rest.inner(problem.values(best.theta)))
        if found.squares - best.squares <= 2 * gammaincinv(len(held) / 2, LEVEL) * allowed:
            return held, rest.values(found.theta)
        held.popitem()
    return {}, problem.values(best.theta)


def prediction(
    model: Model, plant: Plant, signals: StageSignals, values: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures of another record, Pa, from a fitted model, and their root mean square errors by chamber.

    No model predicts first pressures and temperatures: these alone are fitted.
    """
    fixed = {name: value for name, value in values.items() if name not in STARTS}
    other = Problem(model, plant, signals, fixed)
    P = replayed_pressures(other, first_pressures(other)[None])[0]
    return P, signals.rms(P)


def first_pressures(problem: Problem) -> np.ndarray:
    """Fitted first pressures and temperatures of a problem without other parameters, on the search's scale.

    Each record is fitted alone, a long one over its first `MOST_STEPS` steps of the replay.
    """
    signals, found = problem.signals, dict[str, float]()
    for i, (first, last) in enumerate(signals.pieces):
        last = min(last, first + MOST_STEPS // signals.stride)
        alone = replace(problem, signals=signals.part(first, last))
        values = alone.values(fit(alone).theta)
        found |= {start_name(name, i): values[name] for name in alone.names}
    return problem.inner(found)


def best_start(problem: Problem) -> Solution:
    """Plain least-squares fit of the full order: the best of searches from several starts.

    If the fit from the configured values leaves large residuals, the search is repeated for each configured
    quantity, from values found with this quantity free: with a supply wrong by 1 bar, the search from the
    configured values ends in another minimum.
    """
    first = fit(problem)
    if not any(residual.far_from_noise for residual in residuals(problem, first.theta)):
        return settled(problem, first)
    tried = [first]
    for name in (name for name in problem.priors if PARAMETERS[name].key):  # not offsets of sensors
        alone = replace(problem, priors={}, also=(*problem.also, name))
        trial = alone.values(fit(alone, tolerance=1e-3, most=ALONE_STEPS).theta)
        guess = problem.values(problem.guess())
        tried.append(fit(problem, start=problem.inner(guess | trial)))
    return settled(problem, min(tried, key=lambda found: found.squares))


def split_of(record: StageSignals, part: float = PART) -> int:
    """Index of the last sample that is fitted: of long records, no more than `MOST_STEPS` of the replay."""
    return min(round(part * (record.P.shape[1] - 1)), MOST_STEPS // record.stride)


def at_temperature(plant: Plant, T: float) -> Plant:
    """Plant in surroundings at a measured temperature, K; unchanged where that is NaN."""
    if not np.isfinite(T):
        return plant
    return plant._replace(conditions=plant.conditions._replace(T_amb=T, T_in=T, T_0=T))


def ranked(estimates: dict[str, Estimate]) -> dict[str, Estimate]:
    """Estimates by model, in order of their errors on the part held out."""
    return dict(sorted(estimates.items(), key=lambda item: rms_of_chambers(item[1].held_out)))


def error_line(name: str, estimate: Estimate) -> str:
    """Line for the terminal when a model has been fitted."""
    return f"{name}: rms {rms_of_chambers(estimate.held_out) / 1e3:.3g} kPa on the part held out"


def alike_notes(alike: Sequence[str]) -> list[str]:
    """Note on models that a record does not distinguish, if there are several."""
    text = f"this record does not distinguish {'; '.join(alike)}: their errors on the part held out are alike"
    return [text] if len(alike) > 1 else []
