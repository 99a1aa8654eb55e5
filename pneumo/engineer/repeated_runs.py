"""Every model on one experiment several times over, each time with another seed: what `pneumo study` runs.

Full-order run and replay are those of the paper's study; the first run has the configuration's own seed, so
its cells are those of `results/exact`.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.physics.models import MODELS, Lane, lane, lane_array
from pneumo.simulation.cells import grid_lanes, replay_dataset, replayed
from pneumo.simulation.full_order import RAN, RUN_STATUS, Recording, failure, record
from pneumo.simulation.reference import EXACT
from pneumo.simulation.settling import thermal_time_constant
from pneumo.storage.layout import CHAMBERS, flags

K_0_FACTORS = (0.5, 2.0)  # the reduced models' k_0 over the cylinder's: what an estimate may be off by
WITH_WALL = [name for name, model in MODELS.items() if model.wall != "none"]
TRACED = 500  # samples of the first run that are kept, at the experiment's stride


def seeds_of(experiment: Experiment, count: int) -> list[int]:
    """Seeds of an experiment's runs: its own, then others drawn from it; one where the signal is not random.

    Neighbouring seeds will not do: the generator's states for 1, 2, 3 are multiples of one another.
    """
    if not experiment.excitation.random:
        return [experiment.excitation.seed]
    own = experiment.excitation.seed
    return [own, *np.random.SeedSequence(own).generate_state(count - 1).tolist()]


def wall_lanes(n: tuple[float, ...], gamma: float, factor: float) -> np.ndarray:
    """Lanes of the models with explicit wall heat, model by model, with a factor on their k_0."""

    def scaled(row: Lane) -> Lane:
        return row._replace(explicit_heat=factor * row.explicit_heat)

    return lane_array([scaled(lane(MODELS[name], value, gamma)) for name in WITH_WALL for value in n])


def _mse_of_wrong_k_0(experiment: Experiment, n: tuple[float, ...], recording: Recording) -> np.ndarray:
    """Mean square error by (factor, model, n, chamber); models without explicit wall heat have NaN."""
    found = np.full((len(K_0_FACTORS), len(MODELS), len(n), 2), np.nan)
    names = list(MODELS)
    for i, factor in enumerate(K_0_FACTORS):
        lanes = wall_lanes(n, experiment.plant.gas.gamma, factor)
        cells = replayed(experiment, lanes, recording, transport=EXACT, stride=experiment.steps)
        mse = np.where(cells.status != 0, np.nan, cells.mse)
        found[i, [names.index(name) for name in WITH_WALL]] = mse.reshape(len(WITH_WALL), len(n), 2)
    return found


def one_run(experiment: Experiment, n: tuple[float, ...], traced: bool) -> xr.Dataset:
    """Full-order run and replays of the whole grid with one seed.

    Parameters
    ----------
    experiment : Experiment
    n : tuple of float
        Polytropic indices of the grid.
    traced : bool
        Whether the first samples of every pressure are kept as well.

    Returns
    -------
    xarray.Dataset
        What `replay_dataset` has, without the pressures; `run_status` and `run_failure_time`;
        `mse_of_wrong_k_0` by (k_0_factor, model, n, chamber).
    """
    recording = record(experiment)
    lanes, index = grid_lanes(n, experiment.plant.gas.gamma)
    stride = experiment.pressure_stride
    found = replayed(experiment, lanes, recording, transport=EXACT, stride=stride)
    cells = replay_dataset(experiment, n, index, found)
    pressure = cells["pressure"].isel(t=slice(TRACED)).drop_vars("t").rename(t="sample")
    cells = cells.drop_vars(["pressure", "t"])
    cells["mse_of_wrong_k_0"] = (
        ("k_0_factor", "model", "n", "chamber"),
        _mse_of_wrong_k_0(experiment, n, recording),
    )
    status, step = failure(recording.states)
    cells["run_status"] = ((), np.int8(status), flags(RUN_STATUS, "what became of the full-order run"))
    failure_time = step * experiment.h if status != RAN else np.nan
    cells["run_failure_time"] = ((), failure_time, {"units": "s", "long_name": "when it failed"})
    if traced:
        shown = recording.states[: TRACED * stride : stride]
        cells["trace_t"] = ("sample", np.arange(len(shown)) * experiment.h * stride, {"units": "s"})
        cells["trace_x"] = ("sample", shown[:, 0], {"units": "m", "long_name": "piston position"})
        cells["trace_P"] = (
            ("chamber", "sample"),
            shown[:, [2, 4]].T,
            {"units": "Pa", "long_name": "full order"},
        )
        cells["trace_pressure"] = pressure
        cells = cells.pad(sample=(0, TRACED - len(shown)), constant_values=np.nan, keep_attrs=True)
    return cells.assign_coords(
        k_0_factor=list(K_0_FACTORS), seed=experiment.excitation.seed, chamber=CHAMBERS
    )


def repeated(
    experiments: Sequence[Experiment],
    n: tuple[float, ...],
    seeds: int,
    threads: int,
    tell: Callable[[float], None] = lambda seconds: None,
) -> xr.Dataset:
    """Run every experiment with several seeds.

    Parameters
    ----------
    experiments : sequence of Experiment
    n : tuple of float
        Polytropic indices of the grid.
    seeds : int
        Runs of each experiment; one, which counts for all, where its signal is not random.
    threads : int
        The result does not depend on it.
    tell : callable
        Called after each run with the time that it simulated, s.

    Returns
    -------
    xarray.Dataset
        The variables of `one_run` by (experiment, run, ...); traces of each experiment's first run.
        `time_constant`, s, and `duration`, s, by experiment.
    """

    def work(item: tuple[Experiment, int, bool]) -> xr.Dataset:
        experiment, seed, first = item
        excitation = experiment.excitation._replace(seed=seed)
        found = one_run(experiment._replace(excitation=excitation), n, first)
        tell(experiment.steps * experiment.h)
        return found

    plan = [(e, seed, i == 0) for e in experiments for i, seed in enumerate(seeds_of(e, seeds))]
    longest_first = sorted(range(len(plan)), key=lambda i: -plan[i][0].steps)
    with ThreadPoolExecutor(threads) as pool:
        done = list(pool.map(work, [plan[i] for i in longest_first]))
    by_plan = dict(zip(longest_first, done, strict=True))
    runs = seeds if any(e.excitation.random for e in experiments) else 1
    parts: list[xr.Dataset] = []
    for e in experiments:
        own = [by_plan[i] for i, item in enumerate(plan) if item[0] is e]
        traces = [str(name) for name in own[0] if str(name).startswith("trace_")]
        cells = [part.drop_vars(traces, errors="ignore") for part in own]
        cells = cells * runs if len(cells) == 1 else cells
        part = xr.concat(cells, "run", coords=["seed"], compat="equals", combine_attrs="drop_conflicts")
        part = part.assign({name: own[0][name].drop_vars("seed") for name in traces})
        part["time_constant"] = ((), thermal_time_constant(e.plant), {"units": "s"})
        part["duration"] = ((), e.steps * e.h, {"units": "s", "long_name": "length of each run"})
        part["random"] = ((), np.int8(e.excitation.random), {"long_name": "whether the seed plays a role"})
        parts.append(part)
    labels = ["experiment", "cylinder", "loop", "k_0", "seed"]
    return xr.concat(
        parts, "experiment", coords=labels, join="exact", compat="equals", combine_attrs="drop_conflicts"
    )
