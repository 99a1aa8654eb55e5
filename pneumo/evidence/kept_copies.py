"""Kept copies of evidence: their variables and digits, and the difference of numbers computed again."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.dimensionless_groups import KNOWN_GROUPS
from pneumo.storage.files import read, read_json


class Copy(NamedTuple):
    """Digits and variables that are kept of a file of evidence."""

    digits: int | None = 4  # of floating-point numbers; None: all
    variables: tuple[str, ...] = ()  # that pages, statements and checks read; none: all


OF_COVERAGE = ("truth", "low", "high", "full_k_0", "full_true_k_0", "full_low", "full_high")
OF_CYLINDERS = ("lowest", "counts", "held_out", "ratio", "share", "cylinders")
OF_CYLINDERS += ("map_ratio", "thermal_edge", "exchange_edge", *KNOWN_GROUPS)
OF_CYLINDERS += tuple(f"third_{name}" for name in ("from", "to", "ratio", "share"))
OF_CYLINDERS += tuple(f"rule_{name}" for name in ("threshold", "model", "error", "quotient"))
PARTS = ("model_error", "transport_error", "discretisation_error", "cross_term", "total", "total_exact")
PARTS += ("regularised_discretisation", "chatter", "regularised_law", "halving", "sampled", "told_apart")
PARTS += tuple(f"reference_{name}" for name in ("model_error", "coarse", "fine"))
OF_BUDGET = tuple(f"level_{part}" for part in PARTS)
COPIES = {  # the others as `Copy` has it
    "assumptions.nc": Copy(digits=None),  # as taken they are the study, which a test compares
    "contest.nc": Copy(digits=3),
    "cylinders.nc": Copy(4, OF_CYLINDERS),
    "error_budget.nc": Copy(4, (*OF_BUDGET, "constant_n", "best_n", "told_apart", "order")),
    "open_loop.nc": Copy(digits=6),  # places of pairs: scores differ by tenths
    "variants.nc": Copy(None, ("ratio", "share", "counted")),
    "seed_sets.nc": Copy(digits=5),
    # Six digits hardly move a truth across an interval's end.
    "fit_coverage.nc": Copy(6, (*OF_COVERAGE, "full_held_out", "full_seconds")),
}
MEASURED_TIMES = {"full_seconds"}  # differ from run to run
TOLERANCE = 10.0  # times what the digits explain: another processor, another order of sums
ALL_DIGITS = 11  # that agree where all are kept: a mean error is a sum of terms that cancel (1.6e-11 seen)
NOTHING = 1e-12  # of the largest number of a variable: what a kept zero may be elsewhere, by rounding
# By file and variable, where a difference that means nothing is larger than `TOLERANCE` allows: two to three
# times what was seen on another processor.
ALLOWED = {
    # Errors of single runs: with Coulomb friction a piston sticks a step earlier or later where a valve is
    # wider by 2e-16 of itself, and errors change by up to 0.5 %; without friction by 6e-14. 13 of 4,000 runs
    # do so.
    ("cylinders.nc", "lowest"): 0.01,
    # Temperatures are not fitted, nor is the other run of the vessel. Both follow from estimates that may be
    # undetermined (`INTERVALS`): 0.7 % and 0.1 % seen.
    **{("measured_air.nc", name): 0.015 for name in ("T_error", "T_filling", "other_T")},
    ("measured_air.nc", "other_P"): 2e-3,
    # On a bound: a search ends somewhere within 1e-3 of the range. 1.8e-3 seen.
    ("measured_air.nc", "estimate"): 4e-3,
    # Of fits whose interval is without end, and on what they were not fitted to: 3.2e-4 and 2.7e-5 seen.
    ("fit_coverage.nc", "full_k_0"): 1e-3,
    ("fit_coverage.nc", "full_held_out"): 8e-5,
}
# Dimensions along which a number counts as no smaller than the RMS of all.
AS_LARGE_AS = {
    # Residuals cross zero: on another processor 20 of 21,600 were off by up to a tenth of themselves, and
    # none by more than 3e-4 of the RMS of its curve.
    ("measurements.nc", "error"): ("t",),
    # A leak of 1e-31 m2 is none, beside 1e-11 of others.
    ("measurements.nc", "value"): ("record", "law", "leakage"),
    # A conductance of 1e-13 W/K, on its bound of 0, is none.
    ("measured_air.nc", "estimate"): ("case", "model"),
}
# Names of an interval's ends, and the part of its half-width by which an estimate and its ends may differ.
INTERVALS = {
    # On a record that says little a search goes along a flat valley, to where the sum of squares changes
    # by 1e-8: 0.32 of a half-width seen on another processor.
    **{("measured_air.nc", name): ("low", "high", 0.5) for name in ("estimate", "low", "high")},
    # Ends are searched to a part of the half-width: 0.003 seen, and no truth crossed an end.
    **{("fit_coverage.nc", name): ("low", "high", 0.01) for name in ("low", "high")},
    **{("fit_coverage.nc", f"full_{end}"): ("full_low", "full_high", 0.01) for end in ("low", "high")},
}
# Part of all ends that may be missing on one side only, beyond the search: 6 of 26,000 seen.
MISSING = {("fit_coverage.nc", name): 1e-3 for name in ("low", "high", "full_low", "full_high")}


def tolerance(name: str, variable: str = "") -> float:
    """Allowed relative difference from a variable of a kept file: `TOLERANCE` times 10^-digits of the file.

    More for what `ALLOWED` lists.
    """
    by_digits = TOLERANCE * 10 ** -(COPIES.get(name, Copy()).digits or ALL_DIGITS)
    return max(by_digits, ALLOWED.get((name, variable), 0.0))


def least_sizes(file: str, dataset: xr.Dataset, name: str) -> np.ndarray:
    """Sizes that the numbers of a variable have at least, in a comparison: 0 but for those listed above."""
    variable = dataset[name]
    sizes = xr.zeros_like(variable, dtype=float)
    if (file, name) in AS_LARGE_AS:
        sizes = sizes + (variable.astype(float) ** 2).mean(AS_LARGE_AS[file, name]) ** 0.5
    if (file, name) in INTERVALS:
        low, high, part = INTERVALS[file, name]
        half_width = (dataset[high].astype(float) - dataset[low].astype(float)) / 2
        if name in (low, high):  # of an interval with one end, that end itself
            half_width = half_width.fillna(abs(variable))
        by_interval = part * half_width / tolerance(file, name)
        sizes = sizes.where(~(by_interval > sizes), by_interval)
    return sizes.transpose(*variable.dims).values


def difference(
    kept: np.ndarray, again: np.ndarray, least: np.ndarray | float = 0.0, missing: float = 0.0
) -> float:
    """Largest relative difference of two arrays: over the elements, |again - kept| / |kept|.

    Where a kept element is smaller than `least`, of the same shape, that is taken for its size. A part
    `missing` of the elements may be NaN on one side only.
    Infinite if the shapes differ, if only one of two elements is NaN, or if a kept element is zero and the
    other exceeds `NOTHING` times the largest kept one. Of text and whole numbers: 0 if equal, else infinite.
    """
    if kept.shape != again.shape:
        return np.inf
    if kept.dtype.kind != "f":
        return 0.0 if (kept == again).all() else np.inf
    kept, again = kept.astype(float), again.astype(float)
    one_sided = np.isnan(kept) != np.isnan(again)
    if one_sided.sum() > missing * one_sided.size:
        return np.inf
    known = np.isfinite(kept) & ~one_sided
    infinite = np.isinf(kept) & ~one_sided
    if (kept[infinite] != again[infinite]).any():
        return np.inf
    size = np.maximum(np.abs(kept), least)[known]
    kept, again = kept[known], again[known]
    off = np.abs(again - kept)
    off[(kept == 0) & (off <= NOTHING * np.abs(kept).max(initial=0.0))] = 0.0
    with np.errstate(divide="ignore"):
        return float(np.divide(off, size, out=np.zeros_like(off), where=off > 0).max(initial=0.0))


def _numbers(content: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a JSON text with its path."""
    if isinstance(content, dict | list):
        pairs = content.items() if isinstance(content, dict) else enumerate(content)
        for key, inner in pairs:
            yield from _numbers(inner, f"{path}.{key}" if path else str(key))
    else:
        yield path, content


