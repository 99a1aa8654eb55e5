"""Keep a copy of evidence in paper/evidence, or compare what was made anew with the copy.

`python workflow/kept.py keep floor.nc` copies from results/ and lists the SHA-256 of all copies; `compare`
prints how far results/ are from the copies, each number over its kept value, and exits with 1 where that is
more than the copy's digits explain.
"""

import json
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from pneumo.evidence.kept_copies import COPIES, Copy, differences, tolerance
from pneumo.storage.files import read, read_json, write, write_json
from pneumo.storage.kept_evidence import KEPT, kept_files, list_kept

RESULTS = Path("results")


def keep(name: str) -> None:
    """Copy a file of evidence from results, with the day on which it was made there."""
    file, copy = RESULTS / name, COPIES.get(name, Copy())
    made = {"date_created": f"{datetime.fromtimestamp(file.stat().st_mtime, UTC):%Y-%m-%d}"}
    if file.suffix == ".json":
        content = json.loads(read_json(file)) | made
        return write_json(json.dumps(content, indent=1, ensure_ascii=False), KEPT / name)
    dataset = read(file, *copy.variables)
    return write(dataset, KEPT / name, dataset.attrs | made, copy.digits)


def main(what: str, names: Sequence[str]) -> int:
    """Keep or compare the named files; return the exit code."""
    code = 0
    for name in names or [file.name for file in kept_files(KEPT)]:
        if what == "keep":
            keep(name)
            continue
        off = differences(KEPT / name, RESULTS / name)
        limits = {variable: tolerance(name, variable) for variable in off}
        worst = max(off, key=lambda variable: off[variable] / limits[variable])
        far = off[worst] > limits[worst]
        words = f"{off[worst]:.1e} off in {worst}" if off[worst] else "equal"
        print(f"{name}: {words}{', too much' if far else ''}")
        code |= far
    if what == "keep":
        list_kept(KEPT)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
