"""Observers and controllers that know their plant only in part, with reduced models and the full order.

The experiment is that of paper/decisions/0076. A row is a model together with the k_0 that it uses.
"""

from collections.abc import Callable
from itertools import product
from math import exp
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.equations.system import FULL_ORDER
from pneumo.evidence.at_work.observers import filter_noise
from pneumo.evidence.at_work.plant_at_work import (
    BANDWIDTHS,
    CONTROL_FORCE_NOISE,
    CONTROL_SENSORS,
    FORCE_NOISE,
    LEFT_OUT,
    PRESSURE_NOISES,
    SENSORS,
    TUNING_SEEDS,
    ObserverRun,
    control_run,
    full_force,
    observer_run,
    replay_errors,
)
from pneumo.evidence.at_work.position_control import Controller
from pneumo.evidence.at_work.sampled_plant import (
    HELD,
    X_STEP,
    air_from_supply,
    held_step,
    rounded,
    sampled_recording,
)
from pneumo.physics.models import MODELS, Lane, lane
from pneumo.physics.valve import limited
from pneumo.simulation.excitation import command, reference_series, reversed_at
from pneumo.simulation.full_order import Recording, equilibrium
from pneumo.simulation.full_order_replay import FullRow
from pneumo.simulation.kalman_filter import LN_K_0, FilterModel, estimated
from pneumo.storage.layout import described

SEEDS, ROOT_SEED = 10, 76
SCALES = (0.0, 0.1, 0.25, 0.5, 1.0)  # of `OFF`
CONTROL_SCALES = (0.0, 0.25, 1.0)
OFF = np.array([0.05, 0.2, 0.2, 0.2])  # of the valve, either dead volume and viscous friction, relative
FORCE_NOISES = (1.0, 3.0, 10.0)  # times `FORCE_NOISE`
STICK_SLIP = 0.1  # Coulomb friction of a plant of which no row knows, over P_s A_A
RECEIVER, REFILL = 20.0, 0.5  # volume of a supply that sags, over half the stroke's; time constant, s


class Row(NamedTuple):
    """A model in an observer or a controller."""

    model: str  #: a key of `MODELS`, or the full order
    k_0_factor: float = 1.0  #: k_0 that the row uses, or starts from, over the plant's
    estimates_k_0: bool = False  #: whether ln k_0 is a state

    @property
    def name(self) -> str:
        """Label of the row."""
        told = f"{self.k_0_factor:g} k_0"
        if self.estimates_k_0:
            return f"{self.model}, k_0 estimated from {told}"
        return self.model if self.k_0_factor == 1 else f"{self.model}, {told}"

    def lane(self, n: float, gamma: float) -> Lane:
        """Lane of the reduced model at the polytropic index n, with k_0 times `k_0_factor`."""
        row = lane(MODELS[self.model], n, gamma)
        return row._replace(wall_scale=self.k_0_factor * row.wall_scale)

    def filter_model(self, n: float, gamma: float) -> FilterModel:
        """Model of a filter; n plays no role in the full order."""
        if self.model == FULL_ORDER:
            return FilterModel(
                True, self.estimates_k_0, lane(MODELS["M1"], 1.0, gamma), FullRow(self.k_0_factor)
            )
        return FilterModel(False, self.estimates_k_0, self.lane(n, gamma), FullRow())


ROWS = [
    Row("M6"),
    *(Row(model, factor) for model in ("M7", "M8", "M10", FULL_ORDER) for factor in (0.5, 1.0, 2.0)),
    *(Row(model, factor, True) for model in ("M8", FULL_ORDER) for factor in (0.5, 2.0)),
]

