"""Full order and reduced models on one run, with the k_0 and valve that each assumes: decision 75."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.evidence.random_cylinders.cylinder_runs import GRID_N, LOOPS, random_experiments
from pneumo.evidence.random_cylinders.dimensionless_groups import known_groups
from pneumo.physics.models import MODELS, WALL_LAWS, Lane, full_order_lane, lane, lane_array
from pneumo.simulation.full_order import RAN, Recording, failure, record
from pneumo.simulation.replay import OK, full_order_mse, replay
from pneumo.statistics.model_pairs import REFINED_MODELS
from pneumo.storage.layout import described, run_outcome

K_0_TOLD = (1 / 2.7, 0.5, 1.0, 2.0, 2.7)  # k_0 that a row is told, over the cylinder's
VALVE_TOLD = (0.97, 1.0, 1.03)  # the valve's coefficient likewise
K_0_TOLD_WITH_WRONG_VALVE = (1 / 2.7, 1.0, 2.7)
LAWS = {"true": "lambda A_q", "constant": "k_0"}  # of the full order's wall; keys of `WALL_LAWS`
WITHOUT_K_0 = tuple(name for name, model in MODELS.items() if model.wall == "none")
WITH_K_0 = tuple(name for name in MODELS if name not in WITHOUT_K_0)
FIXED_MODELS = ("M6", "M8", "M10")  # beside the best of a simulation
MOST_JUDGED_STEPS, MOST_SIMULATED_STEPS = 100_000, 30_000
SIMULATION_SEED = 75

RUN_VARIABLES = {  # dimensions, unit, long name
    "mse_without_k_0": ("model_without_k_0 n", "Pa2", "mean square error of models without k_0"),
    "mse_with_k_0": ("k_0_told model_with_k_0 n", "Pa2", "the same of models with k_0, by the k_0 told"),
    "mse_full": ("law k_0_told valve_told", "Pa2", "the same of the full order; NaN where not tried"),
    "mse_adiabatic": ("", "Pa2", "the same of the full order without wall heat"),
    "simulated_model": ("k_0_told valve_told", "1", "number of the model that is best in the simulation"),
    "simulated_n": ("k_0_told valve_told carried", "1", "n with the lowest error in the simulation"),
    "mse_simulated": ("k_0_told valve_told carried", "Pa2", "mean square error at the simulation's n"),
    "thermal": ("", "1", "thermal time constant over mean time between reversals, at the true k_0"),
    "swing": ("", "Pa", "standard deviation of the run's pressures, root mean square over both chambers"),
    "cut": ("", "1", "1 where the run was cut"),
}


class Told(NamedTuple):
    """Assumed k_0 and valve coefficient of a row, as factors of the cylinder's."""

    k_0: float
    valve: float

    def plant(self, plant: Plant) -> Plant:
        """Plant with the assumed k_0 and valve coefficient."""
        valve = plant.valve._replace(k_xu=self.valve * plant.valve.k_xu)
        return plant._replace(k_0=self.k_0 * plant.k_0, valve=valve)

    def lane(self, model: str, n: float, gamma: float) -> Lane:
        """Lane of a model at n with the assumed k_0 and valve coefficient.

        It is for replays on a run of the true cylinder.
        """
        row = lane(MODELS[model], n, gamma)
        return row._replace(wall_scale=self.k_0 * row.wall_scale, flow_scale=self.valve)

    def full_order(self, law: str, gamma: float) -> Lane:
        """The full order with a wall law of `LAWS`, and the assumed k_0 and valve coefficient."""
        scale, e_A, e_PT = WALL_LAWS[LAWS[law]]
        return full_order_lane(gamma, self.k_0 * scale, e_A, e_PT)._replace(flow_scale=self.valve)


TOLD = [Told(k, v) for k in K_0_TOLD for v in VALVE_TOLD if v == 1 or k in K_0_TOLD_WITH_WRONG_VALVE]


def _mse(recording: Recording, lanes: list[Lane]) -> np.ndarray:
    """Mean square error of replays, both chambers together, Pa^2, shape (lane,); NaN where one fails."""
    cells = replay(recording, lane_array(lanes), EXACT_SAMPLING, len(recording.states) - 1)
    return np.where((cells.status == OK).all(axis=1), cells.mse.mean(axis=1), np.nan)


