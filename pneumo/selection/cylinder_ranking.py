"""`pneumo study`: every model replayed on the experiments of a configuration with several seeds, and ranked.

Full-order runs and replays are those of the paper's study. The first run of an experiment has the
configured seed, so that its cells equal those of `results/exact`.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from math import ceil
from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.configuration.uncertain import GROUPS, Uncertain, plant_with
from pneumo.errors import InputError
from pneumo.physics.models import MODELS, full_order_lane, lane, lane_array
from pneumo.simulation.full_order import record, thermal_time_constant
from pneumo.simulation.replay import replay
from pneumo.statistics.averages import best_n
from pneumo.statistics.error_budget import FULL_ORDER, NOTHING
from pneumo.storage.files import attributes, write
from pneumo.storage.grid_layout import replayed_grid, same_at_every_n
from pneumo.storage.layout import CHAMBERS, run_outcome

TITLE = "Reduced models on repeated runs"
DRAWS, PART_DRAWS = 64, 8  # cylinders drawn in all, and again for the part of each group
SHORTEST, DRAWN_STEP = 2.0, 4e-3  # s, of a drawn cylinder's run
POINTS_SEED = 2006  # of the scrambled points
ROWS = (*MODELS, FULL_ORDER)
LABELS = ("experiment", "cylinder", "loop", "k_0", "seed")
LONG_RUN = 10.0  # thermal time constants that a run should last: section 4's rule
DRAWN_RUN = 5.0  # the same of each of many drawn cylinders
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


def simulated_time(study: Study, uncertain: Mapping[str, Uncertain] | None = None) -> float:
    """Total simulated time of all runs of a study, s."""
    total = 0.0
    for e in study.experiments.values():
        total += e.duration * len(seeds_of(e, study.seeds))
        if uncertain:
            groups = len(uncertain[e.cylinder].groups)
            total += shortened(e).duration * (DRAWS + (2 * groups + 1) * PART_DRAWS)
    return total


def shortened(experiment: Experiment) -> Experiment:
    """Run of a drawn cylinder with a random signal: five thermal time constants, in steps of up to 4 ms.

    Steps that are not accurate are halved; without halvings the step remains.
    """
    e = experiment
    if not e.excitation.random:
        return e
    enough = max(DRAWN_RUN * thermal_time_constant(e.plant), SHORTEST)
    every = (
        min(e.excitation.every, ceil(e.excitation.every * e.h / DRAWN_STEP))
        if e.most_halvings
        else e.excitation.every
    )
    h = e.h * e.excitation.every / every
    return e._replace(
        h=h, steps=int(min(e.duration, enough) / h), excitation=e.excitation._replace(every=every)
    )


def drawn_deviations(uncertain: Uncertain, count: int) -> np.ndarray:
    """Deviations of a cylinder's quantities, shape (count, quantity), from quasi-random points."""
    from scipy.stats.qmc import MultivariateNormalQMC  # half a second

    mean = np.zeros(len(uncertain.names))
    return MultivariateNormalQMC(mean, np.array(uncertain.covariance), rng=POINTS_SEED).random(count)


def errors_on(experiment: Experiment, plant: Plant, rows: Sequence[tuple[str, float]]) -> np.ndarray:
    """Mean square errors, Pa^2, by (row, chamber), of models with the experiment's plant on a run of another.

    Rows are models at an n, then the full order. NaN for replays that fail. Signals inside a step are
    computed from the run's state with the experiment's plant.
    """
    recording = record(experiment._replace(plant=plant))._replace(plant=experiment.plant)
    gamma = experiment.plant.gas.gamma
    lanes = lane_array([lane(MODELS[model], n, gamma) for model, n in rows])
    cells = replay(recording, lanes, EXACT_SAMPLING, experiment.steps)
    mse = np.where(cells.status != 0, np.nan, cells.mse)
    full = lane_array([full_order_lane(gamma)])
    return np.vstack([mse, replay(recording, full, EXACT_SAMPLING, recording.halvings.size).mse])


