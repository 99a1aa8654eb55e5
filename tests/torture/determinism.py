"""Run the study with other numbers of jobs and threads, and with code for other processors; compare.

Jobs and threads must not change a byte. Code for another processor rounds elsewhere: no number of a NetCDF
file may move by more than `BOUND` of the largest of its variable, no status of a cell or of the verdict may
change.
"""

import argparse
import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from llvmlite.binding import get_host_cpu_features

from pneumo.storage.files import write_text
from tests.checkout import ROOT
from tests.torture.compare import contents, relative_change
from tests.torture.study import Study

BOUND = 1e-12  # on the smoke study: 9e-15 for SSE2, nothing for AVX2 and AVX-512, which fuse operations alike


class Variant(NamedTuple):
    """One way to run the study."""

    bound: float = 0.0  # on differences; without one every byte must be the same
    arguments: tuple[str, ...] = ("-j2",)
    environment: Mapping[str, str] = {}
    instructions: str = ""  # that this processor must have; the variant is left out where it has not


def processor(name: str, features: str = "", instructions: str = "") -> Variant:
    """Code for a processor of LLVM's names; this machine's own may be a newer one."""
    variables = {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features}
    return Variant(bound=BOUND, environment=variables, instructions=instructions)


REFERENCE = Variant()
VARIANTS = {
    "one_job": Variant(arguments=("-j1",)),
    "one_replay_thread": Variant(arguments=("-j2", "--set-threads", "replay=1")),
    "one_library_thread": Variant(environment={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}),
    "avx512": processor("x86-64-v4", "-prefer-256-bit", instructions="avx512f"),
    "avx2": processor("x86-64-v3", instructions="avx2"),
    "sse2": processor("x86-64"),
}


def largest_change(one: Path, other: Path) -> tuple[float, str]:
    """Return the largest change of a part of a NetCDF file over its largest value, and the part's name."""
    before, after = contents(one), contents(other)
    changes = [(0.0 if before.keys() == after.keys() else np.inf, "names")]
    for name in before.keys() & after:
        change = relative_change(before[name], after[name])
        # Where float32 is stored it may round to either side.
        last_place = before[name].dtype.kind == "f" and change <= np.finfo(before[name].dtype).eps
        changes.append((0.0 if last_place else change, name))
    return max(changes)


def statuses(study: Study) -> dict[str, str]:
    """Status of every item of the verdict."""
    items = json.loads((study.results / "verdict.json").read_text())["items"]
    return {item["id"]: item["status"] for item in items}


def compared(one: Study, other: Study) -> dict[str, Any]:
    """How far the second study's results are from the first's."""
    expected, hashes = one.hashes(), other.hashes()
    largest, where = 0.0, ""
    for name in sorted(expected):
        if name.endswith(".nc") and hashes.get(name) != expected[name]:
            by, variable = largest_change(one.results / name, other.results / name)
            if by > largest:
                largest, where = by, f"{name}: {variable}"
    return {
        "files": len(expected),
        "identical": sum(hashes.get(name) == digest for name, digest in expected.items()),
        "largest_difference": largest,
        "where": where,
        "same_statuses": statuses(one) == statuses(other),
    }


def main() -> int:
    """Run the variants asked for and write how far each is from this machine's run with two jobs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="", help="configuration on top of the paper's")
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS)
    parser.add_argument("--evidence", type=Path, default=ROOT / "results/evidence/determinism.json")
    options = parser.parse_args()
    outcomes = {}
    with tempfile.TemporaryDirectory(prefix="determinism ") as scratch:

        def study(name: str, variant: Variant) -> Study:
            # Numba knows sources by path: the copies run this checkout's, compiled once for each processor.
            environment = {"PYTHONPATH": str(ROOT)} | dict(variant.environment)
            made = Study(Path(scratch, name), options.config, environment)
            done = made.run(*variant.arguments)
            if done.code:
                raise SystemExit(f"{name}: {done.output}")
            return made

        reference = study("reference", REFERENCE)
        for name in options.variants:
            variant = VARIANTS[name]
            if variant.instructions and not get_host_cpu_features().get(variant.instructions):
                print(f"{name}: left out, since this processor has no {variant.instructions}", flush=True)
                continue
            result = compared(reference, study(name, variant))
            same = result["identical"] == result["files"]
            holds = same or (result["largest_difference"] <= variant.bound and result["same_statuses"])
            outcomes[name] = {"study": Path(options.config).stem or "paper", "bound": variant.bound} | result
            outcomes[name]["holds"] = holds
            print(f"{name}: {outcomes[name]}", flush=True)
            shutil.rmtree(Path(scratch, name))
    write_text(json.dumps(outcomes, indent=1) + "\n", options.evidence)
    return int(not all(result["holds"] for result in outcomes.values()))


if __name__ == "__main__":
    raise SystemExit(main())
