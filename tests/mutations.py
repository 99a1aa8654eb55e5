"""Make one mistake at a time in a copy of the sources and see whether the tests notice: ``make mutations``.

``python tests/mutations.py [MODULE ...]`` tries those of tests/mutations.yaml, writes
results/evidence/mutations.json and ends with exit code 1 if one went unnoticed.
"""

import json
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

import hypothesis
import matplotlib.figure  # noqa: F401 - loaded once, not in every process
import netCDF4  # noqa: F401
import numba
import pint  # noqa: F401
import pydantic  # noqa: F401
import pytest
import scipy.integrate  # noqa: F401
import typer  # noqa: F401
import xarray  # noqa: F401
import yaml

ROOT = Path(__file__).parents[1]
LIST = yaml.safe_load((ROOT / "tests" / "mutations.yaml").read_text(encoding="utf-8"))
LONGEST = 120  # s of processor time
FIND = (hypothesis.Phase.explicit, hypothesis.Phase.generate)  # a mistake found need not be made small


def source(root: Path, module: str) -> Path:
    return root / "pneumo" / (module.replace(".", "/") + ".py")


def passes(copy: Path, entry: dict) -> bool:
    """Whether the tests of a module pass in a copy, in a process that has loaded the libraries already."""
    child = os.fork()
    if not child:
        signal.setitimer(signal.ITIMER_PROF, LONGEST)  # tests that hang have noticed; a busy machine has not
        os.chdir(copy)
        sys.path[0] = str(copy)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1), os.dup2(nowhere, 2)
        os.environ["PYTHONPATH"], sys.dont_write_bytecode = str(copy), True
        hypothesis.settings.register_profile("quick", max_examples=50, database=None, phases=FIND)
        hypothesis.settings.load_profile("quick")
        numba.config.DISABLE_JIT = not entry.get("jit")
        os._exit(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *entry["tests"]]))
    _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if code in (3, 4, 5):
        raise RuntimeError(f"{entry['tests']}: pytest ends with {code}")
    return code == 0


def main(names: list[str]) -> int:
    """Try the mistakes of the named modules, or of all."""
    counts, missed = {}, []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in ("pneumo", "tests", "workflow", "config", "paper"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("pyproject.toml", "Snakefile", "README.md", "Makefile"):
            shutil.copy(ROOT / name, copy)
        for module in names or LIST:
            entry, file, start = LIST[module], source(copy, module), time.perf_counter()
            text = file.read_text(encoding="utf-8")
            if not passes(copy, entry):
                missed.append(f"{module}: its tests fail without a mistake")
            caught = 0
            for old, new in entry["changes"]:
                file.write_text(text.replace(old, new), encoding="utf-8")
                if passes(copy, entry):
                    missed.append(f"{module}: {old!r} -> {new!r}")
                else:
                    caught += 1
            file.write_text(text, encoding="utf-8")
            counts[module] = {"tried": len(entry["changes"]), "caught": caught}
            seconds = time.perf_counter() - start
            print(f"{module}: {caught} of {len(entry['changes'])} caught, {seconds:.0f} s", flush=True)
    if not names:
        evidence = ROOT / "results" / "evidence"
        evidence.mkdir(parents=True, exist_ok=True)
        (evidence / "mutations.json").write_text(json.dumps(counts, indent=1) + "\n", encoding="utf-8")
    print(*missed, sep="\n")
    tried = sum(count["tried"] for count in counts.values())
    print(f"{sum(count['caught'] for count in counts.values())} of {tried} mistakes caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