def one_run(experiment: Experiment, n: tuple[float, ...], traced: bool) -> xr.Dataset:
    """Run an experiment once and replay every model at every n on it.

    The dataset has the variables of `replayed_grid` without the pressures, those of `run_outcome`, and
    `swing`, the standard deviation of the run's pressures, Pa. With `traced` it also has the first samples of
    all pressures.
    """
    recording = record(experiment)
    stride = experiment.pressure_stride if traced else experiment.steps
    cells = replayed_grid(experiment, n, recording, EXACT_SAMPLING, stride)
    pressure = cells["pressure"].isel(t=slice(TRACED_SAMPLES)).drop_vars("t").rename(t="sample")
    swing = {
        "units": "Pa",
        "long_name": "standard deviation of the pressures, root mean square of both chambers",
    }
    cells = cells.drop_vars(["pressure", "t"]).assign(
        swing=((), float(recording.states[:, [2, 4]].var(axis=0).mean() ** 0.5), swing),
        **run_outcome(recording),
    )
    if traced:
        states = recording.states[: TRACED_SAMPLES * stride : stride]
        full_order = {"units": "Pa", "long_name": "full order"}
        cells["trace_t"] = ("sample", np.arange(len(states)) * experiment.h * stride, {"units": "s"})
        cells["trace_x"] = ("sample", states[:, 0], {"units": "m", "long_name": "piston position"})
        cells["trace_P"] = (("chamber", "sample"), states[:, [2, 4]].T, full_order)
        cells["trace_pressure"] = pressure
        cells = cells.pad(sample=(0, TRACED_SAMPLES - len(states)), constant_values=np.nan, keep_attrs=True)
    return cells.assign_coords(seed=experiment.excitation.seed, chamber=CHAMBERS)


def drawn_errors(
    experiments: Sequence[Experiment],
    rows: Sequence[tuple[str, float]],
    uncertain: Uncertain,
    draws: int,
    pool: ThreadPoolExecutor,
    progress: Callable[[float], None],
) -> xr.Dataset:
    """Errors of all models on cylinders drawn from what is not known about one, each with its own seed.

    `rows` are the models, each at one n. Returns, in Pa^2, by (experiment, draw, row, chamber) `mse_drawn` of
    these and of the full order; if `draws` is `DRAWS`, by (group, experiment, part_draw, row, chamber)
    `mse_alone`, where only the quantities of one group deviate or, in the group `NOTHING`, none, and
    `mse_others`, where all but this group do; NaN for a group that is known.
    """
    deviations = drawn_deviations(uncertain, draws)

    def errors(moved: np.ndarray) -> np.ndarray:
        def work(item: tuple[Experiment, int]) -> np.ndarray:
            e, draw = item
            seeds = seeds_of(e, draws)
            plant = plant_with(e.plant, uncertain.names, moved[draw])
            mse = errors_on(e.with_seed(seeds[draw % len(seeds)]), plant, rows)
            progress(e.duration)
            return mse

        items = [(shortened(e), draw) for e in experiments for draw in range(len(moved))]
        return np.array(list(pool.map(work, items))).reshape(len(experiments), len(moved), len(ROWS), 2)

    about = {"units": "Pa2", "long_name": "mean square error on cylinders drawn from what is not known"}
    measured = [[uncertain.measured.get(name, np.nan) for name in ROWS]] * len(experiments)
    on_record = {"units": "Pa", "long_name": "RMS error on the part of a record that its fit did not see"}
    limits = ["; ".join(map(uncertain.text, uncertain.names))] * len(experiments)
    cells = xr.Dataset(
        {
            "mse_drawn": (("experiment", "draw", "row", "chamber"), errors(deviations), about),
            "measured": (("experiment", "row"), measured, on_record),
            "limits": ("experiment", limits, {"long_name": "95 % limits within which quantities are known"}),
        },
        {"chamber": CHAMBERS, "row": list(ROWS)},
    )
    if draws == DRAWS:
        all_off = deviations[:PART_DRAWS]
        alone = np.full((len(GROUPS) + 1, len(experiments), PART_DRAWS, len(ROWS), 2), np.nan)
        others = alone.copy()
        for group in uncertain.groups:
            off = uncertain.alone(group, all_off)
            alone[GROUPS.index(group)], others[GROUPS.index(group)] = errors(off), errors(all_off - off)
        alone[-1] = errors(0 * all_off)
        for name, mse, words in (("mse_alone", alone, "only"), ("mse_others", others, "all but")):
            about = about | {"long_name": f"the same if {words} the quantities of one group are off"}
            cells[name] = (("group", "experiment", "part_draw", "row", "chamber"), mse, about)
        cells = cells.assign_coords(group=[*GROUPS, NOTHING])
    return cells


