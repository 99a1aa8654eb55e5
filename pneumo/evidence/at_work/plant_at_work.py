"""Reduced models in an observer and in a position controller, on one plant: paper/decisions/0049.

Each model is tuned on some runs, then judged on others.
"""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.evidence.at_work.observers import filter_noise, observability, reduced
from pneumo.evidence.at_work.position_control import (
    P_CONTROL,
    PARTS,
    Controller,
    controlled,
    drawn_task,
    part_errors,
)
from pneumo.evidence.at_work.sampled_plant import PRESSURE_NOISE, readings, sampled_recording
from pneumo.physics.models import MODELS, Lane, lane, lane_array
from pneumo.simulation.full_order import Recording
from pneumo.simulation.kalman_filter import FIRST_PRESSURE, FilterModel, estimated
from pneumo.simulation.replay import replay
from pneumo.storage.layout import CHAMBERS, described

CARRIED_MODELS = ("M1", "M2", "M5", "M6", "M7", "M8", "M10")
K_0_FACTORS = (0.5, 1.0, 2.0)  # k_0 of the model over the plant's
SENSORS = {"none": 0, "one": 1, "both": 2}  # pressures measured
CONTROL_SENSORS = ("none", "both")
SEEDS, TUNING_SEEDS = 30, 3
RUN, LEFT_OUT = 10.0, 1.0  # s, of an observer's run, and at its start before errors count
FORCE_NOISE, CONTROL_FORCE_NOISE = 3e-4, 3e-3  # s^0.5, over P_s A_A
PRESSURE_NOISES = (3e2, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5)  # Pa/s^0.5
BANDWIDTHS = (22.0, 33.0, 50.0, 75.0, 110.0, 165.0, 250.0)  # rad/s
GAINS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # of P control, u_max per stroke
ROOT_SEED = 49

VARIABLES = {  # dimensions, unit, long name
    "n": ("loop carried", "1", "polytropic index with the lowest replay error; 1 where the model has none"),
    "replay_error": ("loop carried seed", "Pa", "RMS error of replays, both chambers, exact signals"),
    "pressure_noise": ("loop sensors carried", "Pa s-0.5", "process noise of the pressures, tuned"),
    "estimation_error": (
        "loop sensors carried seed",
        "Pa",
        "RMS error of the estimated pressures, both chambers",
    ),
    "estimation_error_by_chamber": (
        "loop sensors carried chamber",
        "Pa",
        "the same of each chamber, all seeds",
    ),
    "observability_rank": ("sensors carried", "1", "least rank of the observability matrix; 4 is observable"),
    "observable_deviation": (
        "sensors carried chamber",
        "Pa",
        "standard deviation that 0.5 s of samples leave to a perfect linear model",
    ),
}
# The same of a controller by (control_sensors, carried) and these; ``baseline_`` by these alone.
CONTROL_VARIABLES = {
    "tracking_error": ("seed", "m", "RMS tracking error of the whole task"),
    "following_error": ("seed", "m", "RMS tracking error of sine and handling"),
    "effort": ("seed", "V", "RMS of the limited command"),
    "air": ("seed", "kg", "air from the supply over the task"),
    "error_by_part": ("part", "m", "RMS tracking error of each part, all seeds"),
    "following_at_bandwidth": (
        "bandwidth_tried",
        "m",
        "RMS error of sine and handling in the tuning runs at each bandwidth",
    ),
    "bandwidth": ("", "rad s-1", "bandwidth of the controller, tuned"),
    "gain": ("", "V m-1", "gain of P control, tuned"),
}


class Carried(NamedTuple):
    """A model that an observer or controller uses, with its k_0."""

    model: str
    k_0_factor: float  # 1 for models without wall heat

    def lane(self, n: float, gamma: float) -> Lane:
        """Lane of the model at the polytropic index n, with k_0 times `k_0_factor`."""
        row = lane(MODELS[self.model], n, gamma)
        return row._replace(wall_scale=self.k_0_factor * row.wall_scale)

    @property
    def name(self) -> str:
        """Label of the model with its k_0."""
        return self.model if self.k_0_factor == 1 else f"{self.model}, {self.k_0_factor:g} k_0"


