"""Measure the kernel, its contenders, the bound and the whole study, and write results/bench.json."""

import json
import os
import platform
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from numba.core.codegen import get_host_cpu_features

from benchmarks.contenders import CONTENDERS, installed
from benchmarks.report import chart, markdown, show
from benchmarks.study_runs import run_study
from benchmarks.timing import REPEATS, ROOT, compare, growth, stay_on_one_core

AVX2 = {"NUMBA_CPU_NAME": "znver3", "NUMBA_CPU_FEATURES": "+avx2,+fma,+bmi,+bmi2"}


def cpu() -> str:
    """Name of the processor, its number of cores and its vector instructions."""
    info = Path("/proc/cpuinfo")
    text = info.read_text() if info.exists() else ""
    named = re.search(r"model name\s*: (.*)", text)
    name = named.group(1) if named else platform.processor() or platform.machine()
    numbers = re.search(r"cpu family\s*: (\d+)\nmodel\s*: (\d+)", text)
    family = f" (family {numbers.group(1)}, model {numbers.group(2)})" if numbers else ""
    return f"{name}{family}, {os.cpu_count()} cores, {widest()}"


def widest() -> str:
    """Name of the widest vector instructions that the processor has."""
    features = set(get_host_cpu_features().split(","))
    return "AVX-512" if "+avx512f" in features else "AVX2" if "+avx2" in features else "no AVX2"


def contest() -> dict[str, Any]:
    """Compare all contenders that are installed, and see how the kernel's cost grows."""
    stay_on_one_core()
    present = {name: contender for name, contender in CONTENDERS.items() if installed(contender)}
    return {**compare(present, REPEATS), "growth": growth(5)}


def with_avx2() -> dict[str, Any]:
    """The kernel and the bound once more, both compiled for AVX2."""
    command = [sys.executable, "-m", "benchmarks.timing"]
    done = subprocess.run(command, cwd=ROOT, env=os.environ | AVX2, check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def main() -> None:
    """Measure everything and write it."""
    print(f"bench: contenders on one core, {REPEATS} times in turn", flush=True)
    with ProcessPoolExecutor(1) as pool:  # its own process: the study below is not to stay on one core
        report = pool.submit(contest).result()
    names = ("ns_per_lane_evaluation", "bound_ns", "fraction_of_bound", "bound")
    sets = {widest(): report}
    if widest() == "AVX-512":
        print("bench: the kernel with AVX2", flush=True)
        sets["AVX2"] = with_avx2()
    print("bench: the study, three times", flush=True)
    report |= run_study()
    report["instruction_sets"] = {name: {key: row[key] for key in names} for name, row in sets.items()}
    report["cpu"] = cpu()
    results = ROOT / "results"
    (results / "bench.json").write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    (results / "bench.md").write_text(markdown(report), encoding="utf-8")
    chart(report, results / "figures/bench")
    show(report)


if __name__ == "__main__":
    main()
