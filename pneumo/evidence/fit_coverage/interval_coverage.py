"""Coverage of the intervals of `pneumo fit`, by fits to random cylinders whose parameters are known.

Data made by the fitted model show how often 95 per cent intervals contain the true value; data made by the
full-order system, which has no n, show the bias of k_0 and which models predict best.
"""

import time
from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.evidence.fit_coverage.synthetic_records import SyntheticRecord, synthetic_record
from pneumo.fit.estimate import estimate, split_of
from pneumo.fit.fit_problem import FULL
from pneumo.fit.stage_signals import FEW_PAIRS, stage_signals, with_added_noise
from pneumo.physics.models import MODELS
from pneumo.statistics.averages import rms_of
from pneumo.statistics.intervals import fraction_interval

FIRST_SEED = 10_000  # seed of the first case; the method was developed on lower ones
FITTED_MODELS = ("M7", "M8", "M9", "M10")  # have k_0 and n both
FULL_ORDER_CASES = 200  # of the first cases, fitted to a full-order truth too
JUDGED_PARAMETERS = ("n", "k_0", "k_xu", "V_d_A", "V_d_B")


def true_parameters(known: SyntheticRecord) -> dict[str, float]:
    """True value of each of `JUDGED_PARAMETERS`."""
    values = known.n, known.truth.k_0, known.truth.valve.k_xu, *known.V_d
    return dict(zip(JUDGED_PARAMETERS, values, strict=True))


def fit_same_model(seed: int) -> xr.Dataset:
    """Fit a model to a record that the same model made: one of `FITTED_MODELS`, in turn with the seed.

    Returns `truth`, `estimate` and the interval's ends by parameter, and the properties of the record.
    """
    name = FITTED_MODELS[seed % len(FITTED_MODELS)]
    known = synthetic_record(seed, name)
    begun = time.thread_time()
    record = stage_signals(known.period, known.u, known.x, known.P, known.configured)
    noisy = with_added_noise(record.part(0, split_of(record)))
    fitted = estimate(MODELS[name], known.configured, record, noisy=noisy, intervals=JUDGED_PARAMETERS)
    seconds = time.thread_time() - begun

    def row(values: dict[str, float]) -> tuple[str, list[float]]:
        return "parameter", [values.get(p, np.nan) for p in JUDGED_PARAMETERS]

    return xr.Dataset(
        {
            "truth": row(true_parameters(known)),
            "estimate": row(fitted.values),
            "low": row(fitted.low),
            "high": row(fitted.high),
            "fitted_model": name,
            "held_out": rms_of(fitted.held_out),
            "seconds": seconds,
            **record_properties(known),
        },
        coords={"parameter": list(JUDGED_PARAMETERS)},
    )


def fit_full_order_truth(seed: int) -> xr.Dataset:
    """Fit the full order and every model to a case whose pressures come from the full-order system."""
    known = synthetic_record(seed)
    record = stage_signals(known.period, known.u, known.x, known.P, known.configured)
    first = split_of(record)
    noisy, exact = with_added_noise(record.part(0, first), FEW_PAIRS), known.P_exact[:, first:]
    rows, reference = [], None
    for model in (FULL, *MODELS.values()):
        begun = time.thread_time()
        fitted = estimate(
            model, known.configured, record, noisy=noisy, intervals=("k_0",), reference=reference
        )
        seconds = time.thread_time() - begun
        reference = fitted.pressure if model is FULL else reference
        values = [fitted.values.get(name, np.nan) for name in ("k_0", "n", "k_xu")]
        ends = [limits.get("k_0", np.nan) for limits in (fitted.low, fitted.high)]
        errors = rms_of(fitted.held_out), rms_of(fitted.pressure[:, first:] - exact)
        rows.append([*values, *ends, *errors, seconds])
    names = ("k_0", "n", "k_xu", "low", "high", "held_out", "held_out_error", "seconds")
    columns = {f"full_{name}": ("model", row) for name, row in zip(names, np.array(rows).T, strict=True)}
    truth = {"full_true_k_0": known.truth.k_0, "full_true_k_xu": known.truth.valve.k_xu}
    return xr.Dataset(columns | truth, {"model": [FULL.name, *MODELS]})


def record_properties(known: SyntheticRecord) -> dict[str, float]:
    """Size, supply and sensors of a record."""
    c, sensors = known.truth.cylinder, {"period": known.period, "noise": known.noise, "bits": known.bits}
    return {"bore": c.bore, "stroke": c.stroke, "supply": known.truth.conditions.P_s, **sensors}


def coverage(cases: Iterable[int], progress: Callable[[str], None]) -> xr.Dataset:
    """Fit cases, by their numbers from 0; `progress` gets a line for each.

    The result is by case; only the first `FULL_ORDER_CASES` are fitted to full-order data too.
    """
    parts: dict[int, xr.Dataset] = {}
    for number in cases:
        seed = FIRST_SEED + number
        parts[number] = fit_same_model(seed).assign_coords(model=[FULL.name, *MODELS])
        if number < FULL_ORDER_CASES:
            parts[number] = parts[number].merge(fit_full_order_truth(seed))
        progress(f"case {number}: done")
    return xr.concat(list(parts.values()), xr.Variable("case", list(parts)))


def _held(low: xr.DataArray, high: xr.DataArray, truth: xr.DataArray) -> dict[str, np.ndarray]:
    """Count the intervals that contain the true value: `held`, `closed_held`, and all `closed` ones."""
    holds = (low.fillna(-np.inf) <= truth) & (truth <= high.fillna(np.inf))
    closed = low.notnull() & high.notnull()
    counts = {"held": holds, "closed_held": holds & closed, "closed": closed}
    return {name: count.sum("case").values for name, count in counts.items()}


def intervals_that_hold(cases: xr.Dataset) -> pd.DataFrame:
    """Count the 95 per cent intervals of `coverage` that contain the true value; an open end sets no limit.

    By parameter: `cases`; `held`, the intervals that contain the true value; `low` and `high`, the ends of
    Clopper and Pearson's interval of held / cases; `closed`, the intervals with two ends; `closed_held`, the
    closed ones that contain the true value.
    """
    count, counts = cases.sizes["case"], _held(cases["low"], cases["high"], cases["truth"])
    ends = [fraction_interval(int(number), count) for number in counts["held"]]
    table = {"cases": count, "low": [e.low for e in ends], "high": [e.high for e in ends], **counts}
    return pd.DataFrame(table, index=cases["parameter"].values)


def full_order_truth(cases: xr.Dataset) -> pd.DataFrame:
    """Summarise the fits to full-order data.

    By model: median, 10th and 90th percentile of k_0 over its true value (NaN for models without); numbers of
    its intervals `held`, `closed_held` and `closed` as in `intervals_that_hold`; median of the error on the
    part held out, kPa, and of the processor's time per fit, s.
    """
    cases = cases.dropna("case", subset=["full_true_k_0"])
    ratio = (cases["full_k_0"] / cases["full_true_k_0"]).transpose("case", "model").values
    low, middle, high = np.percentile(ratio, [10, 50, 90], axis=0)
    held_out, seconds = (cases[name].median("case").values for name in ("full_held_out", "full_seconds"))
    table = {"k_0_median": middle, "k_0_10": low, "k_0_90": high, "cases": cases.sizes["case"]}
    table |= _held(cases["full_low"], cases["full_high"], cases["full_true_k_0"])
    table |= {"held_out_kPa": 1e-3 * held_out, "seconds": seconds}
    return pd.DataFrame(table, index=cases["model"].values)
