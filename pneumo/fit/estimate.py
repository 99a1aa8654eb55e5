"""Models fitted to a measurement: estimates, intervals, and the error of each on the part held out."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fit.fit_warnings import (
    disagreements,
    equally_good,
    far_from_noise,
    record_doubts,
)
from pneumo.fit.fitted_parameters import (
    CAUSES,
    FULL,
    PARAMETERS,
    Problem,
    offsets,
    replayed_pressures,
    with_causes,
)
from pneumo.fit.least_squares import descend, fit
from pneumo.fit.parameter_intervals import covariances, parameter_interval
from pneumo.fit.record.measurement import Measurement
from pneumo.fit.stage_signals import FEW_PAIRS, StageSignals, stage_signals, with_added_noise
from pneumo.fit.valve_signal import behind_valve
from pneumo.hashing import code_hash
from pneumo.physics.models import MODELS, Model
from pneumo.storage.files import attributes, write

PART = 0.6  # of the record that is fitted
FLOW = {"long_name": "measured mass flow into the chamber", "units": "kg s-1"}
REPORTED = tuple(name for name in PARAMETERS if not name.startswith("start") and name not in CAUSES)
UNITS = {name: PARAMETERS[name].unit for name in REPORTED}


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
    noisy: np.ndarray | None,
    intervals: Iterable[str] = REPORTED,
    part: float = PART,
    reference: np.ndarray | None = None,
    also: tuple[str, ...] = (),
) -> Estimate:
    """Fit a model to the first `part` of a record and replay the rest.

    `noisy` has the motions from `with_added_noise`, of the part fitted; `intervals` names the parameters that
    get one. `reference`, Pa, by (chamber, sample), has the pressures without noise, as far as they are known:
    intervals then allow for the model's own error, which is what it is off from them. `also` names `CAUSES`
    that are fitted too.
    """
    split = split_of(record, part)
    problem = Problem(model, plant, record.part(0, split), {}, noisy, also)
    few = problem if noisy is None else problem._replace(noisy=noisy[: 2 * FEW_PAIRS])
    rough = fit(few)
    # From so near, two steps are enough.
    more = noisy is not None and len(noisy) > 2 * FEW_PAIRS
    best = descend(problem, rough.theta, most=2) if more else rough
    fitted = replayed_pressures(problem, best.theta[None])[0, 0]
    own = 0.0 if reference is None else float(np.nansum((reference[:, : split + 1] - fitted) ** 2))
    both, values = covariances(best, own / plant.conditions.P_s**2), problem.values(best.theta)
    low: dict[str, float] = {}
    high: dict[str, float] = {}
    for i, name in enumerate(problem.names):
        if name in intervals:
            low[name], high[name] = (
                PARAMETERS[name].outer(end) if np.isfinite(end) else np.nan
                for end in parameter_interval(few, rough, best, i, both)
            )
    # Only the pressure at its start is fitted to the part held out, for every model: no model predicts it.
    known = {name: value for name, value in values.items() if not name.startswith("start")}
    rest = Problem(model, plant, record.part(split, record.P.shape[1] - 1), known)
    predicted = replayed_pressures(rest, fit(rest).theta[None])[0, 0]
    rms, held_out = (
        np.sqrt(np.mean((of.signals.P - P) ** 2, axis=1)) for of, P in ((problem, fitted), (rest, predicted))
    )
    pressure = np.concatenate([fitted[:, :-1], predicted], axis=1)
    return Estimate(values, low, high, rms, held_out, pressure)


def split_of(record: StageSignals, part: float = PART) -> int:
    """Last sample of the part that is fitted."""
    return round(part * (record.P.shape[1] - 1))


def at_temperature(plant: Plant, T: float) -> Plant:
    """Plant in surroundings at a measured temperature, K; unchanged where that is NaN."""
    if not np.isfinite(T):
        return plant
    return plant._replace(conditions=plant.conditions._replace(T_amb=T, T_in=T, T_0=T))


def fit_measurement(
    measurement: Measurement,
    plant: Plant,
    models: Sequence[str],
    *,
    held: bool = True,
    part: float = PART,
    also: tuple[str, ...] = (),
    progress: Callable[[str], None] = lambda _text: None,
) -> xr.Dataset:
    """Fit models to a measurement: `dataset`, the model of the lowest error on the part held out first.

    `held` is whether a command holds until the next sample, `part` the fraction of the record that is fitted;
    `progress` gets a line after each model. `also` names `CAUSES` that are fitted too, with the full order;
    the reduced models then get plant and pressures as it found them. `InputError` where that is not fitted.
    """
    m, plant = measurement, at_temperature(plant, measurement.T)
    full = m.m is None and not (plant.valve.leak or plant.valve.laminar)
    for unknown in (name for name in also if name not in CAUSES):
        raise InputError(f"--also {unknown}: must be one of {', '.join(CAUSES)}")
    if "P_s" in also and m.P_s is not None:
        raise InputError(f"--also P_s: {m.name} has the supply pressure as a column")
    if also and not full:
        raise InputError(
            f"--also {also[0]}: only the full order can tell, which needs the command u of a valve that does"
            " not leak"
        )
    record = stage_signals(m.period, m.u, m.x, m.P, plant, held=held, P_s=m.P_s, m=m.m)
    split = split_of(record, part)
    first = record.part(0, split)
    noisy = with_added_noise(first)
    few = noisy[: 2 * FEW_PAIRS]
    fits: dict[str, Estimate] = {}
    reported, off = (*REPORTED, *also), np.zeros((2, 1))
    options: dict[str, Any] = {"intervals": reported, "part": part}

    def add(model: Model, plant: Plant, signals: StageSignals, motions: np.ndarray) -> None:
        found = estimate(model, plant, signals, noisy=motions, **options)
        fits[model.name] = found._replace(pressure=found.pressure + off)
        rms = np.sqrt(np.mean(fits[model.name].held_out ** 2))
        progress(f"{model.name}: rms {rms / 1e3:.3g} kPa on the part held out")

    corrected, opened = plant, record
    if full:
        plain = Problem(FULL, plant, first, {}, free=also)
        far = far_from_noise(plain, fit(plain).theta)
        options |= {"intervals": ()} if far else {}
        options["also"] = also
        add(FULL, plant, record, few)
        values = fits[FULL.name].values
        # The reduced models get the valve's opening, and what was fitted too, as the full order found it.
        corrected, off = with_causes(plant, values), offsets(values)
        opened = record._replace(u=behind_valve(record.u, record.h, values), P=record.P - off)
        reference = (m.P if far else fits[FULL.name].pressure) - off
        options |= {"intervals": reported, "also": (), "reference": reference}
    for name in models:
        add(MODELS[name], corrected, opened, noisy)
    ranked = sorted(fits, key=lambda name: float(np.mean(fits[name].held_out ** 2)))
    judged = FULL if FULL.name in fits else MODELS[ranked[0]]
    problem = Problem(judged, plant, first, {}, few, also)
    warnings = record_doubts(problem, fits[judged.name]) + disagreements(fits)
    result = dataset(
        measurement,
        {name: fits[name] for name in ranked},
        split,
        {name: PARAMETERS[name].unit for name in reported},
    )
    alike = [name for name in equally_good(fits) if name != FULL.name]
    if len(alike) > 1:
        note = f"this record cannot tell {', '.join(alike)} apart: their errors held out are alike"
        result.attrs["notes"] = "\n".join([*measurement.notes, note])
    return result.assign_attrs(warnings="\n".join(warnings))


def dataset(
    measurement: Measurement, fits: dict[str, Estimate], split: int, units: Mapping[str, str] = UNITS
) -> xr.Dataset:
    """Dataset of several fits, in their order, with the parameters that have a unit in `units`.

    Estimates and intervals by (model, parameter), errors by (model, chamber), measured and replayed pressures
    by (chamber, t) and (model, chamber, t).
    """

    def values(field: str) -> np.ndarray:
        return np.array([[getattr(e, field).get(p, np.nan) for p in units] for e in fits.values()])

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
            "parameter": list(units),
            "parameter_unit": ("parameter", list(units.values())),
            "chamber": ["A", "B"],
            "t": measurement.t,
        },
    )
    return result.assign_attrs(
        held_out_from=float(measurement.t[split]), notes="\n".join(measurement.notes), warnings=""
    )


def save_fit(fits: xr.Dataset, config_sha256: str, path: Path) -> None:
    """Write the dataset of `fit_measurement`, or of `pneumo.fit.closed.closed_fit.fit_closed`."""
    closed = "closed_chambers" in fits.attrs
    title = "Thermal laws fitted to closed chambers" if closed else "Reduced models fitted to a measurement"
    summary = "Parameters with 95 per cent intervals, errors fitted and held out, pressures"
    code = code_hash(__name__, *(["pneumo.fit.closed.closed_fit"] if closed else []))
    write(fits, path, fits.attrs | attributes(title, summary, config_sha256, code))