VARIABLES = {  # dimensions, unit, long name
    "n": ("loop row", "1", "polytropic index with the lowest replay error; NaN in the full order"),
    "pressure_noise": ("loop sensors scale row", "Pa s-0.5", "process noise of the pressures, tuned"),
    "force_noise": ("loop sensors scale row", "1", "process noise of the force over its default, tuned"),
    "estimation_error": ("loop sensors scale row seed", "Pa", "RMS error of the estimated pressures"),
    "k_0_found": ("loop sensors scale row seed", "1", "k_0 at the run's end over the plant's"),
    "tracking_error": ("control_sensors control_scale row seed", "m", "RMS tracking error of the task"),
    "bandwidth": ("control_sensors control_scale row", "rad s-1", "bandwidth of the controller, tuned"),
}


class PartlyKnown(NamedTuple):
    """Experiments of one plant in open and closed loop, and the properties of it that no row knows."""

    open_loop: Experiment
    closed_loop: Experiment
    hidden_coulomb: float = 0.0  #: Coulomb friction that no row knows, N
    sagging: bool = False  #: whether the supply is a receiver; rows take P_s

    def at(self, experiment: Experiment) -> Experiment:
        """The experiment with the hidden Coulomb friction added to its plant."""
        c = experiment.plant.cylinder
        cylinder = c._replace(coulomb=c.coulomb + self.hidden_coulomb)
        return experiment._replace(plant=experiment.plant._replace(cylinder=cylinder))


def told_plant(plant: Plant, scale: float, signs: np.ndarray) -> Plant:
    """Plant as an observer or controller assumes it: valve, dead volumes and viscous friction are wrong.

    Each of the four is multiplied by 1 + scale * `OFF` * sign; `signs` are -1 or 1, shape (4,).
    """
    valve, dead_A, dead_B, viscous = (1 + scale * OFF * signs).tolist()
    c = plant.cylinder
    cylinder = c._replace(V_d_A=dead_A * c.V_d_A, V_d_B=dead_B * c.V_d_B, k_f=viscous * c.k_f)
    return plant._replace(cylinder=cylinder, valve=plant.valve._replace(k_xu=valve * plant.valve.k_xu))


def sagging_recording(experiment: Experiment, seed: int, steps: int) -> Recording:
    """Run an experiment, sampled at its step, with air from a receiver that refills slowly.

    `seed` is that of the reference. The plant of the recording has the constant P_s.
    """
    e, plant = experiment, experiment.plant
    gas, conditions, c = plant.gas, plant.conditions, plant.cylinder
    content = RECEIVER * c.A_A * c.stroke / 2 / (gas.R * conditions.T_in)  # kg/Pa
    reference = reference_series(e.drive, e.excitation._replace(seed=seed), steps)
    states, u, halvings = np.empty((steps + 1, 6)), np.empty(steps + 1), np.zeros(steps, np.int8)
    states[0], sign, P_s = equilibrium(plant), 1.0, conditions.P_s
    for k in range(steps + 1):
        x = rounded(states[k, 0], X_STEP)
        now, sign = reversed_at(x, reference[k], sign, e.drive)
        u[k] = limited(command(now, x, e.drive), plant.valve.u_max)
        if k < steps:
            fed = plant._replace(conditions=conditions._replace(P_s=P_s))
            used = air_from_supply(u[k], states[k], fed) / content
            states[k + 1], halvings[k] = held_step(states[k], u[k], 0.0, fed, e.h, e.most_halvings)
            P_s += e.h * ((conditions.P_s - P_s) / REFILL - used)
    return Recording(
        states=states,
        reference=u,
        u=u,
        drive=HELD,
        plant=plant,
        h=e.h,
        halvings=halvings,
        most_halvings=e.most_halvings,
    )


class Told(NamedTuple):
    """A run, and its plant as an observer or controller assumes it."""

    run: ObserverRun
    plant: Plant


