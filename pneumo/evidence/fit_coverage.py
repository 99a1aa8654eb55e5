"""How far `pneumo fit` can be trusted: random cylinders with known truth, measured and fitted.

Truth from the same reduced model tells whether 95 per cent intervals hold the truth; full-order truth, which
has no n, tells the bias of k_0 and which models predict best.
"""

import time
from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd
import xarray as xr
from scipy.stats import binomtest

from pneumo.engineer.estimate import estimate, split_of
from pneumo.engineer.stage_signals import FEW_PAIRS, stage_signals, with_added_noise
from pneumo.evidence.synthetic_records import Case, case
from pneumo.physics.models import MODELS

FIRST = 10_000  # seed of the first case; the method was developed on lower ones
FITTED = ("M7", "M8", "M9", "M10")  # have k_0 and n both
JUDGED = ("n", "k_0", "k_xu", "V_d_A", "V_d_B")


def truth_of(case: Case) -> dict[str, float]:
    """True parameters of a case."""
    return {
        "n": case.n,
        "k_0": case.truth.k_0,
        "k_xu": case.truth.valve.k_xu,
        "V_d_A": case.V_d[0],
        "V_d_B": case.V_d[1],
    }


def same_model(seed: int) -> xr.Dataset:
    """Fit a case whose pressures come from the model that is fitted, one of `FITTED` by turns."""
    name = FITTED[seed % len(FITTED)]
    known = case(seed, name)
    begun = time.thread_time()
    record = stage_signals(known.period, known.u, known.x, known.P, known.truth.valve.u_max)
    noisy_inputs = with_added_noise(record.part(0, split_of(record)))
    found = estimate(MODELS[name], known.configured, record, noisy_inputs=noisy_inputs, intervals=JUDGED)
    seconds = time.thread_time() - begun
    truth = truth_of(known)

    def row(of: dict[str, float]) -> tuple[str, list[float]]:
        return "parameter", [of.get(p, np.nan) for p in JUDGED]

    return xr.Dataset(
        {
            "truth": row(truth),
            "estimate": row(found.values),
            "low": row(found.low),
            "high": row(found.high),
            "fitted_model": name,
            "held_out": float(np.sqrt(np.mean(found.held_out**2))),
            "seconds": seconds,
            **case_labels(known),
        },
        coords={"parameter": list(JUDGED)},
    )


def full_order(seed: int) -> xr.Dataset:
    """Fit every model to a case whose pressures come from the full-order system."""
    known = case(seed)
    record = stage_signals(known.period, known.u, known.x, known.P, known.truth.valve.u_max)
    noisy_inputs = with_added_noise(record.part(0, split_of(record)), FEW_PAIRS)
    first = split_of(record)
    exact = known.P_exact[:, first:]
    rows = []
    for model in MODELS.values():
        begun = time.thread_time()
        found = estimate(model, known.configured, record, noisy_inputs=noisy_inputs, intervals=())
        clean = found.pressure[:, first:] - exact
        rows.append(
            [
                found.values.get("k_0", np.nan),
                found.values.get("n", np.nan),
                found.values["k_xu"],
                float(np.sqrt(np.mean(found.held_out**2))),
                float(np.sqrt(np.mean(clean**2))),
                time.thread_time() - begun,
            ]
        )
    names = ("k_0", "n", "k_xu", "held_out", "held_out_error", "seconds")
    columns = np.array(rows).T
    return xr.Dataset(
        {
            **{f"full_{name}": ("model", column) for name, column in zip(names, columns, strict=True)},
            "full_true_k_0": known.truth.k_0,
            "full_true_k_xu": known.truth.valve.k_xu,
        },
        coords={"model": list(MODELS)},
    )


def case_labels(known: Case) -> dict[str, float]:
    """What sort of case it is."""
    c = known.truth.cylinder
    return {
        "bore": c.bore,
        "stroke": c.stroke,
        "supply": known.truth.conditions.P_s,
        "period": known.period,
        "noise": known.noise,
        "bits": known.bits,
    }


