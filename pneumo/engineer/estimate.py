"""Models fitted to a measurement: estimates, intervals, and how well each predicts the part held out."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Plant
from pneumo.engineer.added_noise import FEW, disturbed
from pneumo.engineer.fit_intervals import covariances, interval
from pneumo.engineer.least_squares import PARAMETERS, Problem, descended, fit, replayed, values
from pneumo.engineer.record import Measurement
from pneumo.engineer.stage_signals import Signals, signals
from pneumo.hashing import code_hash
from pneumo.physics.models import MODELS, Model
from pneumo.storage.files import write

PART = 0.6  # of the record that is fitted
FLOW = {"long_name": "measured mass flow into the chamber", "units": "kg s-1"}
SHOWN = tuple(name for name in PARAMETERS if not name.startswith("start"))


class Estimate(NamedTuple):
    """One model, fitted.

    Attributes
    ----------
    values : dict of str to float
        Parameters in SI units, corrected for what noise in the position does; fixed ones too.
    low, high : dict of str to float
        Ends of their 95 per cent intervals; NaN where an end is open or none was asked for.
    rms, held_out : numpy.ndarray
        Root of the mean square of measured minus replayed pressure, Pa, of the part fitted and of that held
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
    record: Signals,
    *,
    others: list[np.ndarray],
    fixed: dict[str, float] | None = None,
    intervals: Iterable[str] = SHOWN,
    part: float = PART,
) -> Estimate:
    """Fit a model to the first part of a record and replay the rest.

    Parameters
    ----------
    model : Model
    plant : Plant
        As configured.
    record : Signals
    others : list of numpy.ndarray
        From `disturbed`, of the part fitted.
    fixed : dict of str to float, optional
        Parameters that are known, in SI units.
    intervals : iterable of str
        Parameters to find intervals of.
    part : float
        Fraction of the record that is fitted.
    """
    split = split_of(record, part)
    problem = Problem(model, plant, record.part(0, split), fixed or {}, others)
    few = problem._replace(others=others[: 2 * FEW])
    rough = fit(few)
    # From so near, two steps are enough.
    best = descended(problem, rough.theta, most=2) if len(others) > 2 * FEW else rough
    both, theta = covariances(best), best.theta
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    for i, name in enumerate(problem.names):
        if name in intervals:
            low[name], high[name] = (
                PARAMETERS[name].outer(end) if np.isfinite(end) else np.nan
                for end in interval(few, rough, best, i, both)
            )
    fitted = replayed(problem, theta[None], problem.signals.inputs)[0]
    predicted, left = held_out(
        problem._replace(signals=record.part(split, record.P.shape[1] - 1), others=()), theta
    )
    return Estimate(
        values(problem, theta),
        low,
        high,
        np.sqrt(np.mean((problem.signals.P - fitted) ** 2, axis=1)),
        left,
        np.concatenate([fitted[:, :-1], predicted], axis=1),
    )


def split_of(record: Signals, part: float = PART) -> int:
    """Last sample of the part that is fitted."""
    return round(part * (record.P.shape[1] - 1))


def held_out(rest: Problem, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replay a fitted model on what it has not seen.

    No model says which pressure a record begins with: that alone is fitted, for every model.

    Returns
    -------
    pressure : numpy.ndarray
        Pa, shape (chamber, samples).
    rms : numpy.ndarray
        Root of the mean square of measured minus replayed pressure, Pa, chambers A and B.
    """
    known = {k: v for k, v in values(rest, theta).items() if not k.startswith("start")}
    begin = rest._replace(fixed=rest.fixed | known)
    pressure = replayed(begin, fit(begin).theta[None], rest.signals.inputs)[0]
    return pressure, np.sqrt(np.mean((rest.signals.P - pressure) ** 2, axis=1))


def prepared(measurement: Measurement, plant: Plant, *, held: bool = True) -> tuple[Plant, Signals]:
    """Plant at the temperature that was measured, where it was, and signals as replays read them."""
    if np.isfinite(measurement.T):
        c = plant.conditions._replace(T_amb=measurement.T, T_in=measurement.T, T_0=measurement.T)
        plant = plant._replace(conditions=c)
    m = measurement
    return plant, signals(m.period, m.u, m.x, m.P, plant.valve.u_max, held=held, m=m.m)


def fit_measurement(
    measurement: Measurement,
    plant: Plant,
    models: Sequence[str],
    *,
    held: bool = True,
    part: float = PART,
    say: Callable[[str], None] = lambda text: None,
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
    say : callable
        Told what was just done.

    Returns
    -------
    xarray.Dataset
        Estimates and intervals by (model, parameter), errors by (model, chamber), pressures by (chamber, t)
        and (model, chamber, t), models ranked.
    """
    plant, record = prepared(measurement, plant, held=held)
    others = disturbed(record.part(0, split_of(record, part)))
    found: dict[str, Estimate] = {}
    for name in models:
        found[name] = estimate(MODELS[name], plant, record, others=others, part=part)
        say(f"{name}: rms {np.sqrt(np.mean(found[name].held_out ** 2)) / 1e3:.3g} kPa on the part held out")
    ranked = sorted(found, key=lambda name: float(np.mean(found[name].held_out ** 2)))
    return dataset(measurement, {name: found[name] for name in ranked}, split_of(record, part))


def dataset(measurement: Measurement, found: dict[str, Estimate], split: int) -> xr.Dataset:
    """Put fits, best first, into a dataset."""

    def table(field: str) -> np.ndarray:
        return np.array([[getattr(e, field).get(name, np.nan) for name in SHOWN] for e in found.values()])

    by_parameter = {
        "estimate": ("estimate, in parameter_unit", table("values")),
        "low": ("lower end of the 95 per cent interval, in parameter_unit; NaN where open", table("low")),
        "high": ("upper end of the 95 per cent interval, in parameter_unit; NaN where open", table("high")),
    }
    by_chamber = {
        "rms_fitted": ("root mean square error on the part fitted", [e.rms for e in found.values()]),
        "rms_held_out": ("root mean square error on the part held out", [e.held_out for e in found.values()]),
    }
    pressure = np.array([e.pressure for e in found.values()])
    result = xr.Dataset(
        {
            **{k: (("model", "parameter"), v, {"long_name": n}) for k, (n, v) in by_parameter.items()},
            **{
                k: (("model", "chamber"), v, {"long_name": n, "units": "Pa"})
                for k, (n, v) in by_chamber.items()
            },
            "pressure": (("model", "chamber", "t"), pressure),
            "P": (("chamber", "t"), measurement.P, {"long_name": "measured absolute pressure"}),
            **({"u": ("t", measurement.u)} if measurement.m is None else {}),
            **({} if measurement.m is None else {"m": (("chamber", "t"), measurement.m, FLOW)}),
            "x": ("t", measurement.x),
        },
        coords={
            "model": list(found),
            "parameter": list(SHOWN),
            "parameter_unit": ("parameter", [PARAMETERS[name].unit for name in SHOWN]),
            "chamber": ["A", "B"],
            "t": measurement.t,
        },
    )
    return result.assign_attrs(held_out_from=float(measurement.t[split]), notes="\n".join(measurement.notes))


def save_fit(found: xr.Dataset, config_sha256: str, path: Path) -> None:
    """Write what `fit_measurement` found."""
    about = {
        "title": "Reduced models fitted to a measurement",
        "summary": "Parameters with 95 per cent intervals, errors fitted and held out, pressures",
        "config_sha256": config_sha256,
        "code_sha256": code_hash(__name__),
    }
    write(found, path, found.attrs | about)
