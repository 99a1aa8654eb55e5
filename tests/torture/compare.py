"""Compare two folders of results: ``python -m tests.torture.compare BEFORE AFTER [--rtol 0]``.

Every variable of every NetCDF file must be equal bit for bit (name, dimensions, type, values; NaN equals
NaN), and so must attributes, JSON values and the bytes of all other files. The configuration's hash may
differ. Prints what differs; exit code 1 if anything does.
"""

import argparse
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from netCDF4 import Dataset

HASHES = {"config_sha256"}  # attributes and JSON keys that may differ
HASH = re.compile(rb"\b[0-9a-f]{64}\b")  # in a page
NOT_COMPARED = {"logs", "evidence", "SHA256SUMS", "bench.json", "README.md"}  # times, hosts, measurements


def compared_files(results: Path) -> list[str]:
    """Return the names of all files of a study that must not change, relative to its folder."""
    files = (file.relative_to(results) for file in results.rglob("*") if file.is_file())
    return sorted(str(file) for file in files if not NOT_COMPARED & set(file.parts))


def relative_change(before: np.ndarray, after: np.ndarray) -> float:
    """Return the largest change over the largest magnitude; infinite if types, labels or gaps differ."""
    if (before.dtype, before.shape) != (after.dtype, after.shape):
        return np.inf
    if before.dtype.kind != "f":
        return 0.0 if np.array_equal(before, after) else np.inf
    gaps = np.isnan(before)
    if not np.array_equal(gaps, np.isnan(after)):
        return np.inf
    before, after = before[~gaps], after[~gaps]
    if before.tobytes() == after.tobytes():
        return 0.0
    with np.errstate(all="ignore"):  # infinite values; nothing but zeros before
        change = float(np.max(np.abs(after - before)) / max(np.max(np.abs(before)), 5e-324))
    return np.inf if np.isnan(change) else max(change, 5e-324)  # zeros may differ in sign


def json_values(value: Any, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Yield every value of a JSON document with its path, but for hashes."""
    if isinstance(value, dict | list) and value:
        for key, each in value.items() if isinstance(value, dict) else enumerate(value):
            if key not in HASHES:
                yield from json_values(each, f"{name}/{key}")
    else:
        yield name, np.asarray(value)


def contents(file: Path) -> dict[str, np.ndarray]:
    """Return the parts of a file that are compared: variables, attributes, JSON values, or its bytes."""
    if file.suffix == ".json":
        return dict(json_values(json.loads(file.read_bytes())))
    if file.suffix != ".nc":
        text = file.read_bytes()
        return {"bytes": np.asarray(HASH.sub(b"", text) if file.suffix == ".html" else text)}
    with Dataset(file.absolute()) as opened:
        opened.set_auto_maskandscale(False)
        parts = {name: np.asarray(variable[...]) for name, variable in opened.variables.items()}
        for name, holder in [("", opened), *opened.variables.items()]:
            parts[f"{name}: dimensions"] = np.asarray([*holder.dimensions])
            for attribute in set(holder.ncattrs()) - HASHES:
                parts[f"{name}: {attribute}"] = np.asarray(holder.getncattr(attribute))
    return parts


def differences(before: Path, after: Path, rtol: float = 0.0) -> Iterator[str]:
    """Yield one line for everything in which two folders of results differ."""
    old, new = set(compared_files(before)), set(compared_files(after))
    yield from (f"{name}: only {'before' if name in old else 'after'}" for name in sorted(old ^ new))
    for name in sorted(old & new):
        was, made = contents(before / name), contents(after / name)
        sides = {part: "before" if part in was else "after" for part in was.keys() ^ made}
        yield from (f"{name}: {part}: only {side}" for part, side in sides.items())
        for part in sorted(was.keys() & made):
            if (change := relative_change(was[part], made[part])) > rtol:
                by = f" by {change:.2g} of its largest value" if change < np.inf else ""
                yield f"{name}: {part}: differs{by}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    parser.add_argument("--rtol", type=float, default=0.0, help="allowed change over the largest value")
    options = parser.parse_args()
    lines = list(differences(**vars(options)))
    print(*lines, f"{len(compared_files(options.before))} files, {len(lines)} differences", sep="\n")
    raise SystemExit(bool(lines))
