# pyright: basic
"""The full-order system behind sensors and a sampled controller: commands are held from sample to sample."""

import numpy as np

from pneumo.configuration.experiment import Drive, Experiment, Plant
from pneumo.physics.valve import chamber_flows, limited
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.excitation import command, reference_series, reversed_at
from pneumo.simulation.full_order import Recording, compiled_run, copy_state, equilibrium

HELD = Drive(False, 0.0, np.inf, each_stage=False)  # the reference is the command, for the whole sample
X_STEP = 1e-5  # m, of the position sensor
PRESSURE_RANGE, PRESSURE_BITS = 1e6, 12  # Pa, absolute, of the pressure sensors
PRESSURE_STEP = PRESSURE_RANGE / 2**PRESSURE_BITS  # Pa
PRESSURE_NOISE = 1e3  # Pa, standard deviation of their white noise
X_VARIANCE = X_STEP**2 / 12  # m^2: rounding is uniform
PRESSURE_VARIANCE = PRESSURE_NOISE**2 + PRESSURE_STEP**2 / 12  # Pa^2


@inlined
def rounded(value: float, step: float) -> float:
    """Value rounded to the resolution of a sensor."""
    return step * np.round(value / step)


@inlined
def pressure_read(P: float, noise: float) -> float:
    """Reading of a pressure sensor, Pa: with noise, Pa, in steps of 12 bits, and clipped to its range."""
    return min(max(rounded(P + noise, PRESSURE_STEP), 0.0), PRESSURE_RANGE)


@inlined
def air_from_supply(u: float, y: np.ndarray, plant: Plant) -> float:
    """Mass flow from the supply into the chamber that the command u, V, opens to it, kg/s."""
    if u >= 0:
        return chamber_flows(u, y[2], y[3], plant.valve, plant.gas, plant.conditions)[0]
    return chamber_flows(-u, y[4], y[5], plant.valve, plant.gas, plant.conditions)[0]


@kernel
def held_step(
    y: np.ndarray, u: float, force: float, plant: Plant, h: float, most_halvings: int
) -> tuple[np.ndarray, int]:
    """States one sample (h s) later, and how often the step was halved; u, V, and force, N, are constant."""
    done = compiled_run(y, np.array([u, u]), force, HELD, plant, h, most_halvings)
    return done.states[1], done.halvings[0]


@kernel
def _sampled(
    y_0: np.ndarray, reference: np.ndarray, drive: Drive, plant: Plant, h: float, most_halvings: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    steps, sign = len(reference) - 1, 1.0
    states, u, halvings = np.empty((steps + 1, 6)), np.empty(steps + 1), np.zeros(steps, np.int8)
    copy_state(y_0, states[0])
    for k in range(steps + 1):
        x = rounded(states[k, 0], X_STEP)
        now, sign = reversed_at(x, reference[k], sign, drive)
        u[k] = limited(command(now, x, drive), plant.valve.u_max)
        if k < steps:
            after, halvings[k] = held_step(states[k], u[k], 0.0, plant, h, most_halvings)
            copy_state(after, states[k + 1])
    return states, u, halvings


def sampled_recording(experiment: Experiment, seed: int, steps: int) -> Recording:
    """Run an experiment with another seed of its reference, and record it at every sample.

    A sample is one step of the experiment: the position is read there, and the command held until the next.
    """
    e = experiment
    reference = reference_series(e.drive, e.excitation._replace(seed=seed), steps)
    states, u, halvings = _sampled(equilibrium(e.plant), reference, e.drive, e.plant, e.h, e.most_halvings)
    return Recording(
        states=states,
        reference=u,
        u=u,
        drive=HELD,
        plant=e.plant,
        h=e.h,
        halvings=halvings,
        most_halvings=e.most_halvings,
    )


def readings(states: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Sensor readings of a run: position, m, shape (samples,); pressures, Pa, shape (samples, chamber)."""
    P = states[:, [2, 4]] + PRESSURE_NOISE * rng.standard_normal((len(states), 2))
    P = np.clip(PRESSURE_STEP * np.round(P / PRESSURE_STEP), 0.0, PRESSURE_RANGE)
    return X_STEP * np.round(states[:, 0] / X_STEP), P
