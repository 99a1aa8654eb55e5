"""Keep a copy of evidence in paper/evidence, or compare what was made anew with the copy.

`python workflow/kept.py keep floor.nc` copies from results/; `compare` prints how far results/ are from the
copies and exits with 1 where that is more than the copy's digits explain.
"""

import json
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pneumo.storage.files import read, read_json, write, write_json
from pneumo.storage.kept_evidence import KEPT

RESULTS = Path("results")


class Copy(NamedTuple):
    """Digits and variables that are kept of a file of evidence."""

    digits: int | None = 4  # of floating-point numbers; None: all
    variables: tuple[str, ...] = ()  # that pages and statements read; none: all


OF_COVERAGE = ("truth", "low", "high", "full_k_0", "full_true_k_0", "full_low", "full_high")
OF_CYLINDERS = (
    "lowest",
    "counts",
    "held_out",
    "ratio",
    "share",
    "cylinders",
    "map_ratio",
    "thermal_edge",
    "exchange_edge",
)
OF_CYLINDERS += tuple(f"third_{name}" for name in ("from", "to", "ratio", "share"))
OF_CYLINDERS += tuple(f"rule_{name}" for name in ("threshold", "model", "error", "quotient"))
PARTS = ("model_error", "transport_error", "discretisation_error", "cross_term", "total", "total_exact")
PARTS += ("regularised_discretisation", "chatter", "regularised_law", "halving", "sampled", "told_apart")
PARTS += tuple(f"reference_{name}" for name in ("model_error", "coarse", "fine"))
OF_BUDGET = tuple(f"level_{part}" for part in PARTS)
COPIES = {  # the others as `Copy` has it
    "assumptions.nc": Copy(digits=None),  # as taken they are the study, which a test compares
    "cylinders.nc": Copy(4, OF_CYLINDERS),
    "error_budget.nc": Copy(4, (*OF_BUDGET, "constant_n", "best_n", "told_apart", "order")),
    "open_loop.nc": Copy(digits=6),  # places of pairs: scores differ by tenths
    "variants.nc": Copy(None, ("ratio", "share", "counted")),
    "seed_sets.nc": Copy(digits=5),
    # Six digits hardly move a truth across an interval's end.
    "fit_coverage.nc": Copy(6, (*OF_COVERAGE, "full_held_out", "full_seconds")),
}
TOLERANCE = 10.0  # times what the digits explain: another processor, another order of sums


def keep(name: str) -> None:
    """Copy a file of evidence from results, with the day on which it was made there."""
    file, copy = RESULTS / name, COPIES.get(name, Copy())
    made = {"date_created": f"{datetime.fromtimestamp(file.stat().st_mtime, UTC):%Y-%m-%d}"}
    if file.suffix == ".json":
        content = json.loads(read_json(file)) | made
        return write_json(json.dumps(content, indent=1, ensure_ascii=False), KEPT / name)
    dataset = read(file, *copy.variables)
    return write(dataset, KEPT / name, dataset.attrs | made, copy.digits)


def difference(name: str) -> float:
    """Largest difference between results and copy, over the largest number of its variable."""
    if name.endswith(".json"):
        new, kept = (json.loads(read_json(folder / name))["claims"] for folder in (RESULTS, KEPT))
        return float([row["stands"] for row in new] != [row["stands"] for row in kept])
    kept, worst = read(KEPT / name), 0.0
    new = read(RESULTS / name, *map(str, kept.data_vars)).transpose(*kept.dims)
    for key, values in kept.data_vars.items():
        if values.dtype.kind not in "fiu":
            worst = max(worst, float((values.values != new[key].values).any()))
            continue
        old, own = values.values.astype(float), new[key].transpose(*values.dims).values.astype(float)
        off = np.abs(own - old).max(initial=0.0, where=np.isfinite(old) & np.isfinite(own))
        scale = np.abs(old).max(initial=0.0, where=np.isfinite(old))
        worst = max(worst, float(off / scale) if off else 0.0, float((np.isnan(old) != np.isnan(own)).any()))
    return worst


def main(what: str, names: Sequence[str]) -> int:
    """Keep or compare the named files; return the exit code."""
    code = 0
    for name in names or sorted(file.name for file in KEPT.iterdir() if file.suffix in (".nc", ".json")):
        if what == "keep":
            keep(name)
            continue
        off, limit = difference(name), TOLERANCE * 10 ** -(COPIES.get(name, Copy()).digits or 15)
        print(f"{name}: {'equal' if off == 0 else f'{off:.1e} off'}{'' if off <= limit else ', too much'}")
        code |= off > limit
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