def run_study(
    study: Study,
    threads: int,
    progress: Callable[[float], None] = lambda _seconds: None,
    uncertain: Mapping[str, Uncertain] | None = None,
    *,
    traced: bool = True,
    draws: int = DRAWS,
) -> xr.Dataset:
    """Run every experiment of a study with several seeds, and replay every model at every n on each run.

    An experiment whose signal is not random runs once. `uncertain` says how well each cylinder is known, from
    `uncertainties`; without it no cylinders are drawn. `progress` is called after each run with its simulated
    time, s.

    Returns the variables of `one_run` by (experiment, run, ...) and those of `drawn_errors`; with `traced`,
    pressures over time of each experiment's first run; by experiment, `time_constant`, s, and `duration`, s.
    The result does not depend on the number of threads.
    """

    def work(item: tuple[Experiment, int]) -> xr.Dataset:
        e, seed = item
        cells = one_run(e.with_seed(seed), study.n, traced and seed == e.excitation.seed)
        progress(e.duration)
        return cells

    experiments = list(study.experiments.values())
    plan = [(e, seed) for e in experiments for seed in seeds_of(e, study.seeds)]
    longest_first = sorted(plan, key=lambda item: -item[0].steps)
    drawn: dict[str, xr.Dataset] = {}
    with ThreadPoolExecutor(threads) as pool:
        done = list(zip(longest_first, pool.map(work, longest_first), strict=True))
        for cylinder in dict.fromkeys(e.cylinder for e in experiments if uncertain):
            of_cylinder = [e for e in experiments if e.cylinder == cylinder]
            runs = [cells["mse"] for (e, _), cells in done if e.cylinder == cylinder]
            mse = np.mean([run.mean("chamber", skipna=False).values for run in runs], axis=0)
            n = best_n(xr.DataArray(mse, {"model": list(MODELS), "n": list(study.n)})).fillna(study.n[0])
            rows = [(name, float(n.sel(model=name))) for name in MODELS]
            assert uncertain is not None
            cells = drawn_errors(of_cylinder, rows, uncertain[cylinder], draws, pool, progress)
            drawn |= {e.name: cells.isel(experiment=i) for i, e in enumerate(of_cylinder)}
    count = study.seeds if any(e.excitation.random for e in experiments) else 1
    parts: list[xr.Dataset] = []
    for e in experiments:
        runs = [cells for (experiment, _), cells in done if experiment is e]  # sorting keeps their order
        traces = [str(name) for name in runs[0] if str(name).startswith("trace_")]
        cells = [run.drop_vars(traces, errors="ignore") for run in runs]
        cells = cells * count if len(cells) == 1 else cells
        part = xr.concat(cells, "run", coords=["seed"], compat="equals", combine_attrs="drop_conflicts")
        part = part.assign({name: runs[0][name].drop_vars("seed") for name in traces})
        if e.name in drawn:
            part = part.merge(drawn[e.name], join="exact", combine_attrs="drop_conflicts")
        part["time_constant"] = ((), thermal_time_constant(e.plant), {"units": "s"})
        part["gamma"] = ((), e.plant.gas.gamma, {"units": "1", "long_name": "ratio of specific heats"})
        part["duration"] = ((), e.duration, {"units": "s", "long_name": "length of each run"})
        part["random"] = ((), np.int8(e.excitation.random), {"long_name": "whether the seed plays a role"})
        parts.append(part)
    return xr.concat(
        parts,
        "experiment",
        coords=list(LABELS),
        join="exact",
        compat="equals",
        combine_attrs="drop_conflicts",
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
        comment=same_at_every_n(),
        transport="exact",
        study=study.name,
    )
    write(cells, file, about)
