"""Run the study with other numbers of jobs and threads, and other builds of the core: all bytes are equal."""

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.storage.files import write_text
from tests.checkout import ROOT
from tests.torture.study import Study

DATA = ("settling.nc", "exact/statistics.nc")  # the last of the stages that simulate
# Another number of jobs and threads, for which the study is run.
ONE = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
# Compilers and the instructions that the processor must have, as /proc/cpuinfo names them; for each, all that
# the core computes for the study is compared.
BUILDS = {
    "gcc_sse2": ("gcc -march=x86-64", ""),
    "gcc_avx2": ("gcc -march=x86-64-v3", "avx2"),
    "gcc_avx512": ("gcc -march=x86-64-v4", "avx512f"),
    "gcc_O2": ("gcc -O2", ""),
    "clang": ("clang", ""),
    "clang_O2_avx2": ("clang -O2 -march=x86-64-v3", "avx2"),
}


def rebuild(folder: Path, compiler: str) -> None:
    """Compile the core of a copy of the checkout; the compiler's own flags come last."""
    name, *flags = shlex.split(f"{compiler} -DPNEUMO_NO_CLONES")
    script = folder / "compile"
    script.write_text(f'#!/bin/sh\nexec {name} "$@" {shlex.join(flags)}\n')
    script.chmod(0o755)
    command = [sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", "--force"]
    path = {"CC": "./compile", "PATH": f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"}
    subprocess.run(command, cwd=folder, env=path, check=True)
    script.unlink()
    shutil.rmtree(folder / "build", ignore_errors=True)


def main() -> int:
    """Compare with the study as two jobs make it here; write how many results differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="", help="configuration on top of the paper's")
    parser.add_argument("--evidence", type=Path, default=ROOT / "results/evidence/determinism.json")
    options = parser.parse_args()
    info, outcomes = Path("/proc/cpuinfo"), dict[str, Any]()
    features = set(info.read_text().split() if info.exists() else ())

    def compare(name: str, expected: Mapping[str, str], found: Mapping[str, str]) -> None:
        different = sorted(key for key in expected.keys() | found if expected.get(key) != found.get(key))
        outcomes[name] = {"results": len(expected), "different": different}
        print(f"{name}: {len(expected)} results, different: {different or 'none'}", flush=True)

    def made(study: Study, jobs: str) -> dict[str, str]:  # of figures and pages, tests compare the bytes
        done = study.run(jobs, *(f"{study.results.name}/{name}" for name in DATA))
        if done.code:
            raise SystemExit(done.output)
        return study.hashes()

    def computed(study: Study) -> dict[str, str]:
        command = [sys.executable, "-m", "tests.torture.fingerprint", *options.config.split()]
        lines = subprocess.check_output(command, **study.options).splitlines()
        return dict(line.split(": ") for line in lines)

    with tempfile.TemporaryDirectory(prefix="determinism ") as scratch:
        study = Study(Path(scratch, "two jobs"), options.config)
        one = Study(Path(scratch, "one job"), options.config, ONE)
        compare("one_job_and_thread", made(study, "-j2"), made(one, "-j1"))
        expected = computed(study)
        for name, (compiler, needs) in BUILDS.items():
            if (needs and needs not in features) or not shutil.which(compiler.split()[0]):
                print(f"{name}: left out: no {needs or compiler} here", flush=True)
                continue
            rebuild(one.folder, compiler)
            compare(name, expected, computed(one))
    write_text(json.dumps(outcomes, indent=1) + "\n", options.evidence)
    return int(any(outcome["different"] for outcome in outcomes.values()))


if __name__ == "__main__":
    raise SystemExit(main())