def coverage(cases: Iterable[int], say: Callable[[str], None]) -> xr.Dataset:
    """Fit cases.

    Parameters
    ----------
    cases : iterable of int
        Their numbers; seeds begin at `FIRST`.
    say : callable
        Told which case is done.

    Returns
    -------
    xarray.Dataset
        By case.
    """
    parts: list[xr.Dataset] = []
    numbers = list(cases)
    for number in numbers:
        parts.append(same_model(FIRST + number).merge(full_order(FIRST + number)))
        say(f"case {number}: done")
    return xr.concat(parts, xr.Variable("case", numbers))


def held(found: xr.Dataset) -> pd.DataFrame:
    """How often 95 per cent intervals held the truth; an open end sets no limit.

    Parameters
    ----------
    found : xarray.Dataset
        From `coverage`.

    Returns
    -------
    pandas.DataFrame
        By parameter: `held` of `cases`, with Clopper and Pearson's interval of the share, `low` to `high`,
        and `closed_held` of the `closed` intervals with two ends.
    """
    low, high, truth = found["low"].fillna(-np.inf), found["high"].fillna(np.inf), found["truth"]
    holds, closed = (low <= truth) & (truth <= high), found["low"].notnull() & found["high"].notnull()
    rows = []
    for name in found["parameter"].values:
        inside, shut = holds.sel(parameter=name), closed.sel(parameter=name)
        ends = binomtest(int(inside.sum()), inside.size).proportion_ci()
        rows.append(
            [int(inside.sum()), inside.size, ends.low, ends.high, int((inside & shut).sum()), int(shut.sum())]
        )
    columns = ["held", "cases", "low", "high", "closed_held", "closed"]
    return pd.DataFrame(rows, index=found["parameter"].values, columns=columns)


def full_order_truth(found: xr.Dataset) -> pd.DataFrame:
    """What fits to full-order truth give: no interval, since no reduced model is the truth.

    Returns
    -------
    pandas.DataFrame
        By model: median, 10th and 90th percentile of k_0 over the truth (NaN for models without), median of
        the error held out, kPa, and of the processor's time per fit, s.
    """
    rows = []
    for model in found["model"].values:
        own = found.sel(model=model)
        ratio = (own["full_k_0"] / own["full_true_k_0"]).values
        low, middle, high = np.percentile(ratio, [10, 50, 90])
        rows.append(
            [
                middle,
                low,
                high,
                1e-3 * float(own["full_held_out"].median()),
                float(own["full_seconds"].median()),
            ]
        )
    columns = ["k_0_median", "k_0_10", "k_0_90", "held_out_kPa", "seconds"]
    return pd.DataFrame(rows, index=found["model"].values, columns=columns)


def summary(found: xr.Dataset) -> str:
    """Both as Markdown."""
    names = {"n": "n", "k_0": "k_0", "k_xu": "valve coefficient", "V_d_A": "V_d of A", "V_d_B": "V_d of B"}
    lines = [
        "| truth: the model fitted | intervals that hold it | 95 % of that share | of those with two ends |",
        "|---|---|---|---|",
    ]
    for name, row in held(found).iterrows():
        share = f"{row['held']:.0f} of {row['cases']:.0f} | {row['low']:.3f} to {row['high']:.3f}"
        lines.append(f"| {names[str(name)]} | {share} | {row['closed_held']:.0f} of {row['closed']:.0f} |")
    lines += [
        "",
        "| truth: full order | k_0 over the truth, median (10 to 90 %) | held out, median (kPa) | time (s) |",
        "|---|---|---|---|",
    ]
    for model, row in full_order_truth(found).iterrows():
        bias = (
            ""
            if np.isnan(row["k_0_median"])
            else f"{row['k_0_median']:.2f} ({row['k_0_10']:.2f} to {row['k_0_90']:.2f})"
        )
        lines.append(f"| {model} | {bias} | {row['held_out_kPa']:.1f} | {row['seconds']:.1f} |")
    return "\n".join(lines) + "\n"
