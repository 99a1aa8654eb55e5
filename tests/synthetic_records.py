"""Synthetic records of random cylinders with known parameters, to try `pneumo fit` on.

A digital controller with a proportional gain follows random steps. It holds its command between samples and
logs it; position and pressures are logged with white noise and quantised.
"""

from typing import NamedTuple

import numpy as np
import random_plants as draw
from scipy.interpolate import CubicHermiteSpline

from pneumo.configuration.experiment import Drive, Plant
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation.fitted_pressures import NODES, Inputs, pressures_of_sets
from pneumo.simulation.full_order import equilibrium, run

DEAD_FRACTION = draw.log_uniform(0.08, 0.3)  # dead volume over that of half the stroke
GUESS = draw.log_uniform(0.7, 1.4)  # configured over true valve coefficient
TRUE_N = (1.05, 1.38)
NOISE = draw.log_uniform(1e-3, 1e-2)  # standard deviation over full scale
BITS = (12, 16)
SAMPLE_RATES = (100.0, 200.0, 500.0, 1000.0, 2000.0)  # Hz
FULL_SCALE = 1e6  # Pa, of the pressure sensors; that of the position is the stroke
WARM_UP, LENGTH = 0.5, 10.0  # s: before the record begins, and the record
TRUTH_STEP = 2.5e-4  # s


def any_size(rng: np.random.Generator) -> draw.Size:
    """Draw a bore and stroke between the ends of the catalogues, without a rod."""
    return draw.Size(draw.log_uniform(8e-3, 0.1)(rng), draw.log_uniform(25e-3, 1.0)(rng), 0.0)


RECORD_RANGES = draw.Ranges(
    any_size,
    {
        "P_s": draw.uniform(5e5, 9e5),
        "speed": draw.log_uniform(0.3, 1.0),
        "viscous": draw.uniform(0.3, 1.0),
        "acceleration": draw.log_uniform(10.0, 40.0),
        "dead": DEAD_FRACTION,
        "lambda_0": draw.log_uniform(15.0, 100.0),
    },
    strokes_per_second=8.0,
    reference_force=0.3,  # which the controller can count on
    accelerating_force=1.0,
    P_atm=101325.0,
)


class SyntheticRecord(NamedTuple):
    """A record whose true parameters are known."""

    truth: Plant  #: with the true k_0 and k_xu; its V_d is that of the full-order run
    configured: Plant  #: as the user configures it: another valve coefficient and dead volume, any k_0
    n: float  #: index of a reduced model's truth
    V_d: tuple[float, float]  #: dead volumes of chambers A and B in the reduced model's truth, m^3
    period: float  #: time between samples, s
    noise: float  #: standard deviation over full scale
    bits: int  #: of the converters
    u: np.ndarray  #: as logged, V, shape (samples,)
    x: np.ndarray  #: as logged, m, shape (samples,)
    P: np.ndarray  #: as logged, Pa, shape (chamber, samples)
    P_exact: np.ndarray  #: before the sensors
    x_exact: np.ndarray  #: before the sensor


def true_and_configured_plants(rng: np.random.Generator) -> tuple[Plant, Plant]:
    """Draw a cylinder with its valve, and the plant that its user configures."""
    plant, drawn = draw.random_plant(rng, RECORD_RANGES)
    area, half = plant.cylinder.A_A, plant.cylinder.A_A * plant.cylinder.stroke / 2
    # At full command the sonic inflow fills what the piston leaves at that speed, at 0.8 P_s.
    k_xu = 0.8 * area * drawn["speed"] / (0.0404 * 287.0 * 293.15**0.5 * draw.U_MAX)
    V_d = drawn["dead"] * half  # rounded as V_d of chamber B below
    true_cylinder = plant.cylinder._replace(V_d_A=V_d, V_d_B=V_d)
    truth = plant._replace(cylinder=true_cylinder, valve=plant.valve._replace(k_xu=k_xu))
    configured = true_cylinder._replace(V_d_A=0.15 * half, V_d_B=0.15 * half)
    valve = truth.valve._replace(k_xu=k_xu * GUESS(rng))
    return truth, truth._replace(cylinder=configured, valve=valve, k_0=1.0)