def filter_errors(
    told: Told, model: FilterModel, sensors: str, force_noise: float, pressure_noise: float
) -> tuple[float, float]:
    """Mean square error of the estimated pressures, Pa^2, and the final estimate of k_0 over its start.

    The first second of the run is left out of the error. An estimate that is not finite counts as an error of
    P_0.
    """
    run, plant = told.run, told.run.recording.plant
    states, u, h = run.recording.states, run.recording.u, run.recording.h
    noise = filter_noise(force_noise * FORCE_NOISE * full_force(plant), pressure_noise)
    P = np.where(np.arange(2) < SENSORS[sensors], run.P, np.nan)
    estimates, _ = estimated(run.x, P, u, run.first, model, told.plant, noise, h)
    counted = slice(round(LEFT_OUT / h), None)
    square = float(((estimates[counted, 2:4] - states[counted][:, [2, 4]]) ** 2).mean())
    worst = plant.conditions.P_0**2
    return (square if np.isfinite(square) else worst), exp(estimates[-1, LN_K_0])


def tuned_noise(tuning: list[Told], model: FilterModel, sensors: str) -> tuple[float, float]:
    """Process noise with the lowest mean square error over the tuning runs.

    Returns the noise of the force over its default, and that of the pressures, Pa/s^0.5.
    """
    tried = list(product(FORCE_NOISES, PRESSURE_NOISES))
    squares = [np.mean([filter_errors(told, model, sensors, *pair)[0] for told in tuning]) for pair in tried]
    return tried[int(np.argmin(squares))]


def seeds_of(plant: int, use: int) -> list[np.random.SeedSequence]:
    """Seeds of tuning, then of judged runs; `use` is 0 (open loop), 1 (closed loop) or 2 (controllers)."""
    return np.random.SeedSequence([ROOT_SEED, plant, use]).spawn(TUNING_SEEDS + SEEDS)


def signs_of(seed: np.random.SeedSequence) -> np.ndarray:
    """Signs, -1 or 1, of the errors that `told_plant` makes, drawn for a seed: shape (4,)."""
    other = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 0))
    return np.random.default_rng(other).choice([-1.0, 1.0], len(OFF))


def chosen_n(runs: list[ObserverRun], grid: tuple[float, ...], gamma: float) -> np.ndarray:
    """Polytropic index with the lowest replay error over some runs, shape (row,).

    It is NaN for the full order, which has none.
    """
    reduced = [row for row in ROWS if row.model != FULL_ORDER]
    lanes = [row.lane(n, gamma) for row in reduced for n in grid]
    mse = np.mean([replay_errors(run, lanes) for run in runs], axis=0).reshape(len(reduced), len(grid))
    best = iter(np.array(grid)[np.nan_to_num(mse, nan=np.inf).argmin(axis=1)])
    return np.array([np.nan if row.model == FULL_ORDER else next(best) for row in ROWS])


def _observers(
    plant: PartlyKnown, experiment: Experiment, grid: tuple[float, ...], number: int, loop: int
) -> dict[str, np.ndarray]:
    """Results of one loop's observers by variable."""
    seeds, true = seeds_of(number, loop), plant.at(experiment)
    recorded = sagging_recording if plant.sagging else sampled_recording
    runs = [observer_run(true, seed, recorded) for seed in seeds]
    gamma, signs = experiment.plant.gas.gamma, [signs_of(seed) for seed in seeds]
    n = chosen_n(runs[:TUNING_SEEDS], grid, gamma)
    shape = len(SENSORS), len(SCALES), len(ROWS)
    noise, errors, found_k_0 = np.empty((*shape, 2)), np.empty((*shape, SEEDS)), np.empty((*shape, SEEDS))
    for (s, scale), (j, row) in product(enumerate(SCALES), enumerate(ROWS)):
        plants = [told_plant(experiment.plant, scale, of_run) for of_run in signs]
        told = [Told(run, of_run) for run, of_run in zip(runs, plants, strict=True)]
        model = row.filter_model(float(n[j]), gamma)
        for i, sensors in enumerate(SENSORS):
            best = tuned_noise(told[:TUNING_SEEDS], model, sensors)
            judged = [filter_errors(of_run, model, sensors, *best) for of_run in told[TUNING_SEEDS:]]
            noise[i, s, j] = best
            errors[i, s, j], found_k_0[i, s, j] = np.transpose(judged)
    factors = np.array([row.k_0_factor for row in ROWS])
    return {
        "n": n,
        "force_noise": noise[..., 0],
        "pressure_noise": noise[..., 1],
        "estimation_error": np.sqrt(errors),
        "k_0_found": found_k_0 * factors[:, None],
    }


