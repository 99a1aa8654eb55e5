"""A results folder in which everything came out as the paper prints it, for tests of the verdict.

Statistics and settling times are the published tables; runs and cells are small inventions that make the
statements true which Tables 5 to 9 don't settle.
"""

from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.configuration.parameters import load, study
from pneumo.configuration.study_json import to_json
from pneumo.physics.models import MODELS, lane
from pneumo.storage.files import write, write_json
from pneumo.storage.layout import experiment_labels
from pneumo.verdict.published import table5
from pneumo.verdict.sources import PrintedTables

CONFIG = Path(__file__).parents[1] / "config" / "paper.yaml"
CHAMBERS = ["A", "B"]


def save(dataset: xr.Dataset, file: Path) -> None:
    write(dataset, file, {})


def write_printed_study(folder: Path) -> Path:
    """Write the folder and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    paper = study(load(CONFIG))
    write_json(to_json(paper), folder / "parameters.json")
    statistics = PrintedTables(folder).statistics
    statistics["experiments"] = ("level", [16, 8, 8, 8])
    statistics["failure_time"] = ("experiment", [np.nan] * 16)
    statistics["constant_n"] = xr.full_like(statistics["mse"], 1.35)
    settling = table5().drop_vars(["printed", "half_unit"]).to_dataset(name="settling_time")
    settling["failure_time"] = ("experiment", [np.nan] * 16)
    save(settling, folder / "settling.nc")
    for name in ("published/replay", "exact/replay", "settling", "datum"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for transport in ("published", "exact"):
        save(statistics, folder / transport / "statistics.nc")
    for name, experiment in paper.experiments.items():
        labels = experiment_labels(experiment)
        cells = _cells(paper.n, int(name[1:])).assign_coords(labels)
        for transport in ("published", "exact"):
            save(cells, folder / transport / "replay" / f"{name}.nc")
        save(_settling_run().assign_coords(labels), folder / "settling" / f"{name}.nc")
        datum = _datum(experiment.plant.cylinder.x_max).assign_coords(labels)
        save(datum, folder / "datum" / f"{name}.nc")
    return folder


def _cells(n: tuple[float, ...], number: int) -> xr.Dataset:
    """Errors that depend on what a model computes, so that equal models have equal errors."""
    mse = np.empty((len(MODELS), len(n), 2))
    for i, model in enumerate(MODELS.values()):
        for j, value in enumerate(n):
            row = lane(model, value, 1.4)
            if row.a == 0:  # constant temperature: no mixing, no wall heat
                row = row._replace(mixing=0.0, explicit_heat=0.0, e_A=0.0, e_PT=0.0)
            distance = np.dot([3.0, 2.0, 1.0], [1.4 - row.n_V, 1.4 - row.n_in, 1.4 - row.n_out])
            processes = row.mixing * (number % 3 - 1) + row.explicit_heat + 0.1 * row.e_A + 0.1 * row.e_PT
            mse[i, j] = 1e7 * (1 + distance + (1.4 - value) * bool(row.a)) / (2 + processes)
    names = ("model", "n", "chamber")
    return xr.Dataset(
        {
            "mean_error": (names, 0.0 * mse),
            "variance": (names, mse),
            "mse": (names, mse),
            "status": (names, np.zeros(mse.shape, dtype=np.int8)),
            "failure_time": (names, np.full(mse.shape, np.nan)),
            "pressure": ((*names, "t"), np.zeros((*mse.shape, 1), dtype=np.float32)),
        },
        coords={"model": list(MODELS), "n": list(n), "chamber": CHAMBERS, "t": [0.0]},
    )


def _settling_run() -> xr.Dataset:
    """Released at 1.267 s, and then at Fig. 7's final values throughout."""
    t = np.array([0.0, 1.267, 2.0])
    both = np.ones((3, 2))
    return xr.Dataset(
        {
            "x": ("t", 0.0 * t),
            "P": (("t", "chamber"), both * [5.276e5, 5.294e5]),
            "T": (("t", "chamber"), both * [292.93, 293.12]),
            "release_time": ((), 1.267),
        },
        coords={"t": t, "chamber": CHAMBERS},
    )


def _datum(x_max: float) -> xr.Dataset:
    """The swings of section 1, within 96 % of the half-stroke."""
    P_0, T_amb = 0.8077 * 7e5, 293.0
    t = np.array([0.0, 1.0, 2.0])
    both = np.ones((3, 2))
    return xr.Dataset(
        {
            "x": ("t", 0.96 * x_max * np.array([0.0, 1.0, -1.0])),
            "v": ("t", 0.0 * t),
            "P": (("t", "chamber"), both * (P_0 + np.array([[0.0], [1.5e5], [-1.5e5]]))),
            "T": (("t", "chamber"), both * (T_amb + np.array([[0.0], [20.0], [-30.0]]))),
        },
        coords={"t": t, "chamber": CHAMBERS},
    )
