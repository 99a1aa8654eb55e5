"""`pneumo study`: every model replayed on the experiments of a configuration with several seeds, and ranked.

Full-order runs and replays are those of the paper's study. The first run of an experiment has the
configured seed, so that its cells equal those of `results/exact`.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.configuration.known_within import KnownWithin
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.errors import InputError
from pneumo.hashing import code_hash
from pneumo.physics.models import MODELS, full_order_lane, lane, lane_array
from pneumo.simulation.full_order import record
from pneumo.simulation.replay import full_order_mse, replay
from pneumo.simulation.settling import thermal_time_constant
from pneumo.storage.files import attributes, write
from pneumo.storage.grid_layout import replayed_grid, same_at_every_n
from pneumo.storage.layout import CHAMBERS, run_outcome

TITLE = "Reduced models on repeated runs"
K_0_ENDS = ("low", "high")  # of the range within which the cylinder's k_0 is known
CORNERS = tuple(itertools.product((-1, 1), repeat=3))  # ends of the ranges of k_0, valve, dead volumes
OFF_PLANTS = tuple(
    ", ".join(
        f"{name} {'low' if end < 0 else 'high'}"
        for name, end in zip(("k_0", "valve", "V_d"), ends, strict=True)
    )
    for ends in CORNERS
)
TRACED_SAMPLES = 500  # samples of the first run that are kept, at the experiment's stride


def selected(study: Study, cylinders: Sequence[str] = (), experiments: Sequence[str] = ()) -> Study:
    """Part of a study: the named experiments of the named cylinders; without names, all of them.

    `InputError` if a name is unknown, or none of the experiments is on one of the cylinders.
    """
    known_cylinders = {e.cylinder for e in study.experiments.values()}
    kinds = ("cylinder", cylinders, known_cylinders), ("experiment", experiments, set(study.experiments))
    for kind, wanted, names in kinds:
        for name in wanted:
            if name not in names:
                known = ", ".join(sorted(names)[:20])
                raise InputError(f"{kind} = {name[:50]!r}: no such {kind} in this study; there are {known}")
    remaining = {
        name: e
        for name, e in study.experiments.items()
        if (not cylinders or e.cylinder in cylinders) and (not experiments or name in experiments)
    }
    if not remaining:
        raise InputError(
            "--cylinder, --experiment: none of the named experiments has one of the named cylinders"
        )
    return study._replace(experiments=remaining)


def seeds_of(experiment: Experiment, count: int) -> list[int]:
    """Random seeds of an experiment's `count` runs: the configured one, then others derived from it.

    A single seed if the signal is not random. Consecutive seeds are avoided: for seeds 1, 2, 3 the states
    of the generator are multiples of one another.
    """
    first = experiment.excitation.seed
    if not experiment.excitation.random:
        return [first]
    return [first, *np.random.SeedSequence(first).generate_state(count - 1).tolist()]


def simulated_time(study: Study) -> float:
    """Total simulated time of all runs of a study, s."""
    return sum(e.duration * len(seeds_of(e, study.seeds)) for e in study.experiments.values())


def mse_at_other_k_0(
    experiment: Experiment, n: tuple[float, ...], ratio: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean square errors, Pa^2, if the cylinder's true k_0 is `ratio` times the experiment's.

    Returns three arrays: by (model, n, chamber) the errors of models that use the experiment's k_0, then
    those of models that use the true one; by (chamber) the error of the full order with the experiment's
    k_0. NaN for replays that fail.
    """
    gamma = experiment.plant.gas.gamma
    recording = record(experiment._replace(plant=experiment.plant._replace(k_0=ratio * experiment.plant.k_0)))
    right = [lane(model, value, gamma) for model in MODELS.values() for value in n]
    wrong = [row._replace(wall_scale=row.wall_scale / ratio) for row in right]
    cells = replay(recording, lane_array([*wrong, *right]), EXACT_SAMPLING, experiment.steps)
    mse = np.where(cells.status != 0, np.nan, cells.mse).reshape(2, len(MODELS), len(n), 2)
    full = full_order_mse(recording, [full_order_lane(gamma, 1 / ratio)], EXACT_SAMPLING)[0]
    return mse[0], mse[1], full


