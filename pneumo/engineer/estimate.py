"""Models fitted to a measurement: estimates, intervals, and the error of each on the part held out."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Plant
from pneumo.engineer.fit_intervals import covariances, parameter_interval
from pneumo.engineer.fit_parameters import PARAMETERS, Problem, replayed_pressures
from pneumo.engineer.least_squares import descend, fit
from pneumo.engineer.record import Measurement
from pneumo.engineer.stage_signals import FEW_PAIRS, StageSignals, stage_signals, with_added_noise
from pneumo.hashing import code_hash
from pneumo.physics.models import MODELS, Model
from pneumo.storage.files import attributes, write

PART = 0.6  # of the record that is fitted
FLOW = {"long_name": "measured mass flow into the chamber", "units": "kg s-1"}
REPORTED = tuple(name for name in PARAMETERS if not name.startswith("start"))


class Estimate(NamedTuple):
    """One model, fitted; a pair is of chambers A and B."""

    values: dict[str, float]  # SI units, corrected for the bias by noise in the position; fixed ones too
    low: dict[str, float]  # ends of their 95 per cent intervals; NaN where open
    high: dict[str, float]
    rms: np.ndarray  # Pa, root mean square of measured minus replayed pressure of the part fitted: a pair
    held_out: np.ndarray  # the same of the part held out
    pressure: np.ndarray  # Pa, replayed by (chamber, sample): each part from its own start


def estimate(
    model: Model,
    plant: Plant,
    record: StageSignals,
    *,
    noisy_inputs: Sequence[np.ndarray],
    intervals: Iterable[str] = REPORTED,
    part: float = PART,
) -> Estimate:
    """Fit a model to the first part of a record and replay the rest.

    Parameters
    ----------
    noisy_inputs : sequence of numpy.ndarray
        From `with_added_noise`, of the part fitted.
    intervals : iterable of str
        Parameters that get an interval.
    part : float
        Fraction of the record that is fitted.
    """
    split = split_of(record, part)
    problem = Problem(model, plant, record.part(0, split), {}, noisy_inputs)
    few = problem._replace(noisy_inputs=noisy_inputs[: 2 * FEW_PAIRS])
    rough = fit(few)
    # From so near, two steps are enough.
    best = descend(problem, rough.theta, most=2) if len(noisy_inputs) > 2 * FEW_PAIRS else rough
    both, theta = covariances(best), best.theta
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    for i, name in enumerate(problem.names):
        if name in intervals:
            low[name], high[name] = (
                PARAMETERS[name].outer(end) if np.isfinite(end) else np.nan
                for end in parameter_interval(few, rough, best, i, both)
            )
    fitted = replayed_pressures(problem, theta[None], problem.signals.inputs)[0]
    predicted, held_out_rms = predict_rest(
        problem._replace(signals=record.part(split, record.P.shape[1] - 1), noisy_inputs=()), theta
    )
    rms = np.sqrt(np.mean((problem.signals.P - fitted) ** 2, axis=1))
    pressure = np.concatenate([fitted[:, :-1], predicted], axis=1)
    return Estimate(problem.values(theta), low, high, rms, held_out_rms, pressure)


def split_of(record: StageSignals, part: float = PART) -> int:
    """Last sample of the part that is fitted."""
    return round(part * (record.P.shape[1] - 1))


def predict_rest(rest: Problem, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pressure of a fitted model on the part held out, Pa, and root mean square error by chamber, Pa.

    Only the pressure at its start is fitted there, for every model: no model predicts it.
    """
    known = {k: v for k, v in rest.values(theta).items() if not k.startswith("start")}
    start = rest._replace(fixed=rest.fixed | known)
    pressure = replayed_pressures(start, fit(start).theta[None], rest.signals.inputs)[0]
    return pressure, np.sqrt(np.mean((rest.signals.P - pressure) ** 2, axis=1))


