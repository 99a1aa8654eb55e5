"""Models fitted to a measurement: estimates, intervals, and the error of each on the part held out."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import HELD, Sampling
from pneumo.errors import InputError
from pneumo.fit.fit_problem import FULL, Problem, offsets, replayed_pressures, si_value, with_causes
from pneumo.fit.fit_result import Estimate, FitResult, equally_good, fit_data, rms_of_chambers
from pneumo.fit.fit_warnings import disagreements, fit_warnings
from pneumo.fit.fitted_parameters import CAUSES, REPORTED, STARTS
from pneumo.fit.least_squares import descend, fit
from pneumo.fit.parameter_intervals import covariances, parameter_interval
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.residuals import residuals
from pneumo.fit.stage_signals import FEW_PAIRS, StageSignals, stage_signals, with_added_noise
from pneumo.fit.valve_signal import behind_valve
from pneumo.physics.models import MODELS, Model

PART = 0.6  # of the record that is fitted


def estimate(
    model: Model,
    plant: Plant,
    record: StageSignals,
    *,
    noisy: np.ndarray | None,
    intervals: Iterable[str] = REPORTED,
    part: float = PART,
    reference: np.ndarray | None = None,
    also: tuple[str, ...] = (),
) -> Estimate:
    """Estimate of a model, fitted to the first `part` of a record; the rest is replayed.

    Parameters
    ----------
    noisy : numpy.ndarray, optional
        Motions of the part fitted from `with_added_noise`; without them nothing is corrected for noise.
    intervals
        Names of the parameters that get an interval.
    reference : numpy.ndarray, optional
        Best known pressures without noise, Pa, by (chamber, sample). Intervals then allow for the model's
        own error, which is its difference from these.
    also
        `CAUSES` that are fitted too.
    """
    split = split_of(record, part)
    problem = Problem(model, plant, record.part(0, split), {}, noisy, also)
    few = problem if noisy is None else problem._replace(noisy=noisy[: 2 * FEW_PAIRS])
    rough = best = fit(few)
    if noisy is not None and len(noisy) > 2 * FEW_PAIRS:
        best = descend(problem, rough.theta, most=2)  # so near, two steps are enough
    fitted = replayed_pressures(problem, best.theta[None])[0, 0]
    model_error = 0.0 if reference is None else float(np.nansum((reference[:, : split + 1] - fitted) ** 2))
    both = covariances(best, model_error / plant.conditions.P_s**2)
    values = problem.values(best.theta)
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    for i, name in enumerate(problem.names):
        if name in intervals:
            ends = parameter_interval(few, rough, best, i, both)
            low[name], high[name] = (si_value(name, end) if np.isfinite(end) else np.nan for end in ends)
    # No model predicts the first pressures of the part held out: these alone are fitted.
    known = {name: value for name, value in values.items() if name not in STARTS}
    rest = Problem(model, plant, record.part(split, record.P.shape[1] - 1), known)
    predicted = replayed_pressures(rest, fit(rest).theta[None])[0, 0]
    rms, held_out = (
        np.sqrt(np.mean((signals.P - P) ** 2, axis=1))
        for signals, P in ((problem.signals, fitted), (rest.signals, predicted))
    )
    pressure = np.concatenate([fitted[:, :-1], predicted], axis=1)
    return Estimate(values, low, high, rms, held_out, pressure)


def split_of(record: StageSignals, part: float = PART) -> int:
    """Index of the last sample that is fitted."""
    return round(part * (record.P.shape[1] - 1))


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


def fit_measurement(
    measurement: Measurement,
    plant: Plant,
    models: Sequence[str],
    *,
    command: Sampling = HELD,
    part: float = PART,
    also: tuple[str, ...] = (),
    progress: Callable[[str], None] = lambda _text: None,
) -> FitResult:
    """Fit models to a measurement, the full order first where it can be fitted.

    Parameters
    ----------
    command
        Signal sampling of the command: `HELD` or `INTERPOLATED`.
    part
        Fraction of the record that is fitted.
    also
        `CAUSES` that are fitted too, with the full order; the reduced models then get the corrected plant and
        pressures.
    progress
        Is called with a line after each model.

    Raises
    ------
    InputError
        If `also` names no cause, or the supply although it was measured, or without a fit of the full order.
    """
    m, plant = measurement, at_temperature(plant, measurement.T)
    full = m.m is None and not (plant.valve.leak or plant.valve.laminar)
    _check_also(also, measurement, full)
    record = stage_signals(m.period, m.u, m.x, m.P, plant, command=command, P_s=m.P_s, m=m.m)
    split = split_of(record, part)
    first = record.part(0, split)
    noisy = with_added_noise(first)
    few = noisy[: 2 * FEW_PAIRS]
    estimates: dict[str, Estimate] = {}
    reported, off = (*REPORTED, *also), np.zeros((2, 1))
    options: dict[str, Any] = {"intervals": reported, "part": part}

    def add(model: Model, plant: Plant, signals: StageSignals, motions: np.ndarray) -> None:
        result = estimate(model, plant, signals, noisy=motions, **options)
        estimates[model.name] = result._replace(pressure=result.pressure + off)
        progress(error_line(model.name, result))

    corrected, opened = plant, record
    if full:
        plain = Problem(FULL, plant, first, {}, also=also)
        far = any(residual.far_from_noise for residual in residuals(plain, fit(plain).theta))
        options |= {"intervals": ()} if far else {}
        options["also"] = also
        add(FULL, plant, record, few)
        values = estimates[FULL.name].values
        # The reduced models get the valve's opening and the causes from the fit of the full order.
        corrected, off = with_causes(plant, values), offsets(values)
        opened = record._replace(u=behind_valve(record.u, record.h, values), P=record.P - off)
        reference = (m.P if far else estimates[FULL.name].pressure) - off
        options |= {"intervals": reported, "also": (), "reference": reference}
    for name in models:
        add(MODELS[name], corrected, opened, noisy)
    estimates = ranked(estimates)
    judged = FULL if FULL.name in estimates else MODELS[next(iter(estimates))]
    problem = Problem(judged, plant, first, {}, few, also)
    warnings = fit_warnings(problem, estimates[judged.name]) + disagreements(estimates)
    reduced = [name for name in equally_good(estimates) if name != FULL.name]
    return FitResult(
        data=fit_data(measurement, estimates, reported),
        notes=(*measurement.notes, *alike_notes(reduced)),
        warnings=tuple(warnings),
        held_out_from=float(measurement.t[split]),
    )


def alike_notes(alike: Sequence[str]) -> list[str]:
    """Note on models that a record does not distinguish, if there are several."""
    text = f"this record does not distinguish {'; '.join(alike)}: their errors on the part held out are alike"
    return [text] if len(alike) > 1 else []


def _check_also(also: Sequence[str], measurement: Measurement, full: bool) -> None:
    """Raise an `InputError` for a cause that cannot be fitted."""
    for unknown in (name for name in also if name not in CAUSES):
        raise InputError(f"--also {unknown}: must be one of {', '.join(CAUSES)}")
    if "P_s" in also and measurement.P_s is not None:
        raise InputError(f"--also P_s: {measurement.name} has the supply pressure as a column")
    if also and not full:
        raise InputError(
            f"--also {also[0]}: needs the fit of the full order: the command u and a valve without leakage"
        )