def off_plants(plant: Plant, known: KnownWithin) -> list[Plant]:
    """Plants whose k_0, valve and dead volumes are each at an end of the range in which they are known.

    In the order of `OFF_PLANTS`. Plants are equal where a range is a single value.
    """
    valve, cylinder = plant.valve, plant.cylinder

    def at(k_0_end: int, valve_end: int, volume_end: int) -> Plant:
        volume = 1 + volume_end * known.dead_volumes
        return plant._replace(
            k_0=plant.k_0 * known.k_0_factor**k_0_end,
            valve=valve._replace(k_xu=valve.k_xu * (1 + valve_end * known.valve)),
            cylinder=cylinder._replace(V_d_A=volume * cylinder.V_d_A, V_d_B=volume * cylinder.V_d_B),
        )

    return [at(*ends) for ends in CORNERS]


def mse_on_other_plant(
    experiment: Experiment, n: tuple[float, ...], plant: Plant
) -> tuple[np.ndarray, np.ndarray]:
    """Mean square errors, Pa^2, of models that take the experiment's plant where the cylinder is `plant`.

    Returns those of the reduced models by (model, n, chamber) and of the full order by (chamber). NaN for
    replays that fail. Signals inside a step are computed from the run's state with the experiment's plant.
    """
    recording = record(experiment._replace(plant=plant))._replace(plant=experiment.plant)
    lanes = [lane(model, value, experiment.plant.gas.gamma) for model in MODELS.values() for value in n]
    cells = replay(recording, lane_array(lanes), EXACT_SAMPLING, experiment.steps)
    mse = np.where(cells.status != 0, np.nan, cells.mse).reshape(len(MODELS), len(n), 2)
    return mse, full_order_mse(recording, [full_order_lane(experiment.plant.gas.gamma)], EXACT_SAMPLING)[0]


def one_run(
    experiment: Experiment, n: tuple[float, ...], traced: bool, known: KnownWithin | None = None
) -> xr.Dataset:
    """Run an experiment once and replay every model at every n on it.

    The dataset has the variables of `replayed_grid` without the pressures, those of `run_outcome`, and
    `swing`, the standard deviation of the run's pressures, Pa. Two further runs, with k_0 divided by and
    times its factor in `known`, give by (k_0_end, model, n, chamber) `mse_of_wrong_k_0` of models with the
    configured k_0 and `mse_of_right_k_0` of models with that of the run; by (k_0_end, chamber),
    `mse_of_full_order` with the configured k_0; all in Pa^2. Where valve or dead volumes are not known
    exactly, runs with every combination of the ends of all three ranges give `mse_of_off_plant` and
    `mse_of_full_order_off_plant` in the same way, by `off_plant`. With `traced` it also has the first samples
    of all pressures.
    """
    recording = record(experiment)
    stride = experiment.pressure_stride if traced else experiment.steps
    cells = replayed_grid(experiment, n, recording, EXACT_SAMPLING, stride)
    pressure = cells["pressure"].isel(t=slice(TRACED_SAMPLES)).drop_vars("t").rename(t="sample")
    known = known or KnownWithin()
    ends = [mse_at_other_k_0(experiment, n, ratio) for ratio in (1 / known.k_0_factor, known.k_0_factor)]
    wrong, right, full = (np.stack(arrays) for arrays in zip(*ends, strict=True))
    dims = ("k_0_end", "model", "n", "chamber")
    about = {"units": "Pa2", "long_name": "mean square error where the cylinder's k_0 is at the end"}
    swing = {
        "units": "Pa",
        "long_name": "standard deviation of the pressures, root mean square of both chambers",
    }
    cells = cells.drop_vars(["pressure", "t"]).assign(
        mse_of_wrong_k_0=(dims, wrong, about | {"comment": "the models take the configured k_0"}),
        mse_of_right_k_0=(dims, right, about | {"comment": "the models take the cylinder's k_0"}),
        mse_of_full_order=(("k_0_end", "chamber"), full, about | {"comment": "by the full order"}),
        swing=((), float(recording.states[:, [2, 4]].var(axis=0).mean() ** 0.5), swing),
        **run_outcome(recording),
    )
    if known.valve or known.dead_volumes:
        plants = off_plants(experiment.plant, known)
        off = {plant: mse_on_other_plant(experiment, n, plant) for plant in dict.fromkeys(plants)}
        reduced, full_order = (np.stack(arrays) for arrays in zip(*map(off.get, plants), strict=True))
        about |= {"long_name": "mean square error where the cylinder's k_0, valve and dead volumes are off"}
        cells["mse_of_off_plant"] = (("off_plant", *dims[1:]), reduced, about)
        cells["mse_of_full_order_off_plant"] = (("off_plant", "chamber"), full_order, about)
        cells = cells.assign_coords(off_plant=list(OFF_PLANTS))
    if traced:
        states = recording.states[: TRACED_SAMPLES * stride : stride]
        full_order = {"units": "Pa", "long_name": "full order"}
        cells["trace_t"] = ("sample", np.arange(len(states)) * experiment.h * stride, {"units": "s"})
        cells["trace_x"] = ("sample", states[:, 0], {"units": "m", "long_name": "piston position"})
        cells["trace_P"] = (("chamber", "sample"), states[:, [2, 4]].T, full_order)
        cells["trace_pressure"] = pressure
        cells = cells.pad(sample=(0, TRACED_SAMPLES - len(states)), constant_values=np.nan, keep_attrs=True)
    seed = experiment.excitation.seed
    return cells.assign_coords(k_0_end=list(K_0_ENDS), seed=seed, chamber=CHAMBERS)