def controlled_run(rng: np.random.Generator, plant: Plant, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Run under the controller from rest: states, shape (steps + 1, 6), and commands, V, shape (samples,).

    States are at every `TRUTH_STEP`; a command holds for one sample, of `period` s.
    """
    within, samples = round(period / TRUTH_STEP), round((WARM_UP + LENGTH) / period)
    stroke = plant.cylinder.stroke
    speed = plant.valve.k_xu * draw.U_MAX * 0.0404 * 287.0 * 293.15**0.5 / 0.8 / plant.cylinder.A_A
    gain = draw.U_MAX / (0.3 * stroke + 0.1 * speed)
    open_loop, state = Drive(False, 0.0, np.inf), equilibrium(plant)
    states, u = [state[None]], np.empty(samples)
    target, until = 0.0, 0
    for k in range(samples):
        if k >= until:
            target = rng.uniform(-0.42, 0.42) * stroke
            until = k + max(1, round(rng.uniform(0.3, 1.2) * max(0.5, stroke / speed) / period))
        u[k] = np.clip(gain * (target - state[0]), -draw.U_MAX, draw.U_MAX)
        steps = run(state, np.full(within + 1, u[k]), 0.0, open_loop, plant, TRUTH_STEP).states
        state = steps[-1]
        states.append(steps[1:])
    return np.concatenate(states), u


def sensed(rng: np.random.Generator, signal: np.ndarray, scale: float, noise: float, bits: int) -> np.ndarray:
    """Return a signal with white noise, `noise` times full scale `scale`, quantised with `bits` bits."""
    step = scale / 2**bits
    return np.round((signal + rng.normal(0.0, noise * scale, signal.shape)) / step) * step


def synthetic_record(seed: int, model: str | None = None) -> SyntheticRecord:
    """Draw a random record; true pressures are those of `model`, or of the full order without one."""
    rng = np.random.default_rng(seed)
    truth, configured = true_and_configured_plants(rng)
    period, noise = 1 / rng.choice(SAMPLE_RATES), NOISE(rng)
    bits, n = int(rng.integers(BITS[0], BITS[1] + 1)), rng.uniform(*TRUE_N)
    half = truth.cylinder.A_A * truth.cylinder.stroke / 2
    V_d = truth.cylinder.V_d_A, DEAD_FRACTION(rng) * half if model else truth.cylinder.V_d_B
    states, u = controlled_run(rng, truth, period)
    pressures = reduced_pressures(truth, model, n, V_d, states, u) if model else states[:, [2, 4]].T
    within, first = round(period / TRUTH_STEP), round(WARM_UP / period)
    x, P, u = states[::within, 0][first:-1], pressures[:, ::within][:, first:-1], u[first:]
    logged = (
        sensed(rng, u, 2 * draw.U_MAX, 0.0, bits),
        sensed(rng, x, truth.cylinder.stroke, noise, bits),
        sensed(rng, P, FULL_SCALE, noise, bits),
    )
    return SyntheticRecord(truth, configured, n, V_d, float(period), noise, bits, *logged, P, x)


def reduced_pressures(
    plant: Plant, model: str, n: float, V_d: tuple[float, float], states: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """Pressures of a reduced model on the motion of a full-order run, Pa, shape (chamber, steps + 1)."""
    steps = len(states) - 1
    t = TRUTH_STEP * np.arange(steps + 1)
    motion = CubicHermiteSpline(t, states[:, 0], states[:, 1])
    at = t[:-1, None] + NODES * TRUTH_STEP
    command = np.broadcast_to(np.repeat(u, steps // len(u))[:, None], at.shape)
    inputs = Inputs(command, np.stack([motion(at), motion.derivative()(at)], axis=-1), plant)
    row = lane_array([lane(MODELS[model], n, plant.gas.gamma)])
    start = np.full((1, 2), plant.conditions.P_0)
    return pressures_of_sets([inputs], np.zeros(1, int), row, np.array([V_d]), TRUTH_STEP, 1, start)[0]
