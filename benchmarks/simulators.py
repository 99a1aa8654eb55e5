"""Who reproduces the paper how well: four sets of runs, each through ``pneumo paper verdict --runs``.

``python -m benchmarks.simulators FOLDER`` makes the runs that FOLDER lacks (two hours of one core for all),
judges each set, and writes paper/2006/simulators.json.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from benchmarks.fmu_runs import fmu_run
from paper.study import PAPERS
from paper.study.stored_runs import read_json
from pneumo.configuration.experiment import Experiment
from pneumo.configuration.parameters import load, study
from pneumo.simulation.full_order import STATE, record

ROOT = PAPERS.parent
FILE = ROOT / "paper/2006/simulators.json"
OWN = "pneumo"
SIMULATORS = {  # folder: name
    OWN: "pneumo",
    "independent": "independent implementation, SciPy's LSODA",
    "fmu_often": "FMU in fmpy, command held for 0.1 ms",
    "fmu": "FMU in fmpy, command held for 1 ms",
}
EVERY = {"fmu": 1, "fmu_often": 10}  # communication points in 1 ms


def own_run(e: Experiment) -> xr.Dataset:
    """Run of an experiment by pneumo, in the format of `pneumo paper verdict --runs`."""
    recording = record(e)
    columns = {name: ("t", values) for name, values in zip(STATE, recording.states.T, strict=True)}
    columns["u"] = "t", recording.u
    return xr.Dataset(columns, {"t": np.arange(e.steps + 1) * e.h})


def make_runs(folder: Path, kind: str) -> None:
    """Make the runs of a simulator that its folder lacks."""
    (folder / kind).mkdir(parents=True, exist_ok=True)
    experiments = study(load(ROOT / "config/paper.yaml")).experiments
    lacking = [name for name in experiments if not (folder / kind / f"{name}.nc").exists()]
    if kind == "independent" and lacking:
        script = ROOT / "tests/independent_simulator.py"
        subprocess.run([sys.executable, str(script), str(folder / kind), *lacking], check=True)
        return
    for name in lacking:
        e = experiments[name]
        run = own_run(e) if kind == OWN else fmu_run(e, folder, EVERY[kind])
        run.to_netcdf(folder / kind / f"{name}.nc")


def judged(folder: Path, kind: str) -> dict[str, Any]:
    """Verdict on a simulator's runs, by the command, as a row of the table."""
    runs = folder / kind
    command = [str(Path(sys.executable).with_name("pneumo")), "paper", "verdict", "--runs", str(runs)]
    subprocess.run([*command, "--tool", SIMULATORS[kind]], check=True, cwd=ROOT)
    verdict = read_json(runs / "verdict/verdict.json")
    scores, fit = verdict["highlights"]["scores"], verdict["highlights"]["fit"]
    every = {row["table"]: row["meant"] for row in fit["tables"]}["all"] if fit else None
    return {
        "name": SIMULATORS[kind],
        "table_7": scores["table_7_mse"]["rms_of_ln_ratio"],
        "table_9": scores["table_9_mse"]["rms_of_ln_ratio"],
        "table_8": {key: scores["table_8"][key] for key in ("cells", "exact")},
        "fit": every,
        "off": {loop: pressure_difference(folder, kind, loop) for loop in ("open", "closed")},
    }


def pressure_difference(folder: Path, kind: str, loop: str) -> float:
    """RMS difference of both pressures from pneumo's runs over the experiments of a loop, Pa."""
    squares = []
    for name, e in study(load(ROOT / "config/paper.yaml")).experiments.items():
        if e.loop == loop:
            by_pneumo, other = (xr.load_dataset(folder / k / f"{name}.nc") for k in (OWN, kind))
            squares += [float(((other[P].values - by_pneumo[P].values) ** 2).mean()) for P in ("P_A", "P_B")]
    return float(f"{np.mean(squares) ** 0.5:.3g}")


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    rows = []
    for kind in SIMULATORS:
        make_runs(folder, kind)
        rows.append(judged(folder, kind))
        print(rows[-1], flush=True)
    FILE.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
