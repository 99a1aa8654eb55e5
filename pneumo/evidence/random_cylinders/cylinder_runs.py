"""Runs of random cylinders with every cell of the grid: paper/decisions/0029.

Each cylinder is drawn from its number alone, so longer lists begin with the same cylinders.
"""

from math import pi

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import MOST_HALVINGS, Drive, Excitation, Experiment, Plant, Push
from pneumo.configuration.sampling import EXACT_SAMPLING, Sampling
from pneumo.evidence.random_cylinders import random_plants as draw
from pneumo.evidence.random_cylinders.dimensionless_groups import KNOWN_GROUPS, full_speed, known_groups
from pneumo.physics.cylinder import heat_area
from pneumo.physics.valve import Valve
from pneumo.simulation.full_order import record
from pneumo.simulation.settling import thermal_time_constant
from pneumo.storage.grid_layout import replayed_grid
from pneumo.storage.layout import run_outcome

CYLINDERS_SEED = 29
LOOPS = ("open", "closed")
GRID_N = (1.0, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4)

CATALOGUE_BORES = (8, 10, 12, 16, 20, 25, 32, 40, 50, 63, 80, 100)  # mm: ISO 6432 to 25, ISO 15552 from 32
# Rods' diameters by bore, mm.
RODS: dict[int, int] = dict(zip(CATALOGUE_BORES, (4, 4, 6, 6, 8, 10, 12, 16, 20, 20, 25, 25), strict=True))
CATALOGUE_STROKES = (25, 50, 80, 100, 125, 160, 200, 250, 320, 400, 500, 630, 800, 1000)  # mm
LONGEST_STROKES = {8: 100, 10: 100, 12: 200, 16: 200, 20: 320, 25: 500}  # mm, by bore

# Open loop: amplitude over u_max; travel in the time between draws over the stroke.
AMPLITUDE, TRAVEL = draw.log_uniform(0.03, 1.0), draw.log_uniform(0.01, 0.3)
# Closed loop: deviation of the reference and error of full command, over the stroke; hold, see 0029.
DEVIATION, FULL_AT = draw.log_uniform(0.03, 0.2), draw.log_uniform(0.1, 1.0)
PATIENCE = draw.log_uniform(0.5, 20.0)
HOLD = (0.02, 5.0)  # s
RUN_LENGTH, HOLDS, TIME_CONSTANTS = (20.0, 1000.0), 200, 10.0  # of a run: s, and at least
FULL_STEP, STEPS_PER_EMPTYING, MOST_STEPS = 1e-3, 30.0, 3_000_000  # s; at least; of a run at most


def catalogue_size(rng: np.random.Generator) -> draw.Size:
    """Draw a bore and stroke of the catalogues, half of them with a rod."""
    bore = int(rng.choice(CATALOGUE_BORES))
    longest = LONGEST_STROKES.get(bore, CATALOGUE_STROKES[-1])
    stroke = int(rng.choice([stroke for stroke in CATALOGUE_STROKES if stroke <= longest]))
    has_rod = rng.random() < 0.5
    return draw.Size(bore * 1e-3, stroke * 1e-3, pi / 4 * (RODS[bore] * 1e-3) ** 2 if has_rod else 0.0)


MAP_RANGES = draw.Ranges(
    catalogue_size,
    {
        "P_s": draw.log_uniform(5e5, 10e5),
        "speed": draw.log_uniform(0.1, 3.2),
        "dead": draw.log_uniform(0.05, 0.2),
        "acceleration": draw.log_uniform(5.0, 50.0),
        "viscous": draw.log_uniform(0.05, 0.6),
        "coulomb": draw.uniform(0.0, 0.05),
        "lambda_0": draw.log_uniform(1.3, 663.0),
    },
    strokes_per_second=12.0,
    reference_force=1.0,
    accelerating_force=0.3,
    P_atm=1e5,
)


def emptying_time(plant: Plant, u: float) -> float:
    """Time in which sonic flow at a command, V, empties the dead volume, s."""
    gas, conditions = plant.gas, plant.conditions
    A_t = plant.valve.k_xu * u
    return plant.cylinder.V_d_A / (gas.sonic_coefficient * gas.R * conditions.T_0**0.5 * A_t)


