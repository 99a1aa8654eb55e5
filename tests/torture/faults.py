"""Disturb the study at random moments and in other ways; after a rerun the bytes must be the same.

``python -m tests.torture.faults`` runs the paper's study, ``--config config/smoke.yaml`` a short one.
"""

import argparse
import json
import random
import signal
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from pneumo.storage.files import write_text
from tests.checkout import ROOT
from tests.torture.study import Study, stop


class NotRun(Exception):
    """A fault that this machine does not allow to be made."""


class Bench(NamedTuple):
    """A study to disturb, its undisturbed results, and how often to try."""

    study: Study
    expected: dict[str, str]  # hashes of an undisturbed run
    seconds: float  # duration of that run
    size: int  # of its results, bytes
    rng: random.Random
    kills: int
    tries: int

    def moment(self) -> float:
        """Seconds from the start to the disturbance."""
        return self.rng.uniform(0.0, self.seconds)

    def rerun(self, disturbance: str) -> tuple[bool, str]:
        """Run again; return whether the bytes are the expected ones, and the outcome in words."""
        done = self.study.run()
        same = done.code == 0 and self.study.hashes() == self.expected
        reason = done.refusal or done.output[-300:]
        return same, disturbance if same else f"{disturbance}: NOT REPAIRED: {reason}"


Fault = Callable[[Bench], Iterator[tuple[bool, str]]]


def interrupted(bench: Bench, number: signal.Signals, tries: int, alone: bool) -> Iterator[tuple[bool, str]]:
    """Signal the run; if asked to, every other time without its jobs, which go on writing for a while."""
    for attempt in range(tries):
        bench.study.clear()
        with_jobs = not alone or attempt % 2 == 0
        stopped = stop(bench.study.start(), number, with_jobs=with_jobs, after=bench.moment())
        signalled = f"{number.name}{'' if with_jobs else ', its jobs left to themselves'}, resumed"
        yield bench.rerun(signalled if stopped else f"over before {number.name}")


def mount(*arguments: str) -> None:
    """Mount, or say that this is not allowed."""
    done = subprocess.run(["mount", *arguments], capture_output=True, text=True)
    if done.returncode:
        raise NotRun(done.stderr.strip())


@contextmanager
def mounted(folder: Path, *arguments: str) -> Generator[None]:
    """Mount onto a folder for a while."""
    mount(*arguments, str(folder))
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def disk_full(bench: Bench) -> Iterator[tuple[bool, str]]:
    """Run on a disk that holds part of the results; give it room; run again."""
    for _ in range(bench.tries):
        bench.study.clear()
        room = int(bench.size * bench.rng.uniform(0.05, 0.95))
        with mounted(bench.study.results, "-t", "tmpfs", "-o", f"size={room}", "tmpfs"):
            done = bench.study.run()
            mount("-o", f"remount,size={4 * bench.size}", str(bench.study.results))
            yield bench.rerun(f"{done.refusal or 'stopped by Snakemake'}; resumed with room")


def read_only(bench: Bench) -> Iterator[tuple[bool, str]]:
    """Run on unfinished results that cannot be written; make them writable; run again."""
    for _ in range(bench.tries):
        bench.study.clear()
        stop(bench.study.start(), signal.SIGKILL, with_jobs=True, after=bench.moment())
        with mounted(bench.study.results, "--bind", str(bench.study.results)):
            mount("-o", "remount,ro,bind", str(bench.study.results))
            done = bench.study.run()
        yield bench.rerun(f"{done.refusal or 'Snakemake had nothing to do'}; resumed")


def two_runs(bench: Bench) -> Iterator[tuple[bool, str]]:
    """Start two at once: one works, the other is refused."""
    for _ in range(bench.tries):
        bench.study.clear()
        runs = [bench.study.start() for _ in range(2)]
        codes = sorted(run.wait() for run in runs)
        same = bench.study.hashes() == bench.expected
        yield same and codes == [0, 2], f"exit codes {codes[0]} and {codes[1]}"


def damage(bench: Bench) -> Iterator[tuple[bool, str]]:
    """Flip a bit of a file, cut it, or put text in its place: it is named; delete it; run again."""
    study = bench.study
    for number in range(3 * bench.tries):
        path = study.results / bench.rng.choice(sorted(bench.expected))
        content = bytearray(path.read_bytes())
        place = bench.rng.randrange(len(content))
        if number % 3 == 0:
            content[place] ^= 1 << bench.rng.randrange(8)
        path.write_bytes([content, content[:place], b"Shopping: eggs, flour"][number % 3])
        named = (
            str(path.relative_to(study.folder)) in study.pneumo("paper", "verify", study.results.name).output
        )
        path.unlink()
        same, outcome = bench.rerun("named, deleted, made again")
        yield same and named, outcome if named else f"{path.name}: NOT named"


FAULTS: dict[str, Fault] = {
    "sigkill": lambda bench: interrupted(bench, signal.SIGKILL, bench.kills, alone=True),
    "sigint": lambda bench: interrupted(bench, signal.SIGINT, bench.tries, alone=False),
    "disk_full": disk_full,
    "read_only": read_only,
    "two_runs": two_runs,
    "damage": damage,
}


def tried(name: str, bench: Bench, study: str) -> dict[str, object]:
    """Try one fault, with a line for each try."""
    same, outcomes = [], Counter()
    try:
        for identical, outcome in FAULTS[name](bench):
            same.append(identical)
            outcomes[outcome] += 1
            print(f"{name} {len(same)}: {'same' if identical else 'OTHER'} bytes: {outcome}", flush=True)
    except NotRun as reason:
        outcomes[f"not run: {reason}"] += 1
        print(f"{name}: not run: {reason}", flush=True)
    text = "; ".join(f"{number} x {outcome}" for outcome, number in outcomes.items())
    return {"tried": len(same), "identical": sum(same), "outcome": f"{study}: {text}"}


def main() -> int:
    """Try the requested faults and add the outcomes to the evidence."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="", help="configuration on top of the paper's")
    parser.add_argument("--faults", nargs="+", default=list(FAULTS), choices=FAULTS)
    parser.add_argument("--kills", type=int, default=40, help="tries of sigkill")
    parser.add_argument("--tries", type=int, default=3, help="tries of every other fault")
    parser.add_argument("--seed", type=int, default=2006)
    parser.add_argument("--evidence", type=Path, default=ROOT / "results/evidence/torture.json")
    options = parser.parse_args()
    print(f"seed {options.seed}", flush=True)
    with tempfile.TemporaryDirectory(prefix="torture ") as scratch:
        study = Study(Path(scratch, "a checkout"), options.config)
        start = time.perf_counter()
        done = study.run()
        seconds = time.perf_counter() - start
        if done.code:
            raise SystemExit(done.output)
        expected, size = study.hashes(), study.size()
        print(f"undisturbed: {len(expected)} files, {seconds:.0f} s", flush=True)
        name = Path(options.config).stem or "paper"
        outcomes = json.loads(options.evidence.read_text()) if options.evidence.exists() else {}
        for fault in options.faults:
            rng = random.Random(f"{options.seed} {fault}")
            bench = Bench(study, expected, seconds, size, rng, options.kills, options.tries)
            outcomes[fault] = tried(fault, bench, name)
            write_text(json.dumps(outcomes, indent=1) + "\n", options.evidence)
    return int(any(outcomes[fault]["tried"] != outcomes[fault]["identical"] for fault in options.faults))


if __name__ == "__main__":
    raise SystemExit(main())