def run_study(
    study: Study,
    threads: int,
    progress: Callable[[float], None] = lambda _seconds: None,
    known: Mapping[str, KnownWithin] | None = None,
    *,
    traced: bool = True,
) -> xr.Dataset:
    """Run every experiment of a study with several seeds, and replay every model at every n on each run.

    An experiment whose signal is not random runs once. `known` has the limits within which each cylinder is
    known, from `known_within`; other cylinders get the defaults of `KnownWithin`. `progress` is called after
    each run with its simulated time, s.

    Returns the variables of `one_run` by (experiment, run, ...); with `traced`, pressures over time of each
    experiment's first run; by experiment, the limits, `time_constant`, s, and `duration`, s. The result
    does not depend on the number of threads.
    """

    def limits(e: Experiment) -> KnownWithin:
        return (known or {}).get(e.cylinder, KnownWithin())

    def work(item: tuple[Experiment, int]) -> xr.Dataset:
        e, seed = item
        first = seed == e.excitation.seed
        cells = one_run(e.with_seed(seed), study.n, traced and first, limits(e))
        progress(e.duration)
        return cells

    experiments = list(study.experiments.values())
    plan = [(e, seed) for e in experiments for seed in seeds_of(e, study.seeds)]
    longest_first = sorted(plan, key=lambda item: -item[0].steps)
    with ThreadPoolExecutor(threads) as pool:
        done = list(zip(longest_first, pool.map(work, longest_first), strict=True))
    count = study.seeds if any(e.excitation.random for e in experiments) else 1
    parts: list[xr.Dataset] = []
    for e in experiments:
        runs = [cells for (experiment, _), cells in done if experiment is e]  # sorting keeps their order
        traces = [str(name) for name in runs[0] if str(name).startswith("trace_")]
        cells = [run.drop_vars(traces, errors="ignore") for run in runs]
        cells = cells * count if len(cells) == 1 else cells
        part = xr.concat(cells, "run", coords=["seed"], compat="equals", combine_attrs="drop_conflicts")
        part = part.assign({name: runs[0][name].drop_vars("seed") for name in traces})
        part["k_0_factor"] = ((), limits(e).k_0_factor, {"long_name": "k_0 is known within this factor"})
        part["valve_within"] = ((), limits(e).valve, {"long_name": "largest relative error of the valve"})
        within = {"long_name": "largest relative error of the dead volumes"}
        part["dead_volumes_within"] = ((), limits(e).dead_volumes, within)
        part["time_constant"] = ((), thermal_time_constant(e.plant), {"units": "s"})
        part["gamma"] = ((), e.plant.gas.gamma, {"units": "1", "long_name": "ratio of specific heats"})
        part["duration"] = ((), e.duration, {"units": "s", "long_name": "length of each run"})
        part["random"] = ((), np.int8(e.excitation.random), {"long_name": "whether the seed plays a role"})
        parts.append(part)
    labels = ["experiment", "cylinder", "loop", "k_0", "seed"]
    return xr.concat(
        parts, "experiment", coords=labels, join="exact", compat="equals", combine_attrs="drop_conflicts"
    )


def joined(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Join results of `run_study` for several cylinders; a single run is repeated where others have more."""
    runs = max(part.sizes["run"] for part in parts)
    parts = [part.isel(run=[0] * runs) if part.sizes["run"] == 1 else part for part in parts]
    return xr.concat(parts, "experiment", join="exact", compat="equals", combine_attrs="drop_conflicts")


def save_cells(study: Study, cells: xr.Dataset, file: Path) -> None:
    """Write the result of `run_study` to a NetCDF file."""
    about = attributes(
        TITLE,
        "Error of every model at every n against full-order runs, over several seeds",
        study.config_sha256,
        code_hash(__name__),
        comment=same_at_every_n(),
        transport="exact",
        study=study.name,
    )
    write(cells, file, about)