def random_experiments(number: int) -> tuple[Experiment, Experiment]:
    """Draw a cylinder, by its number from 0, and its two runs: in open and in closed loop."""
    rng = np.random.default_rng([CYLINDERS_SEED, number])
    plant, drawn = draw.random_plant(rng, MAP_RANGES)
    plant = plant._replace(valve=Valve(drawn["speed"] / full_speed(plant), draw.U_MAX))
    stroke, speed = plant.cylinder.stroke, full_speed(plant)
    amplitude, gain = AMPLITUDE(rng), draw.U_MAX / (FULL_AT(rng) * stroke)
    deviation = DEVIATION(rng) * stroke
    drives = Drive(False, 0.0, 0.96 * stroke / 2), Drive(True, gain, stroke / 2)
    amplitudes = amplitude * draw.U_MAX, deviation
    holds = TRAVEL(rng) * stroke / (amplitude * speed), PATIENCE(rng) * deviation / speed
    experiments: list[Experiment] = []
    for i, loop in enumerate(LOOPS):
        hold = float(np.clip(holds[i], *HOLD))
        largest = draw.U_MAX if drives[i].closed_loop else amplitudes[i]
        h = min(FULL_STEP, emptying_time(plant, largest) / STEPS_PER_EMPTYING)
        length = np.clip(max(TIME_CONSTANTS * thermal_time_constant(plant), HOLDS * hold), *RUN_LENGTH)
        steps = min(MOST_STEPS, round(float(length) / h))
        signal = Excitation(int(rng.integers(1, 2**31)), amplitudes[i], max(1, round(hold / h)))
        push = Push(0.0, plant.cylinder.x_min)  # nothing pushes
        name = f"{number:03}-{loop}"
        about = name, f"{number:03}", plant, drives[i], signal, push, Sampling()
        experiments.append(Experiment(*about, h, steps, pressure_stride=steps, most_halvings=MOST_HALVINGS))
    return experiments[0], experiments[1]


def _run(experiment: Experiment) -> xr.Dataset:
    """Run one experiment: errors of both chambers together by (model, n), and its dimensionless groups."""
    recording = record(experiment)
    cells = replayed_grid(experiment, GRID_N, recording, EXACT_SAMPLING, experiment.steps)
    mse = cells["mse"].mean("chamber", skipna=False).drop_vars(["experiment", "cylinder", "loop", "k_0"])
    groups = {
        name: ((), value, {"units": "1", "long_name": KNOWN_GROUPS[name]})
        for name, value in known_groups(experiment).items()
    }
    return mse.to_dataset().assign(run_outcome(recording) | groups)


def cylinder_sizes(plant: Plant) -> dict[str, tuple[float, str, str]]:
    """Sizes of a cylinder in SI units, each with unit and long name."""
    c = plant.cylinder
    return {
        "bore": (c.bore, "m", "diameter of the piston"),
        "stroke": (c.stroke, "m", "stroke"),
        "rod_share": (1 - c.A_B / c.A_A, "1", "rod's area over the piston's"),
        "P_s": (plant.conditions.P_s, "Pa", "absolute supply pressure"),
        "lambda_0": (plant.k_0 / heat_area(0.0, c), "W m-2 K-1", "heat transfer coefficient at equilibrium"),
    }


def cylinder_cells(number: int) -> xr.Dataset:
    """Run a random cylinder in open and in closed loop.

    Returns `mse`, Pa^2, by (loop, model, n); by loop `run_outcome` and the dimensionless `KNOWN_GROUPS`;
    `cylinder_sizes`.
    """
    both = random_experiments(number)
    dataset: xr.Dataset = xr.concat([_run(e) for e in both], xr.Variable("loop", list(LOOPS)))
    for name, (value, unit, words) in cylinder_sizes(both[0].plant).items():
        dataset[name] = ((), value, {"units": unit, "long_name": words})
    duration = [e.duration for e in both]
    dataset["duration"] = ("loop", duration, {"units": "s", "long_name": "length of the run"})
    dataset["step"] = ("loop", [e.h for e in both], {"units": "s", "long_name": "integration step"})
    return dataset
