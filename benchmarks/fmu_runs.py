"""The paper's experiments by the full-order FMU of `pneumo export`, stepped by fmpy.

::

    python -m benchmarks.fmu_runs runs E13 E16
    pneumo paper verdict --runs runs --tool "FMU in fmpy"

Without names of experiments it runs all sixteen. The FMU is the valve with the actuator; the controller is
here, outside of it, so in closed loop the command is held between communication points, 1 ms, or with
``--every 10`` a tenth of it.
"""

import argparse
from pathlib import Path
from shutil import rmtree
from typing import Any

import fmpy
import numpy as np
import xarray as xr
from fmpy.fmi2 import FMU2Slave, fmi2Real, fmi2ValueReference

from paper.study import PAPERS
from pneumo.configuration.experiment import Drive, Experiment
from pneumo.configuration.parameters import load, study
from pneumo.equations.system import FULL_ORDER
from pneumo.export import exported, write_files
from pneumo.simulation.excitation import command, reference_series, reversed_late

OUTPUTS = ("x", "v", "P_A", "P_B", "T_A", "T_B")


class Stepped:
    """An instance of a full-order FMU with its piston, at rest."""

    def __init__(self, file: Path) -> None:
        description: Any = fmpy.read_model_description(str(file))
        references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.folder = str(fmpy.extract(str(file)))
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.u = (fmi2ValueReference * 1)(references["u"])
        self.outputs = (fmi2ValueReference * len(OUTPUTS))(*(references[name] for name in OUTPUTS))
        self.command, self.state = (fmi2Real * 1)(), (fmi2Real * len(OUTPUTS))()

    def read(self) -> Any:
        """State by `OUTPUTS`; the same array at every call."""
        self.slave.fmi2GetReal(self.slave.component, self.outputs, len(OUTPUTS), self.state)
        return self.state

    def step(self, t: float, h: float, u: float) -> None:
        """Advance from t by h, s, with the command u, V."""
        self.command[0] = u
        self.slave.fmi2SetReal(self.slave.component, self.u, 1, self.command)
        self.slave.doStep(t, h)

    def close(self) -> None:
        """Free the instance and remove its files."""
        self.slave.terminate()
        self.slave.freeInstance()
        rmtree(self.folder)


def _reversed_at(x: float, reference: float, sign: float, drive: Drive) -> tuple[float, float]:
    """Reverse the open-loop command where the piston is beyond `Drive.x_reverse` and would be driven further.

    `reference`, V, is the one drawn for the step that begins at x, m; `sign` is the sign of the sequence so
    far. Returns the reference to use and the sign of the sequence from now on. Both are returned unchanged in
    closed loop, and where `command` reverses the reference at every stage instead.
    """
    if drive.closed_loop or (drive.each_stage and not drive.toggles):
        return reference, sign
    reference *= sign
    if abs(x) < drive.x_reverse or reference * x <= 0:
        return reference, sign
    return -reference, -sign if drive.toggles else sign


def fmu_run(e: Experiment, folder: Path, every: int = 1) -> xr.Dataset:
    """Run of an experiment as `pneumo paper verdict --runs` reads it; the FMU is written into a folder."""
    file = f"{e.name}.fmu"
    write_files(exported(FULL_ORDER, None, e.plant, "fmu", stem=e.name, piston=True), folder)
    model, draws = Stepped(folder / file), reference_series(e.drive, e.excitation, e.steps)
    every = every if e.drive.closed_loop else 1  # the command of the open loop is held anyway
    states, u, sign = np.empty((e.steps + 1, len(OUTPUTS))), np.empty(e.steps + 1), 1.0
    for k, draw in enumerate(draws.tolist()):
        states[k] = model.read()
        reference, sign = _reversed_at(states[k, 0], draw, sign, e.drive)
        u[k] = command(reference, states[k, 0], e.drive)
        if k == e.steps:
            break
        model.step(k * e.h, e.h / every, u[k])
        for part in range(1, every):
            now = command(reference, model.read()[0], e.drive)
            model.step((k + part / every) * e.h, e.h / every, now)
    model.close()
    late = e.drive.late and not e.drive.closed_loop  # how the paper's recorded command shows reversals
    columns = {name: ("t", values) for name, values in zip(OUTPUTS, states.T, strict=True)}
    columns["u"] = "t", reversed_late(u, draws, e.drive.late) if late else u
    return xr.Dataset(columns, {"t": np.arange(e.steps + 1) * e.h})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("experiments", nargs="*")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="communication points in 1 ms")
    given = parser.parse_args()
    given.folder.mkdir(exist_ok=True)
    experiments = study(load(PAPERS.parent / "config/paper.yaml")).experiments
    for name in given.experiments or experiments:
        fmu_run(experiments[name], given.folder, given.every).to_netcdf(given.folder / f"{name}.nc")
        (given.folder / f"{name}.fmu").unlink()
        print(name, flush=True)