def prepared(measurement: Measurement, plant: Plant, *, held: bool = True) -> tuple[Plant, StageSignals]:
    """Plant at the measured temperature, if there is one, and the signals that replays read."""
    if np.isfinite(measurement.T):
        c = plant.conditions._replace(T_amb=measurement.T, T_in=measurement.T, T_0=measurement.T)
        plant = plant._replace(conditions=c)
    m = measurement
    return plant, stage_signals(m.period, m.u, m.x, m.P, plant.valve.u_max, held=held, m=m.m)


def fit_measurement(
    measurement: Measurement,
    plant: Plant,
    models: Sequence[str],
    *,
    held: bool = True,
    part: float = PART,
    progress: Callable[[str], None] = lambda _text: None,
) -> xr.Dataset:
    """Fit models to a measurement and rank them by their error on the part held out.

    Parameters
    ----------
    held : bool
        Whether a command holds until the next sample.
    part : float
        Fraction of the record that is fitted.
    progress : callable
        Called with a line of text after each model.

    Returns
    -------
    xarray.Dataset
        From `dataset`, the best model first.
    """
    plant, record = prepared(measurement, plant, held=held)
    split = split_of(record, part)
    noisy_inputs = with_added_noise(record.part(0, split))
    fits: dict[str, Estimate] = {}
    for name in models:
        fits[name] = estimate(MODELS[name], plant, record, noisy_inputs=noisy_inputs, part=part)
        rms = np.sqrt(np.mean(fits[name].held_out ** 2))
        progress(f"{name}: rms {rms / 1e3:.3g} kPa on the part held out")
    ranked = sorted(fits, key=lambda name: float(np.mean(fits[name].held_out ** 2)))
    return dataset(measurement, {name: fits[name] for name in ranked}, split)


def dataset(measurement: Measurement, fits: dict[str, Estimate], split: int) -> xr.Dataset:
    """Dataset of several fits, in their order.

    Estimates and intervals by (model, parameter), errors by (model, chamber), measured and replayed pressures
    by (chamber, t) and (model, chamber, t).
    """

    def values(field: str) -> np.ndarray:
        return np.array([[getattr(e, field).get(p, np.nan) for p in REPORTED] for e in fits.values()])

    def arrays(field: str) -> np.ndarray:
        return np.array([getattr(e, field) for e in fits.values()])

    parameters, errors, t = ("model", "parameter"), ("model", "chamber"), ("chamber", "t")
    interval = "end of the 95 per cent interval, in parameter_unit; NaN where open"
    error, Pa = "root mean square error on the part", {"units": "Pa"}
    m = measurement.m
    result = xr.Dataset(
        {
            "estimate": (parameters, values("values"), {"long_name": "estimate, in parameter_unit"}),
            "low": (parameters, values("low"), {"long_name": f"lower {interval}"}),
            "high": (parameters, values("high"), {"long_name": f"upper {interval}"}),
            "rms_fitted": (errors, arrays("rms"), {"long_name": f"{error} fitted"} | Pa),
            "rms_held_out": (errors, arrays("held_out"), {"long_name": f"{error} held out"} | Pa),
            "pressure": (("model", *t), arrays("pressure")),
            "P": (t, measurement.P, {"long_name": "measured absolute pressure"}),
            **({"u": ("t", measurement.u)} if m is None else {"m": (t, m, FLOW)}),
            "x": ("t", measurement.x),
        },
        coords={
            "model": list(fits),
            "parameter": list(REPORTED),
            "parameter_unit": ("parameter", [PARAMETERS[name].unit for name in REPORTED]),
            "chamber": ["A", "B"],
            "t": measurement.t,
        },
    )
    return result.assign_attrs(held_out_from=float(measurement.t[split]), notes="\n".join(measurement.notes))


def save_fit(fits: xr.Dataset, config_sha256: str, path: Path) -> None:
    """Write the dataset of `fit_measurement`."""
    title = "Reduced models fitted to a measurement"
    summary = "Parameters with 95 per cent intervals, errors fitted and held out, pressures"
    write(fits, path, fits.attrs | attributes(title, summary, config_sha256, code_hash(__name__)))
