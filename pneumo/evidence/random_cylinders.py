"""Random cylinders of catalogue sizes, and every cell of the grid on them: paper/decisions/0029.

A cylinder is drawn from its own number, so more of them begin with the same.
"""

from math import pi

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Drive, Excitation, Experiment, Plant, Push
from pneumo.evidence.dimensionless import GROUPS, MEASURED, full_speed, groups, measured
from pneumo.physics.cylinder import Cylinder, heat_area
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.valve import Conditions, Valve, exact_gas
from pneumo.simulation.full_order import RUN_STATUS, failure, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.settling import thermal_time_constant
from pneumo.simulation.signals import EXACT_TRANSPORT
from pneumo.storage.layout import replay_dataset, status_attributes

ENTROPY = 29  # of all draws
LOOPS = ("open", "closed")
N = (1.0, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4)
AIR = exact_gas(287.0, 1.4)
P_ATM, T_AMB, U_MAX = 1e5, 293.15, 10.0

BORES = (8, 10, 12, 16, 20, 25, 32, 40, 50, 63, 80, 100)  # mm: ISO 6432 to 25, ISO 15552 from 32
RODS: dict[int, int] = dict(zip(BORES, (4, 4, 6, 6, 8, 10, 12, 16, 20, 20, 25, 25), strict=True))  # mm
STROKES = (25, 50, 80, 100, 125, 160, 200, 250, 320, 400, 500, 630, 800, 1000)  # mm
LONGEST = {8: 100, 10: 100, 12: 200, 16: 200, 20: 320, 25: 500}  # mm, by bore
SUPPLY = (5e5, 10e5)  # Pa, absolute
DEAD = (0.05, 0.2)  # over the volume of half the stroke
SPEED = (0.1, 3.2)  # m/s, at full command
STROKES_PER_SECOND = 12.0  # at most
ACCELERATION = (5.0, 50.0)  # m/s^2, under FORCE
FORCE = 0.3  # of the supply pressure on the bore's area
VISCOUS = (0.05, 0.6)  # friction at full speed over the supply pressure on the bore's area
COULOMB = (0.0, 0.05)  # likewise
LAMBDA_0 = (1.3, 663.0)  # W/(m^2 K)
COMMAND, WAY = (0.03, 1.0), (0.01, 0.3)  # open loop: over u_max; per hold, over the stroke
DEVIATION, FULL_AT, PATIENCE = (0.03, 0.2), (0.1, 1.0), (0.5, 20.0)  # closed loop: see 0029
HOLD = (0.02, 5.0)  # s
LENGTH, HOLDS, TIME_CONSTANTS = (20.0, 1000.0), 200, 10.0  # of a run: s, and at least
STEP, STEPS_PER_EMPTYING, STEPS = 1e-3, 30.0, 3_000_000  # s; at least; of a run at most


def _log_uniform(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(ends))))


def _plant(rng: np.random.Generator) -> Plant:
    """Draw a cylinder with its valve, supply and wall."""
    bore_mm = int(rng.choice(BORES))
    allowed = [stroke for stroke in STROKES if stroke <= LONGEST.get(bore_mm, STROKES[-1])]
    stroke_mm, has_rod = int(rng.choice(allowed)), rng.random() < 0.5
    bore, stroke = bore_mm * 1e-3, stroke_mm * 1e-3
    area = pi / 4 * bore**2
    rod_area = pi / 4 * (RODS[bore_mm] * 1e-3) ** 2 if has_rod else 0.0
    P_s = _log_uniform(rng, SUPPLY)
    speed = min(_log_uniform(rng, SPEED), STROKES_PER_SECOND * stroke)
    force = P_s * area
    cylinder = Cylinder(
        bore,
        stroke,
        area,
        area - rod_area,
        V_d=_log_uniform(rng, DEAD) * area * stroke / 2,
        M=FORCE * force / _log_uniform(rng, ACCELERATION),
        k_f=_log_uniform(rng, VISCOUS) * force / speed,
        x_min=-stroke / 2,
        x_max=stroke / 2,
        load=-rod_area * P_ATM,
        coulomb=rng.uniform(*COULOMB) * force,
    )
    conditions = Conditions(P_s, P_ATM, T_AMB, T_AMB, equilibrium_pressure(P_s, P_ATM, AIR), T_AMB)
    k_0 = _log_uniform(rng, LAMBDA_0) * heat_area(0.0, cylinder)  # (12)
    plant = Plant(AIR, Valve(1.0, U_MAX), conditions, cylinder, k_0)
    return plant._replace(valve=Valve(speed / full_speed(plant), U_MAX))


