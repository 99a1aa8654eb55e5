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

from pneumo.configuration.experiment import Drive, Experiment, Plant, Study
from pneumo.configuration.priors import Uncertain, plant_with
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.errors import InputError, shown
from pneumo.physics.models import MODELS, full_order_lane, lane, lane_array
from pneumo.quantities.table import GROUPS
from pneumo.selection.error_budget import FULL_ORDER, NOTHING
from pneumo.simulation.full_order import Recording, record, recorded, thermal_time_constant
from pneumo.simulation.replay import replay
from pneumo.statistics.best_n import best_n
from pneumo.storage.files import attributes, write
from pneumo.storage.layout import CHAMBERS, replayed_grid, run_outcome, same_at_every_n

TITLE = "Reduced models on repeated runs"
DRAWS, PART_DRAWS = 64, 8  # cylinders drawn in all, and again for the part of each group
SHORTEST, DRAWN_STEP = 2.0, 4e-3  # s, of a drawn cylinder's run
# Of a standard normal distribution: SciPy's MultivariateNormalQMC(np.zeros(9), rng=2006).random(64)
POINTS = Path(__file__).with_name("points.csv")
ROWS = (*MODELS, FULL_ORDER)
LABELS = ("experiment", "cylinder", "loop", "k_0", "seed")
REST = 3.0  # s, after a stroke
LONG_RUN = 10.0  # thermal time constants that a run should last: section 4's rule
DRAWN_RUN = 5.0  # the same of each of many drawn cylinders


def selected(study: Study, cylinders: Sequence[str] = (), experiments: Sequence[str] = ()) -> Study:
    """Part of a study: the named experiments of the named cylinders; without names, all of them.

    `InputError` if a name is unknown, or none of the experiments is on one of the cylinders.
    """
    kinds = ("cylinder", cylinders, {e.cylinder for e in study.experiments.values()})
    for kind, wanted, names in (kinds, ("experiment", experiments, set(study.experiments))):
        known = sorted(names)
        for name in (name for name in wanted if name not in known):
            there = ", ".join(known[:20])
            raise InputError(f"{kind} = {shown(name)}: no such {kind} in this study; there are {there}")
    remaining = {
        name: e
        for name, e in study.experiments.items()
        if (not cylinders or e.cylinder in cylinders) and (not experiments or name in experiments)
    }
    if not remaining:
        problem = "none of the named experiments has one of the named cylinders"
        raise InputError(f"--cylinder, --experiment: {problem}")
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
            runs = DRAWS + (2 * len(uncertain[e.cylinder].groups) + 1) * PART_DRAWS
            total += shortened(e).duration * runs
    return total


def shortened(experiment: Experiment) -> Experiment:
    """Run of a drawn cylinder with a random signal: five thermal time constants, in steps of up to 4 ms.

    Steps that are not accurate are halved; without halvings the step remains.
    """
    e = experiment
    if not e.excitation.random:
        return e
    enough = max(DRAWN_RUN * thermal_time_constant(e.plant), SHORTEST)
    every = e.excitation.every
    if e.most_halvings:
        every = min(every, ceil(every * e.h / DRAWN_STEP))
    h = e.h * e.excitation.every / every
    return e._replace(
        h=h, steps=int(min(e.duration, enough) / h), excitation=e.excitation._replace(every=every)
    )


def drawn_deviations(uncertain: Uncertain, count: int) -> np.ndarray:
    """Deviations of a cylinder's quantities, shape (count, quantity), from the first `POINTS`."""
    covariance = np.array(uncertain.covariance)
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:  # singular
        squares, axes = np.linalg.eigh(covariance)
        root = axes * np.sqrt(squares.clip(min=0.0))
    return np.loadtxt(POINTS, delimiter=",")[:count, : len(root)] @ root.T


def errors_on(experiment: Experiment, plant: Plant, rows: Sequence[tuple[str, float]]) -> np.ndarray:
    """Mean square errors, Pa^2, by (row, chamber), of models with the experiment's plant on a run of another.

    Rows are models at an n, then the full order. NaN for replays that fail. Signals inside a step are
    computed from the run's state with the experiment's plant.
    """
    return _errors(record(experiment._replace(plant=plant)), experiment.plant, rows)


def _errors(recording: Recording, plant: Plant, rows: Sequence[tuple[str, float]]) -> np.ndarray:
    """Mean square errors, as of `errors_on`, of models with a plant on a recording of another one."""
    recording, gamma = recording._replace(plant=plant), plant.gas.gamma
    lanes = [lane(MODELS[model], n, gamma) for model, n in rows] + [full_order_lane(gamma, plant.wall)]
    cells = replay(recording, lane_array(lanes), EXACT_SAMPLING, len(recording.u) - 1)
    return np.where(cells.status != 0, np.nan, cells.mse)


