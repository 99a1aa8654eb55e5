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
    """One model, fitted.

    Attributes
    ----------
    values : dict of str to float
        Parameters in SI units, corrected for the bias that noise in the position causes; fixed ones too.
    low, high : dict of str to float
        Ends of their 95 per cent intervals; NaN where an end is open.
    rms, held_out : numpy.ndarray
        Root mean square of measured minus replayed pressure, Pa, of the part fitted and of the part held
        out, chambers A and B.
    pressure : numpy.ndarray
        Replayed, Pa, shape (chamber, samples): the part fitted, then that held out, each from its own start.
    """

    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    rms: np.ndarray
    held_out: np.ndarray
    pressure: np.ndarray


def estimate(
    model: Model,
    plant: Plant,
    record: StageSignals,
    *,
    noisy_inputs: Sequence[np.ndarray],
    fixed: dict[str, float] | None = None,
    intervals: Iterable[str] = REPORTED,
    part: float = PART,
) -> Estimate:
    """Fit a model to the first part of a record and replay the rest.

    Parameters
    ----------
    model : Model
    plant : Plant
        As configured.
    record : StageSignals
    noisy_inputs : sequence of numpy.ndarray
        From `with_added_noise`, of the part fitted.
    fixed : dict of str to float, optional
        Parameters that are known, in SI units.
    intervals : iterable of str
        Parameters that get an interval.
    part : float
        Fraction of the record that is fitted.
    """
    split = split_of(record, part)
    problem = Problem(model, plant, record.part(0, split), fixed or {}, noisy_inputs)
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
    measurement : Measurement
    plant : Plant
        As configured.
    models : sequence of str
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

    def by_parameter(field: str, name: str) -> tuple[tuple[str, str], np.ndarray, dict[str, str]]:
        rows = [[getattr(e, field).get(p, np.nan) for p in REPORTED] for e in fits.values()]
        return ("model", "parameter"), np.array(rows), {"long_name": name}

    def by_chamber(field: str, part: str) -> tuple[tuple[str, str], np.ndarray, dict[str, str]]:
        attributes = {"long_name": f"root mean square error on the part {part}", "units": "Pa"}
        return ("model", "chamber"), np.array([getattr(e, field) for e in fits.values()]), attributes

    interval = "end of the 95 per cent interval, in parameter_unit; NaN where open"
    measured = {"u": ("t", measurement.u)}
    if measurement.m is not None:
        measured = {"m": (("chamber", "t"), measurement.m, FLOW)}
    result = xr.Dataset(
        {
            "estimate": by_parameter("values", "estimate, in parameter_unit"),
            "low": by_parameter("low", f"lower {interval}"),
            "high": by_parameter("high", f"upper {interval}"),
            "rms_fitted": by_chamber("rms", "fitted"),
            "rms_held_out": by_chamber("held_out", "held out"),
            "pressure": (("model", "chamber", "t"), np.array([e.pressure for e in fits.values()])),
            "P": (("chamber", "t"), measurement.P, {"long_name": "measured absolute pressure"}),
            **measured,
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
