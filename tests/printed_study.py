"""A results folder in which everything came out as the paper prints it, for tests of the verdict.

Statistics and settling times are the published tables and figures; runs and cells are small inventions that
make the statements true which Tables 5 to 9 don't settle.
"""

from pathlib import Path

import numpy as np
import xarray as xr
from paper_study import STUDY

from paper.study.paper_2006.printed_tables import PAPER_FOLDER, table5
from paper.study.paper_2006.results import PrintedTables
from paper.study.stored_runs import to_json
from paper_verdict.files import read_cells
from pneumo.physics.models import MODELS, lane
from pneumo.storage.files import write, write_text
from pneumo.storage.layout import experiment_labels

CHAMBERS = ["A", "B"]


def save(dataset: xr.Dataset, file: Path) -> None:
    write(dataset, file, {})


def write_printed_study(folder: Path) -> Path:
    """Write the folder and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(to_json(STUDY), folder / "parameters.json")
    statistics = PrintedTables(folder).statistics
    statistics["experiments"] = ("level", [16, 8, 8, 8])
    statistics["failure_time"] = ("experiment", [np.nan] * 16)
    settling = table5().drop_vars(["printed", "half_unit"]).to_dataset(name="settling_time")
    settling["failure_time"] = ("experiment", [np.nan] * 16)
    save(settling, folder / "settling.nc")
    for name in ("published/replay", "exact/replay", "settling", "datum"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for transport in ("published", "exact"):
        save(statistics, folder / transport / "statistics.nc")
    for name, experiment in STUDY.experiments.items():
        labels = experiment_labels(experiment)
        cells = _cells(STUDY.n, int(name[1:])).assign_coords(labels)
        for transport in ("published", "exact"):
            save(cells, folder / transport / "replay" / f"{name}.nc")
        settled = _run_of_fig_7() if name == "E14" else _settling_run()
        save(settled.assign_coords(labels), folder / "settling" / f"{name}.nc")
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
                row = row._replace(mixing=0.0, wall_scale=0.0, e_A=0.0, e_PT=0.0)
            distance = np.dot([3.0, 2.0, 1.0], [1.4 - row.n_V, 1.4 - row.n_in, 1.4 - row.n_out])
            processes = row.mixing * (number % 3 - 1) + row.wall_scale + 0.1 * row.e_A + 0.1 * row.e_PT
            mse[i, j] = 1e7 * (1 + distance + (1.4 - value) * bool(row.a)) / (2 + processes)
    zero, names = 0.0 * mse, ("model", "n", "chamber")
    arrays = {"mean_error": zero, "variance": mse, "mse": mse, "failure_time": zero * np.nan}
    arrays["status"] = zero.astype(np.int8)
    cells = xr.Dataset({name: (names, values) for name, values in arrays.items()})
    cells["pressure"] = ((*names, "t"), zero[..., np.newaxis].astype(np.float32))
    return cells.assign_coords(model=list(MODELS), n=list(n), chamber=CHAMBERS, t=[0.0])


def _traces(t: list[float], P: np.ndarray, T: np.ndarray, **others: np.ndarray) -> xr.Dataset:
    """A run of three samples; pressures and temperatures by sample, or by sample and chamber."""
    both = {name: (("t", "chamber"), np.broadcast_to(a, (3, 2))) for name, a in (("P", P), ("T", T))}
    variables = {name: ("t", values) for name, values in others.items()}
    return xr.Dataset(both | variables, coords={"t": t, "chamber": CHAMBERS})


def _settling_run() -> xr.Dataset:
    """Released at 1.267 s, and then at Fig. 7's final values throughout."""
    P, T = np.array([5.276e5, 5.294e5]), np.array([292.93, 293.12])
    return _traces([0.0, 1.267, 2.0], P, T, x=np.zeros(3)).assign(release_time=1.267)


def _run_of_fig_7() -> xr.Dataset:
    """Straight lines from one extremum of Fig. 7 to the next, then to its final values."""
    final = {"x": 0.0, "P_A": 5.276e5, "P_B": 5.294e5, "T_A": 292.93, "T_B": 293.12}
    printed = read_cells("figure7", PAPER_FOLDER)
    cells = {(c["row"], c["column"], c["order"]): float(c["printed"]) for c in printed}
    orders = [str(order) for order in range(1, 9)]
    times = {name: [0.0, *(cells[name, "time", order] for order in orders), 0.6, 1.3] for name in final}
    t = np.unique(np.concatenate(list(times.values())))
    traces = {
        name: np.interp(t, times[name], [end, *(cells[name, "value", order] for order in orders), end, end])
        for name, end in final.items()
    }
    both = {q: (("t", "chamber"), np.stack([traces[f"{q}_A"], traces[f"{q}_B"]], axis=1)) for q in "PT"}
    run = xr.Dataset(both | {"x": ("t", traces["x"])}, coords={"t": 1.267 + t, "chamber": CHAMBERS})
    return run.assign(release_time=1.267)


def _datum(x_max: float) -> xr.Dataset:
    """The swings of section 1, within 96 % of the half-stroke."""
    P = 0.8077 * 7e5 + np.array([[0.0], [1.5e5], [-1.5e5]])
    T = 293.0 + np.array([[0.0], [20.0], [-30.0]])
    return _traces([0.0, 1.0, 2.0], P, T, x=0.96 * x_max * np.array([0.0, 1.0, -1.0]), v=np.zeros(3))
