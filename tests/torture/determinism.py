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
from typing import NamedTuple

from pneumo.storage.files import write_text
from tests.checkout import ROOT
from tests.torture.study import Study


class Variant(NamedTuple):
    """One way to run the study."""

    arguments: tuple[str, ...] = ("-j2",)
    environment: Mapping[str, str] = {}
    compiler: str = ""  # command that builds the core of this variant
    needs: str = ""  # instructions that the processor must have, as /proc/cpuinfo names them


def build(compiler: str, march: str = "", needs: str = "") -> Variant:
    """Core by a compiler, for one generation of processors."""
    return Variant(compiler=f"{compiler} -DPNEUMO_NO_CLONES{march and f' -march={march}'}", needs=needs)


VARIANTS = {
    "one_job": Variant(("-j1",)),
    "one_replay_thread": Variant(("-j2", "--set-threads", "replay=1")),
    "one_library_thread": Variant(environment={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}),
    "gcc_sse2": build("gcc", "x86-64"),
    "gcc_avx2": build("gcc", "x86-64-v3", needs="avx2"),
    "gcc_avx512": build("gcc", "x86-64-v4", needs="avx512f"),
    "gcc_O2": build("gcc -O2"),
    "clang": build("clang"),
    "clang_O2_avx2": build("clang -O2", "x86-64-v3", needs="avx2"),
}


def rebuild(folder: Path, compiler: str) -> None:
    """Compile the core of a copy of the checkout; the compiler's own flags come last."""
    name, *flags = shlex.split(compiler)
    script = folder / "compile"
    script.write_text(f'#!/bin/sh\nexec {name} "$@" {shlex.join(flags)}\n')
    script.chmod(0o755)
    command = [sys.executable, "setup.py", "--quiet", "build_ext", "--inplace", "--force"]
    path = {"CC": "./compile", "PATH": f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"}
    subprocess.run(command, cwd=folder, env=path, check=True)
    script.unlink()
    shutil.rmtree(folder / "build", ignore_errors=True)


def main() -> int:
    """Run the variants asked for and write how many files are equal to this machine's run with two jobs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="", help="configuration on top of the paper's")
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS)
    parser.add_argument("--evidence", type=Path, default=ROOT / "results/evidence/determinism.json")
    options = parser.parse_args()
    info = Path("/proc/cpuinfo")
    features, outcomes = set(info.read_text().split() if info.exists() else ()), {}
    with tempfile.TemporaryDirectory(prefix="determinism ") as scratch:

        def hashes(name: str, variant: Variant) -> dict[str, str]:
            made = Study(Path(scratch, name), options.config, variant.environment)
            if variant.compiler:
                rebuild(made.folder, variant.compiler)
            done = made.run(*variant.arguments)
            if done.code:
                raise SystemExit(f"{name}: {done.output}")
            found = made.hashes()
            shutil.rmtree(made.folder)
            return found

        expected = hashes("reference", Variant())
        for name in options.variants:
            variant = VARIANTS[name]
            compiler = variant.compiler.split()[:1]
            if (variant.needs and variant.needs not in features) or not all(map(shutil.which, compiler)):
                print(f"{name}: left out: no {variant.needs or compiler[0]} here", flush=True)
                continue
            found = hashes(name, variant)
            different = sorted(
                file for file in expected.keys() | found if expected.get(file) != found.get(file)
            )
            outcomes[name] = {"files": len(expected), "different": different}
            print(f"{name}: {len(expected)} files, different: {different or 'none'}", flush=True)
    write_text(json.dumps(outcomes, indent=1) + "\n", options.evidence)
    return int(any(outcome["different"] for outcome in outcomes.values()))


if __name__ == "__main__":
    raise SystemExit(main())