def stroke_errors(experiment: Experiment, plant: Plant, rows: Sequence[tuple[str, float]]) -> np.ndarray:
    """Errors as of `errors_on` over a full stroke from vented into rest, as `pneumo simulate` makes it.

    The valve is fully open for three times the duration of a stroke and 1 s more, at most for that of the
    experiment, then shut for `REST`.
    """
    c = plant.conditions
    h = experiment.h
    configured = experiment.plant
    opened = min(1.0 + 3 * configured.cylinder.stroke / max(configured.speed, 1e-9), experiment.duration)
    u = np.zeros(1 + round((opened + REST) / h))
    u[: round(opened / h)] = plant.valve.u_max
    start = np.array([plant.cylinder.x_min, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb])
    given = experiment._replace(plant=plant, drive=Drive(False, 0.0, np.inf))
    return _errors(recorded(given, u, start), configured, rows)


def one_run(experiment: Experiment, n: tuple[float, ...]) -> xr.Dataset:
    """Run an experiment once and replay every model at every n on it.

    The dataset has the variables of `replayed_grid` without the pressures, those of `run_outcome`, and
    `swing`, the standard deviation of the run's pressures, Pa.
    """
    recording = record(experiment)
    cells = replayed_grid(experiment, n, recording, EXACT_SAMPLING, experiment.steps)
    about = "standard deviation of the pressures, root mean square of both chambers"
    swing = float(recording.states[:, [2, 4]].var(axis=0).mean() ** 0.5)
    cells = cells.drop_vars(["pressure", "t"]).assign(**run_outcome(recording))
    cells["swing"] = ((), swing, {"units": "Pa", "long_name": about})
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
    `mse_others`, where all but this group do; NaN for a group that is known; and `mse_stroke`, of the first
    experiment's plant over full strokes into rest.
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

    def stroke(moved: np.ndarray) -> np.ndarray:
        e = experiments[0]
        return stroke_errors(e, plant_with(e.plant, uncertain.names, moved), rows)

    about = {"units": "Pa2", "long_name": "mean square error on cylinders drawn from what is not known"}
    measured = [[uncertain.measured.get(name, np.nan) for name in ROWS]] * len(experiments)
    on_record = {"units": "Pa", "long_name": "RMS error on the part of a record that its fit did not see"}
    limits = ["; ".join(map(uncertain.text, uncertain.names))] * len(experiments)
    flow = [uncertain.flow] * len(experiments)
    cells = xr.Dataset(
        {
            "mse_drawn": (("experiment", "draw", "row", "chamber"), errors(deviations), about),
            "measured": (("experiment", "row"), measured, on_record),
            "limits": ("experiment", limits, {"long_name": "95 % limits within which quantities are known"}),
            "flow": ("experiment", flow, {"long_name": "key of the valve's flow with an accuracy"}),
        },
        {"chamber": CHAMBERS, "row": list(ROWS)},
    )
    if draws == DRAWS:
        all_off, dims = deviations[:PART_DRAWS], ("experiment", "part_draw", "row", "chamber")
        alone = np.full((len(GROUPS) + 1, len(experiments), PART_DRAWS, len(ROWS), 2), np.nan)
        others = alone.copy()
        for group in uncertain.groups:
            off = uncertain.alone(group, all_off)
            alone[GROUPS.index(group)], others[GROUPS.index(group)] = errors(off), errors(all_off - off)
        alone[-1] = errors(0 * all_off)
        strokes = [list(pool.map(stroke, all_off))] * len(experiments)
        for name, of_dims, mse, words in (
            ("mse_alone", ("group", *dims), alone, "if only the quantities of one group are off"),
            ("mse_others", ("group", *dims), others, "if all but the quantities of one group are off"),
            ("mse_stroke", dims, strokes, "over a full stroke from vented into rest"),
        ):
            cells[name] = (of_dims, mse, about | {"long_name": f"the same {words}"})
        cells = cells.assign_coords(group=[*GROUPS, NOTHING])
        if uncertain.accuracy and not uncertain.measured:
            from pneumo.selection.after_record import error_after_record  # a second, as fits take

            after = [error_after_record(experiments[0], uncertain.accuracy)] * len(experiments)
            about = {"units": "Pa", "long_name": "expected RMS error of a full order fitted to one record"}
            cells["after_record"] = ("experiment", after, about)
    return cells


def run_study(
    study: Study,
    threads: int,
    progress: Callable[[float], None] = lambda _seconds: None,
    uncertain: Mapping[str, Uncertain] | None = None,
    draws: int = DRAWS,
) -> xr.Dataset:
    """Run every experiment of a study with several seeds, and replay every model at every n on each run.

    An experiment whose signal is not random runs once. `uncertain` says how well each cylinder is known, from
    `uncertainties`; without it no cylinders are drawn. `progress` is called after each run with its simulated
    time, s.

    Returns the variables of `one_run` by (experiment, run, ...) and those of `drawn_errors`; by experiment,
    `time_constant`, s, and `duration`, s. The result does not depend on the number of threads.
    """

    def work(item: tuple[Experiment, int]) -> xr.Dataset:
        e, seed = item
        cells = one_run(e.with_seed(seed), study.n)
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
        runs = runs * count if len(runs) == 1 else runs
        part = xr.concat(runs, "run", coords=["seed"], compat="equals", combine_attrs="drop_conflicts")
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
