"""Models fitted to a measurement, the full order first; their notes, warnings, errors on another record."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.priors import Accuracy, accuracy
from pneumo.configuration.sampling import HELD, Sampling
from pneumo.errors import InputError
from pneumo.fitting.estimate import (
    alike_notes,
    at_temperature,
    best_start,
    error_line,
    estimate,
    prediction,
    ranked,
    split_of,
)
from pneumo.fitting.fit_problem import Problem, inapplicable, priors, with_causes
from pneumo.fitting.fit_result import Estimate, FitResult, equally_good, fit_data
from pneumo.fitting.fit_warnings import disagreements, doubtful, fit_warnings, odd_values, undetermined_notes
from pneumo.fitting.held_out import held_out_warnings
from pneumo.fitting.least_squares import covariances, expected_shifts, remainder_shifts
from pneumo.fitting.lights import lights, within_commands
from pneumo.fitting.on_signals import offsets, opened
from pneumo.fitting.position_checks import dead_volume_notes, position_shown, stop_warnings, stops_of
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.residuals import residuals, sensor_noise
from pneumo.fitting.settings import DISTRUST, PART
from pneumo.fitting.stage_signals import StageSignals, stage_signals
from pneumo.fitting.supply_sag import sag_notes
from pneumo.fitting.valve_signal import largest_command
from pneumo.fitting.wall_laws import wall_law_notes
from pneumo.physics.models import FULL, MODELS
from pneumo.physics.valve_dynamics import ValveDynamics
from pneumo.quantities.table import CHOICES, CURVE, PARAMETERS, REPORTED, STARTS

CURVE_NOTE = (
    "the curve of the valve ends at the record's largest command, {:.3g} V; the valve's coefficient and C are"
    " those at that command, scaled to u_max in proportion"
)


def fit_measurement(
    measurement: Measurement,
    plant: Plant,
    models: Sequence[str],
    *,
    command: Sampling = HELD,
    part: float = PART,
    also: tuple[str, ...] = (),
    known: Accuracy | None = None,
    progress: Callable[[str], None] = lambda _text: None,
) -> FitResult:
    """Fit models to a measurement, the full order first where it can be fitted, as `pneumo.fit` describes.

    `also` has names of `CHOICES`, which are fitted with the full order; the reduced models then get the
    corrected plant and pressures. `known` is the accuracy of what is configured.
    """
    m, plant = measurement, at_temperature(plant, measurement.T)
    has_full = m.m is None
    if not (has_full or models):
        raise InputError("models: none given: the full order is not fitted to mass flows")
    _check_also(also, measurement, plant)
    also = tuple(name for choice in also for name in CHOICES[choice])
    record = stage_signals(m, plant, command)
    split = split_of(record, part)
    record = record._replace(largest=largest_command(m.u[: split + 1], plant))
    known = known or accuracy(position_shown=position_shown(m, plant))
    judged = Problem(FULL, plant, record.part(0, split), {}, also)
    behind = (plant, record)
    off = np.zeros((2, 1))
    reference = None
    estimates: dict[str, Estimate] = {}
    if has_full:
        judged, full = _full_order(judged, record, known)
        estimates[FULL.name], off = full, offsets(record, full.values)
        # Replayed pressures are better known than measured ones, unless the replay is far off.
        reference = (full.pressure if full.low else m.P) - off
        behind = with_causes(plant, full.values), opened(record, full.values)
        progress(error_line(FULL.name, full))
    reported = _reported(judged)
    for name in models:
        problem = Problem(MODELS[name], behind[0], behind[1].part(0, split), {})
        fitted = estimate(problem, behind[1], intervals=reported, known=known, reference=reference)
        estimates[name] = fitted._replace(pressure=fitted.pressure + off)
        progress(error_line(name, fitted))
    estimates = ranked(estimates)
    if not has_full:
        judged = replace(judged, model=MODELS[next(iter(estimates))])
    best = estimates[judged.model.name]
    of_rig = stop_warnings(m, plant, known, best)
    of_rig += fit_warnings(judged, best, known, stops_shown=bool(np.isfinite(stops_of(m, plant)).all()))
    if has_full:
        of_rig += held_out_warnings(judged, record, best, known)
    reduced = [name for name in equally_good(estimates) if name != FULL.name]
    odd = [
        f"{name}: {text}"
        for name, of in estimates.items()
        if name != judged.model.name and "n" in of.values
        for text in odd_values({"n": of.values["n"]}, (), plant, meaning="it compensates for something else")
    ]
    logarithmic = [name for name in judged.names if PARAMETERS[name].logarithmic]
    judgements = lights(judged, best, known, of_rig) if has_full else {}
    if not plant.valve.paths.knots:  # its curve is stated
        judgements = within_commands(judgements, record.largest, plant.valve.u_max)
    starts = [name for name in STARTS if any(name in fitted.values for fitted in estimates.values())]
    return FitResult(
        data=fit_data(measurement, estimates, (*reported, *starts)),
        notes=(
            *measurement.notes,
            *long_notes(record, split, part),
            *([CURVE_NOTE.format(record.largest)] if {*CURVE} <= {*also} else []),
            *undetermined_notes(best, logarithmic),
            *odd,
            *((*wall_law_notes(best), *sag_notes(best)) if has_full else ()),
            *dead_volume_notes(m, plant, known),
            *alike_notes(reduced),
        ),
        warnings=(*of_rig, *disagreements(estimates)),
        held_out_from=float(measurement.t[split]),
        judgements=judgements,
        u_max=plant.valve.u_max,
        wall=judged.model.wall,
    )


def _reported(problem: Problem) -> tuple[str, ...]:
    """Names of the parameters that get an interval, also those of the reduced models."""
    return tuple(dict.fromkeys((*REPORTED, *problem.also, *problem.priors)))


def _full_order(plain: Problem, record: StageSignals, known: Accuracy) -> tuple[Problem, Estimate]:
    """Full order fitted to the signals of a problem, with priors of what is `known`, and its estimate.

    The problem that is returned has the law of the wall that fits best. No interval is computed if the
    residuals of the first, plain fit make it `doubtful` by `DISTRUST`.
    """
    plant, signals = plain.plant, plain.signals
    plain = replace(
        plain, priors=priors(plant, signals, known, sensor_noise(signals.P, signals.P), plain.also)
    )
    rough = best_start(plain)
    noise = sensor_noise(signals.P, rough.residual * plant.conditions.P_s)
    problem = replace(plain, priors=priors(plant, signals, known, noise, plain.also))
    remainder = plain.named(remainder_shifts(rough))
    expected = plain.named(expected_shifts(covariances(rough)[0]))
    far = doubtful(residuals(plain, rough.theta), remainder, expected, DISTRUST)
    intervals = () if far else _reported(problem)
    full = estimate(problem, record, intervals=intervals, known=known, start=rough.theta)
    return replace(problem, model=FULL._replace(wall=full.wall)), full


def long_notes(record: StageSignals, split: int, part: float) -> list[str]:
    """Note, if the sample `split` at which the fit ends comes before the fraction `part` of the record."""
    if split >= round(part * (record.P.shape[1] - 1)):
        return []
    fitted, rest = split * record.period, (record.P.shape[1] - 1 - split) * record.period
    return [f"a long record: the first {fitted:.4g} s are fitted, the other {rest:.4g} s held out"]


def validation(
    fitted: FitResult, measurement: Measurement, plant: Plant, *, command: Sampling = HELD
) -> dict[str, np.ndarray]:
    """Root mean square errors of fitted models on another record, Pa, shape (chamber,), by model.

    Only first pressures and temperatures are fitted there. `plant` is the one with which the fit began.
    """
    m, plant = measurement, at_temperature(plant, measurement.T)
    record = stage_signals(m, plant, command)
    record = record._replace(largest=largest_command(fitted.fitted_commands, plant))
    values = {name: {p: i.value for p, i in fitted.estimates(name).items()} for name in fitted.models}
    corrected, behind = plant, record
    if FULL.name in values:
        corrected, behind = with_causes(plant, values[FULL.name]), opened(record, values[FULL.name])
    rows = {name: (MODELS[name], corrected, behind) for name in values if name != FULL.name}
    rows[FULL.name] = FULL._replace(wall=fitted.wall), plant, record
    return {name: prediction(*rows[name], fixed)[1] for name, fixed in values.items()}


def fitted_too(
    also: Sequence[str], measurement: Measurement, dynamics: ValveDynamics, sag: float | None
) -> tuple[str, ...]:
    """Names of `CHOICES` that a user asks for, each once, and dead band and sag where they are configured."""
    configured = {"dead_band": bool(dynamics.dead_band), "sag": bool(sag) and measurement.P_s is None}
    added = [name for name, given in configured.items() if given and measurement.m is None]
    return tuple(dict.fromkeys((*also, *added)))


def _check_also(also: Sequence[str], measurement: Measurement, plant: Plant) -> None:
    """Raise an `InputError` for a quantity that cannot be fitted."""
    for unknown in (name for name in also if name not in CHOICES):
        raise InputError(f"--also {unknown}: must be one of {', '.join(CHOICES)}")
    for name in also:
        if reason := inapplicable(name, plant, measurement, measurement.name):
            raise InputError(f"--also {name}: {reason}")
    if also and measurement.m is not None:
        raise InputError(f"--also {also[0]}: needs the command u, in place of measured flows")
