"""Make one mistake at a time in a copy of the sources and see whether the tests notice: ``make mutations``.

``python tests/mutations.py [MODULE ...]`` tries those of tests/mutations.yaml, writes results/evidence/mutations.json
and ends with exit code 1 if one went unnoticed.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
LIST = yaml.safe_load((ROOT / "tests" / "mutations.yaml").read_text(encoding="utf-8"))
LONGEST = 300  # s


def source(root: Path, module: str) -> Path:
    return root / "pneumo" / (module.replace(".", "/") + ".py")


def passes(copy: Path, entry: dict) -> bool:
    """Whether the tests of a module pass in a copy; one that hangs has noticed."""
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    environment["NUMBA_DISABLE_JIT"] = "0" if entry.get("jit") else "1"
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *entry["tests"]]
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return False
    if done.returncode not in (0, 1, 2):
        raise RuntimeError(f"{entry['tests']}: {done.stdout.decode()}")
    return done.returncode == 0


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
    evidence = ROOT / "results" / "evidence"
    evidence.mkdir(parents=True, exist_ok=True)
    if not names:
        (evidence / "mutations.json").write_text(json.dumps(counts, indent=1) + "\n", encoding="utf-8")
    print(*missed, sep="\n")
    tried = sum(count["tried"] for count in counts.values())
    print(f"{sum(count['caught'] for count in counts.values())} of {tried} mistakes caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
