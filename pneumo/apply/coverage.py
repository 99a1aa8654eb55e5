"""How far `pneumo fit` can be trusted: random cylinders with known truth, measured and fitted.

Truth from the same reduced model tells whether 95 per cent intervals hold the truth; full-order truth, which
has no n, tells the bias of k_0 and which models predict best.
"""

import time
from collections.abc import Callable, Iterable

import numpy as np
import xarray as xr

from pneumo.apply.disturbance import FEW, disturbed
from pneumo.apply.estimate import estimate, split_of
from pneumo.apply.signals import signals
from pneumo.apply.synthetic import Case, case
from pneumo.physics.models import MODELS

CASES = 200
FITTED = ("M7", "M8", "M9", "M10")  # have k_0 and n both
JUDGED = ("n", "k_0", "k_xu")


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
    begun = time.perf_counter()
    record = signals(known.period, known.u, known.x, known.P, known.truth.valve.u_max)
    others = disturbed(record.part(0, split_of(record)))
    found = estimate(MODELS[name], known.configured, record, others=others, intervals=JUDGED)
    seconds = time.perf_counter() - begun
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
            **labels(known),
        },
        coords={"parameter": list(JUDGED)},
    )


def full_order(seed: int) -> xr.Dataset:
    """Fit every model to a case whose pressures come from the full-order system."""
    known = case(seed)
    record = signals(known.period, known.u, known.x, known.P, known.truth.valve.u_max)
    others = disturbed(record.part(0, split_of(record)), FEW)
    first = split_of(record)
    exact = known.P_exact[:, first:]
    rows = []
    for model in MODELS.values():
        begun = time.perf_counter()
        found = estimate(model, known.configured, record, others=others, intervals=())
        clean = found.pressure[:, first:] - exact
        rows.append(
            [
                found.values.get("k_0", np.nan),
                found.values.get("n", np.nan),
                found.values["k_xu"],
                float(np.sqrt(np.mean(found.held_out**2))),
                float(np.sqrt(np.mean(clean**2))),
                time.perf_counter() - begun,
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


def labels(known: Case) -> dict[str, float]:
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


def coverage(cases: int, each: Callable[..., Iterable[xr.Dataset]], say: Callable[[str], None]) -> xr.Dataset:
    """Fit all cases.

    Parameters
    ----------
    cases : int
        Seeds 0 to cases - 1.
    each : callable
        `map`, or that of a pool.
    say : callable
        Told which case is done.

    Returns
    -------
    xarray.Dataset
        By case.
    """

    def one(seed: int) -> xr.Dataset:
        part = same_model(seed).merge(full_order(seed))
        say(f"case {seed}: done")
        return part

    parts: list[xr.Dataset] = list(each(one, range(cases)))
    return xr.concat(parts, xr.Variable("case", np.arange(cases)))