CARRIED = [
    Carried(model, factor)
    for model in CARRIED_MODELS
    for factor in (K_0_FACTORS if MODELS[model].wall != "none" else (1.0,))
]


class ObserverRun(NamedTuple):
    """A run of the plant, with the readings of its sensors."""

    recording: Recording
    x: np.ndarray  # m, read
    P: np.ndarray  # Pa, read
    first: np.ndarray  # first estimate of P_A and P_B, Pa


def observer_run(
    experiment: Experiment,
    seed: np.random.SeedSequence,
    recorded: Callable[[Experiment, int, int], Recording] = sampled_recording,
) -> ObserverRun:
    """Run of an experiment, with readings of its sensors and a first estimate of the pressures.

    The command's reference, the noise of the sensors and the error of the estimate are drawn from `seed`.
    `recorded` makes the recording, from the experiment, a seed and the number of steps.
    """
    rng = np.random.default_rng(seed)
    steps = round(RUN / experiment.h)
    recording = recorded(experiment, int(rng.integers(1, 2**31)), steps)
    x, P = readings(recording.states, rng)
    first = experiment.plant.conditions.P_0 + FIRST_PRESSURE * rng.standard_normal(2)
    return ObserverRun(recording, x, P, first)


def replay_errors(run: ObserverRun, lanes: list[Lane]) -> np.ndarray:
    """Mean square error of replays, Pa^2, both chambers together; NaN where one fails: shape (lane,)."""
    cells = replay(run.recording, lane_array(lanes), EXACT_SAMPLING, len(run.x) - 1)
    return cells.mse.mean(axis=1)


def estimation_errors(run: ObserverRun, lane: Lane, sensors: str, pressure_noise: float) -> np.ndarray:
    """Mean square error of the estimated P_A and P_B, Pa^2, after the first second: shape (chamber,)."""
    states, u, plant, h = run.recording.states, run.recording.u, run.recording.plant, run.recording.h
    noise = filter_noise(FORCE_NOISE * full_force(plant), pressure_noise)
    P = np.where(np.arange(2) < SENSORS[sensors], run.P, np.nan)
    estimates, _ = estimated(run.x, P, u, run.first, reduced(lane), plant, noise, h)
    counted = slice(round(LEFT_OUT / h), None)
    return ((estimates[counted, 2:4] - states[counted, [2, 4]]) ** 2).mean(axis=0)


def full_force(plant: Plant) -> float:
    """Force of the supply pressure on the piston area of chamber A, N."""
    return plant.conditions.P_s * plant.cylinder.A_A


class ControlRun(NamedTuple):
    """Mean squares of tracking error and command over a task, and the mass of air used."""

    tracking: float  # m^2
    by_part: np.ndarray  # m^2, for each of `PARTS`
    effort: float  # V^2
    air: float  # kg


def control_run(
    experiment: Experiment,
    seed: np.random.SeedSequence,
    controller: Controller,
    model: FilterModel,
    told: Plant | None = None,
) -> ControlRun:
    """Run a task drawn from a seed; a run that fails has an error of one stroke.

    `told` is the plant as the controller knows it; the experiment's if None.
    """
    told = told or experiment.plant
    e, rng = experiment, np.random.default_rng(seed)
    task, cylinder = drawn_task(rng, e.plant, e.h), e.plant.cylinder
    noise = PRESSURE_NOISE * rng.standard_normal((len(task.force), 2))
    first = e.plant.conditions.P_0 + FIRST_PRESSURE * rng.standard_normal(2)
    smooth = told._replace(cylinder=told.cylinder._replace(coulomb=0.0))
    done = controlled(task, noise, first, controller, model, e.plant, told, smooth, e.h, e.most_halvings)
    if not np.isfinite([done.x, done.u]).all():
        square = cylinder.stroke**2
        return ControlRun(square, np.full(len(PARTS), square), e.plant.valve.u_max**2, np.nan)
    tracking = float(((done.x - task.reference[:, 0]) ** 2).mean())
    return ControlRun(tracking, part_errors(task, done, e.h), float((done.u**2).mean()), done.air)