def differences(kept: Path, again: Path) -> dict[str, float]:
    """`difference` between a kept file and another, by variable; in a JSON file, by path of each value."""
    if kept.suffix == ".json":
        old, new = (dict(_numbers(json.loads(read_json(file)))) for file in (kept, again))
        about = {"code_sha256", "config_sha256", "date_created"}
        names = [name for name in old | new if name not in about]
        pairs = {name: (np.asarray(old.get(name, "")), np.asarray(new.get(name, ""))) for name in names}
        return {name: _of_values(*pair) for name, pair in pairs.items()}
    copy: xr.Dataset = read(kept)
    names = list(map(str, copy.variables))
    made = read(again, *names)
    return {
        name: difference(
            copy[name].values,
            made[name].transpose(*copy[name].dims).values,
            least_sizes(kept.name, copy, name),
            MISSING.get((kept.name, name), 0.0),
        )
        for name in names
        if name not in MEASURED_TIMES
    }


def _of_values(old: np.ndarray, new: np.ndarray) -> float:
    """`difference` of two numbers of a JSON text; of other values, 0 if they are equal, else 1."""
    numeric = {old.dtype.kind, new.dtype.kind} <= {"f", "i"}
    return (
        difference(old.astype(float), new.astype(float))
        if numeric
        else float(old.dtype.kind != new.dtype.kind or old != new)
    )