def emptying_time(plant: Plant, u: float) -> float:
    """Time in which sonic flow at a command, V, would empty the dead volume, s."""
    gas, conditions = plant.gas, plant.conditions
    A_t = plant.valve.k_xu * u
    return plant.cylinder.V_d / (gas.sonic_coefficient * gas.R * conditions.T_0**0.5 * A_t)


def random_cylinder(number: int) -> tuple[Experiment, Experiment]:
    """Draw a cylinder and its two runs, in open and in closed loop.

    Parameters
    ----------
    number : int
        From 0; each has its own random numbers.
    """
    rng = np.random.default_rng([ENTROPY, number])
    plant = _plant(rng)
    stroke, speed = plant.cylinder.stroke, full_speed(plant)
    share, gain = _log_uniform(rng, COMMAND), U_MAX / (_log_uniform(rng, FULL_AT) * stroke)
    deviation = _log_uniform(rng, DEVIATION) * stroke
    drives = Drive(False, 0.0, 0.96 * stroke / 2), Drive(True, gain, stroke / 2)
    amplitudes = share * U_MAX, deviation
    holds = (
        _log_uniform(rng, WAY) * stroke / (share * speed),
        _log_uniform(rng, PATIENCE) * deviation / speed,
    )
    found = []
    for i, loop in enumerate(LOOPS):
        hold, largest = float(np.clip(holds[i], *HOLD)), U_MAX if drives[i].closed_loop else amplitudes[i]
        h = min(STEP, emptying_time(plant, largest) / STEPS_PER_EMPTYING)
        length = np.clip(max(TIME_CONSTANTS * thermal_time_constant(plant), HOLDS * hold), *LENGTH)
        steps = min(STEPS, round(float(length) / h))
        signal = Excitation(int(rng.integers(1, 2**31)), amplitudes[i], max(1, round(hold / h)))
        push = Push(0.0, plant.cylinder.x_min, 0.002)  # nothing pushes
        name = f"{number:03}-{loop}"
        found.append(Experiment(name, f"{number:03}", plant, drives[i], signal, push, h, steps, steps))
    return found[0], found[1]


def _run(experiment: Experiment) -> xr.Dataset:
    """One run: errors of the grid by (model, n), both chambers together, and its groups."""
    recording = record(experiment)
    lanes, index = grid_lanes(N, experiment.plant.gas.gamma)
    cells = replay(recording, lanes, EXACT_TRANSPORT, experiment.steps)
    mse = replay_dataset(experiment, N, index, cells)["mse"].mean("chamber", skipna=False)
    status, step = failure(recording.states)
    dataset = mse.drop_vars(["experiment", "cylinder", "loop", "k_0"]).to_dataset()
    dataset["run_status"] = (
        (),
        np.int8(status),
        status_attributes(RUN_STATUS, "what became of the full-order run"),
    )
    failure_time = step * experiment.h if status else np.nan
    dataset["run_failure_time"] = ((), failure_time, {"units": "s", "long_name": "when it failed"})
    for name, value in (groups(experiment) | measured(experiment, recording)).items():
        dataset[name] = ((), value, {"units": "1", "long_name": (GROUPS | MEASURED)[name]})
    return dataset


SIZES = {
    "bore": ("m", "diameter of the piston"),
    "stroke": ("m", "stroke"),
    "rod_share": ("1", "rod's area over the piston's"),
    "P_s": ("Pa", "absolute supply pressure"),
    "lambda_0": ("W m-2 K-1", "heat transfer coefficient at equilibrium"),
}


def sizes(plant: Plant) -> dict[str, float]:
    """What a catalogue and a wall say of a cylinder, in SI units: `SIZES`."""
    c = plant.cylinder
    return {
        "bore": c.bore,
        "stroke": c.stroke,
        "rod_share": 1 - c.A_B / c.A_A,
        "P_s": plant.conditions.P_s,
        "lambda_0": plant.k_0 / heat_area(0.0, c),
    }


def cylinder_cells(number: int) -> xr.Dataset:
    """Both runs of a random cylinder.

    Returns
    -------
    xarray.Dataset
        `mse`, Pa^2, by (loop, model, n); by loop `run_status`, `run_failure_time`, s, and the
        dimensionless groups known before a run and measured in it; the cylinder's `SIZES`.
    """
    both = random_cylinder(number)
    found: xr.Dataset = xr.concat([_run(e) for e in both], xr.Variable("loop", list(LOOPS)))
    for name, value in sizes(both[0].plant).items():
        unit, words = SIZES[name]
        found[name] = ((), value, {"units": unit, "long_name": words})
    duration = [e.steps * e.h for e in both]
    found["duration"] = ("loop", duration, {"units": "s", "long_name": "length of the run"})
    found["step"] = ("loop", [e.h for e in both], {"units": "s", "long_name": "integration step"})
    return found