def _seeds(plant: int, use: int) -> tuple[list[np.random.SeedSequence], list[np.random.SeedSequence]]:
    """Seeds of tuning runs and of judged runs; `use` is 0 (open loop), 1 (closed loop) or 2 (controllers)."""
    every = np.random.SeedSequence([ROOT_SEED, plant, use]).spawn(TUNING_SEEDS + SEEDS)
    return every[:TUNING_SEEDS], every[TUNING_SEEDS:]


def _observers(
    experiment: Experiment, grid: tuple[float, ...], plant: int, loop: int
) -> tuple[dict[str, np.ndarray], list[Lane]]:
    """Results of one loop's observers by variable, and the lanes of the models at their n."""
    tuning, judged = ([observer_run(experiment, seed) for seed in seeds] for seeds in _seeds(plant, loop))
    gamma = experiment.plant.gas.gamma
    wide = [carried.lane(n, gamma) for carried in CARRIED for n in grid]
    mse = np.mean([replay_errors(run, wide) for run in tuning], axis=0).reshape(len(CARRIED), len(grid))
    n = np.array([grid[int(i)] for i in np.nan_to_num(mse, nan=np.inf).argmin(axis=1)])
    n[[not MODELS[carried.model].has_n for carried in CARRIED]] = 1.0
    lanes = [carried.lane(value, gamma) for carried, value in zip(CARRIED, n, strict=True)]
    shape = len(SENSORS), len(CARRIED)
    noise, errors = np.empty(shape), np.empty((*shape, len(judged), 2))
    for (i, sensors), (j, row) in product(enumerate(SENSORS), enumerate(lanes)):
        tried = [
            np.mean([estimation_errors(run, row, sensors, q) for run in tuning]) for q in PRESSURE_NOISES
        ]
        noise[i, j] = PRESSURE_NOISES[int(np.argmin(tried))]
        errors[i, j] = [estimation_errors(run, row, sensors, float(noise[i, j])) for run in judged]
    cells = {
        "n": n,
        "replay_error": np.sqrt([replay_errors(run, lanes) for run in judged]).T,
        "pressure_noise": noise,
        "estimation_error": np.sqrt(errors.mean(axis=-1)),
        "estimation_error_by_chamber": np.sqrt(errors.mean(axis=-2)),
    }
    return cells, lanes


def _judged(runs: list[ControlRun]) -> dict[str, np.ndarray]:
    """Errors, effort and air of one controller in its judged runs, by variable name."""
    parts, (names, ends) = np.array([run.by_part for run in runs]), zip(*PARTS.items(), strict=True)
    lengths = np.array([end - start for start, end in ends])
    follow = np.array([name in ("sine", "handling") for name in names])
    return {
        "tracking_error": np.sqrt([run.tracking for run in runs]),
        "following_error": np.sqrt(parts[:, follow] @ lengths[follow] / lengths[follow].sum()),
        "effort": np.sqrt([run.effort for run in runs]),
        "air": np.array([run.air for run in runs]),
        "error_by_part": np.sqrt(parts.mean(axis=0)),
    }