def _controllers(
    plant: PartlyKnown, n: np.ndarray, pressure_noise: np.ndarray, number: int
) -> dict[str, np.ndarray]:
    """Results of the controllers by variable; NaN for a sagging supply, where controllers are not run."""
    experiment, seeds = plant.at(plant.closed_loop), seeds_of(number, 2)
    shape = len(CONTROL_SENSORS), len(CONTROL_SCALES), len(ROWS)
    errors, bandwidth = np.full((*shape, SEEDS), np.nan), np.full(shape, np.nan)
    if plant.sagging:
        return {"tracking_error": errors, "bandwidth": bandwidth}
    force, gamma = CONTROL_FORCE_NOISE * full_force(experiment.plant), experiment.plant.gas.gamma
    for (i, sensors), (s, scale) in product(enumerate(CONTROL_SENSORS), enumerate(CONTROL_SCALES)):
        told = [told_plant(plant.closed_loop.plant, scale, signs_of(seed)) for seed in seeds]
        runs = list(zip(seeds, told, strict=True))
        tuning, judged = runs[:TUNING_SEEDS], runs[TUNING_SEEDS:]
        for j, row in enumerate(ROWS):
            model = row.filter_model(float(n[j]), gamma)
            place = list(SENSORS).index(sensors), SCALES.index(scale), j
            noise = filter_noise(force, float(pressure_noise[place]))
            tried = [Controller(SENSORS[sensors], w, 0.0, noise) for w in BANDWIDTHS]
            squares = [
                np.mean([control_run(experiment, seed, c, model, known).tracking for seed, known in tuning])
                for c in tried
            ]
            chosen = tried[int(np.argmin(squares))]
            bandwidth[i, s, j] = chosen.bandwidth
            done = [control_run(experiment, seed, chosen, model, known).tracking for seed, known in judged]
            errors[i, s, j] = np.sqrt(done)
    return {"tracking_error": errors, "bandwidth": bandwidth}


def partly_known_plant(
    plant: PartlyKnown,
    grid: tuple[float, ...],
    number: int,
    progress: Callable[[str], None] = lambda _text: None,
) -> xr.Dataset:
    """Errors of observers and controllers on one plant with every row of `ROWS`, as `VARIABLES`.

    `grid` holds the polytropic indices that are tried; seeds are drawn from the number of the plant.
    """
    loops, parts = {"open": plant.open_loop, "closed": plant.closed_loop}, []
    for i, (loop, experiment) in enumerate(loops.items()):
        parts.append(_observers(plant, experiment, grid, number, i))
        progress(f"observers, {loop} loop: done")
    values = {name: np.stack([part[name] for part in parts]) for name in parts[0]}
    values |= _controllers(plant, parts[1]["n"], parts[1]["pressure_noise"], number)
    progress("controllers: done")
    coords = {"loop": list(loops), "sensors": list(SENSORS), "scale": list(SCALES)}
    coords |= {"control_sensors": list(CONTROL_SENSORS), "control_scale": list(CONTROL_SCALES)}
    coords |= {
        "row": [row.name for row in ROWS],
        "model": ("row", [row.model for row in ROWS]),
        "k_0_factor": ("row", [row.k_0_factor for row in ROWS]),
        "estimates_k_0": ("row", [int(row.estimates_k_0) for row in ROWS]),
    }
    cells = {name: (VARIABLES[name][0].split(), array) for name, array in values.items()}
    return described(xr.Dataset(cells, coords), {name: about[1:] for name, about in VARIABLES.items()})