def simulated_choice(
    experiment: Experiment, told: Told, seed: int, grid: tuple[float, ...]
) -> tuple[str, dict[str, float]]:
    """Best model of M5 to M10, and the best n of each, in a simulation with the assumed parameters.

    The simulation has another `seed`; no run of the true cylinder is used.
    """
    steps = min(experiment.steps, MOST_SIMULATED_STEPS)
    other = experiment._replace(plant=told.plant(experiment.plant), steps=steps, pressure_stride=steps)
    recording = record(other.with_seed(seed))
    gamma = experiment.plant.gas.gamma
    lanes = [lane(MODELS[model], n, gamma) for model in REFINED_MODELS for n in grid]
    mse = _mse(recording, lanes).reshape(len(REFINED_MODELS), len(grid))
    mse = np.nan_to_num(mse, nan=np.inf)
    n = {model: grid[int(i)] for model, i in zip(REFINED_MODELS, mse.argmin(axis=1), strict=True)}
    return REFINED_MODELS[int(mse.min(axis=1).argmin())], n


def contest_run(experiment: Experiment, seed: int, grid: tuple[float, ...] = GRID_N) -> xr.Dataset:
    """Errors of every row of decision 75 on one run, as `RUN_VARIABLES`.

    The run is cut to at most `MOST_JUDGED_STEPS` steps. `seed` is that of the simulations from which models
    and n are chosen beforehand.
    """
    steps = min(experiment.steps, MOST_JUDGED_STEPS)
    e = experiment._replace(steps=steps, pressure_stride=steps)
    recording, gamma = record(e), e.plant.gas.gamma
    shape = len(K_0_TOLD), len(VALVE_TOLD)
    full, model_number = np.full((len(LAWS), *shape), np.nan), np.full(shape, -1)
    carried = ("best", *FIXED_MODELS)
    n_simulated = np.full((*shape, len(carried)), np.nan)
    places = [(K_0_TOLD.index(told.k_0), VALVE_TOLD.index(told.valve)) for told in TOLD]

    true = Told(1.0, 1.0)
    lanes = [true.lane(model, n, gamma) for model in WITHOUT_K_0 for n in grid]
    lanes += [Told(k, 1.0).lane(model, n, gamma) for k in K_0_TOLD for model in WITH_K_0 for n in grid]
    for told, place in zip(TOLD, places, strict=True):
        best, n = simulated_choice(e, told, seed, grid)
        model_number[place] = list(MODELS).index(best)
        models = (best, *FIXED_MODELS)
        n_simulated[place] = [n[model] for model in models]
        lanes += [told.lane(model, n[model], gamma) for model in models]
    mse = _mse(recording, lanes)
    count = len(WITHOUT_K_0) * len(grid), len(K_0_TOLD) * len(WITH_K_0) * len(grid)
    without, with_k_0, simulated = np.split(mse, np.cumsum(count))
    mse_simulated = np.full((*shape, len(carried)), np.nan)
    for place, values in zip(places, simulated.reshape(len(TOLD), len(carried)), strict=True):
        mse_simulated[place] = values

    rows = [told.full_order(law, gamma) for law in LAWS for told in TOLD]
    of_rows = full_order_mse(recording, [*rows, full_order_lane(gamma, 0.0)], EXACT_SAMPLING).mean(axis=1)
    for i, values in enumerate(of_rows[:-1].reshape(len(LAWS), len(TOLD))):
        for place, value in zip(places, values, strict=True):
            full[i, *place] = value
    ran = failure(recording.states)[0] == RAN
    values = {
        "mse_without_k_0": without.reshape(len(WITHOUT_K_0), len(grid)),
        "mse_with_k_0": with_k_0.reshape(len(K_0_TOLD), len(WITH_K_0), len(grid)),
        "mse_full": full,
        "mse_adiabatic": of_rows[-1],
        "simulated_model": model_number.astype(np.int8),
        "simulated_n": n_simulated,
        "mse_simulated": mse_simulated,
        "thermal": known_groups(e)["thermal"],
        "swing": np.sqrt(recording.states[:, [2, 4]].var(axis=0).mean()) if ran else np.nan,
        "cut": np.int8(steps < experiment.steps),
    }
    coords = {"model_without_k_0": list(WITHOUT_K_0), "model_with_k_0": list(WITH_K_0), "n": list(grid)}
    coords |= {"law": list(LAWS), "k_0_told": list(K_0_TOLD), "valve_told": list(VALVE_TOLD)}
    dataset = xr.Dataset(
        {name: (RUN_VARIABLES[name][0].split(), value) for name, value in values.items()},
        coords | {"carried": list(carried)},
    )
    dataset = described(dataset, {name: about[1:] for name, about in RUN_VARIABLES.items()})
    return dataset.assign(run_outcome(recording))


def contest_cells(number: int) -> xr.Dataset:
    """`contest_run` of a random cylinder, by its number, in open and in closed loop."""
    seeds = np.random.default_rng([SIMULATION_SEED, number]).integers(1, 2**31, len(LOOPS))
    experiments = zip(random_experiments(number), seeds.tolist(), strict=True)
    return xr.concat([contest_run(e, seed) for e, seed in experiments], xr.Variable("loop", list(LOOPS)))