def _controllers(
    experiment: Experiment, plant: int, lanes: list[Lane], noise: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Results of the controllers by variable, those of P control with the prefix ``baseline_``."""
    tuning, judged = _seeds(plant, 2)
    force, cylinder = CONTROL_FORCE_NOISE * full_force(experiment.plant), experiment.plant.cylinder
    scale = experiment.plant.valve.u_max / cylinder.stroke

    def tried(controllers: list[Controller], row: Lane) -> tuple[int, np.ndarray]:
        """Index of the controller that tracks best on the tuning seeds, and each one's following error, m."""
        runs = [[control_run(experiment, seed, c, reduced(row)) for seed in tuning] for c in controllers]
        best = np.argmin([np.mean([run.tracking for run in tuned]) for tuned in runs])
        following = [(_judged(tuned)["following_error"] ** 2).mean() ** 0.5 for tuned in runs]
        return int(best), np.array(following)

    def done(controller: Controller, row: Lane) -> dict[str, np.ndarray]:
        return _judged([control_run(experiment, seed, controller, reduced(row)) for seed in judged])

    cells: dict[str, list[np.ndarray]] = {}
    for sensors, (j, row) in product(CONTROL_SENSORS, enumerate(lanes)):
        process = filter_noise(force, float(noise[sensors][j]))
        choices = [Controller(SENSORS[sensors], w, 0.0, process) for w in BANDWIDTHS]
        chosen, errors = tried(choices, row)
        tuned = {"bandwidth": np.array(choices[chosen].bandwidth), "following_at_bandwidth": errors}
        for name, values in (done(choices[chosen], row) | tuned).items():
            cells.setdefault(name, []).append(values)
    shape = len(CONTROL_SENSORS), len(lanes)
    stacked = {name: np.reshape(values, (*shape, *values[0].shape)) for name, values in cells.items()}
    baseline = [Controller(0, P_CONTROL, gain * scale, filter_noise(force, 0.0)) for gain in GAINS]
    best = baseline[tried(baseline, lanes[0])[0]]
    judged_best = done(best, lanes[0]) | {"gain": np.array(best.gain)}
    return stacked | {f"baseline_{name}": values for name, values in judged_best.items()}


def plant_at_work(
    open_loop: Experiment,
    closed_loop: Experiment,
    grid: tuple[float, ...],
    plant: int,
    progress: Callable[[str], None] = lambda _text: None,
) -> xr.Dataset:
    """Errors of observers and controllers on one plant, with each model of `CARRIED`.

    Both experiments have the same plant; their drives and references make the observers' runs. `grid` holds
    the polytropic indices that are tried; seeds are drawn from the number `plant`. Returns `VARIABLES`, and
    `CONTROL_VARIABLES` with and without the prefix ``baseline_``.
    """
    loops, parts, lanes = {"open": open_loop, "closed": closed_loop}, [], list[Lane]()
    for i, (loop, experiment) in enumerate(loops.items()):
        cells, lanes = _observers(experiment, grid, plant, i)  # the last are those of the closed loop
        parts.append(cells)
        progress(f"observers, {loop} loop: done")
    tuned = dict(zip(SENSORS, parts[-1]["pressure_noise"], strict=True))
    control = _controllers(closed_loop, plant, lanes, tuned)
    progress("controllers: done")
    plant_of = [closed_loop.plant._replace(k_0=c.k_0_factor * closed_loop.plant.k_0) for c in CARRIED]
    carried = list(zip(CARRIED, parts[-1]["n"], plant_of, strict=True))
    seen = [[observability(c.model, n, of_model, k) for c, n, of_model in carried] for k in SENSORS.values()]
    values = {name: np.stack([part[name] for part in parts]) for name in parts[0]} | control
    values["observability_rank"] = np.array([[o.rank for o in row] for row in seen])
    values["observable_deviation"] = np.array([[o.deviation for o in row] for row in seen])
    coords = {"loop": list(loops), "sensors": list(SENSORS), "control_sensors": list(CONTROL_SENSORS)}
    coords |= {
        "carried": [c.name for c in CARRIED],
        "model": ("carried", [c.model for c in CARRIED]),
        "k_0_factor": ("carried", [c.k_0_factor for c in CARRIED]),
    }
    coords |= {"chamber": CHAMBERS, "part": list(PARTS), "bandwidth_tried": list(BANDWIDTHS)}
    coords |= {"k_0": closed_loop.plant.k_0, "cylinder": closed_loop.cylinder}
    about = dict(VARIABLES)
    for name, (dims, unit, words) in CONTROL_VARIABLES.items():
        about[name] = f"control_sensors carried {dims}", unit, words
        about[f"baseline_{name}"] = dims, unit, words
    cells = {name: (about[name][0].split(), array) for name, array in values.items()}
    return described(xr.Dataset(cells, coords), {name: about[name][1:] for name in cells})
