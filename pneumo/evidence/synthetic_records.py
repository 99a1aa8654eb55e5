"""Random cylinders of catalogue sizes, and what sensors would report of them: truth for `pneumo fit`.

A digital controller with a proportional gain follows random steps. It holds its command between samples and
logs it; position and pressures are logged with white noise and quantised.
"""

from math import pi
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from pneumo.configuration.experiment import Drive, Plant
from pneumo.engineer.plants import plant as plant_of
from pneumo.physics.cylinder import Cylinder, heat_area
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation.full_order import equilibrium, run
from pneumo.simulation.given_inputs import pressures_on_inputs
from pneumo.simulation.tableau import DORMAND_PRINCE

BORES = (8e-3, 0.1)  # m
STROKES = (25e-3, 1.0)  # m
SUPPLIES = (5e5, 9e5)  # Pa, absolute
SPEEDS = (0.3, 1.0)  # m/s, at full command, though at most
SPEED_PER_STROKE = 8.0  # strokes per second
LAMBDA_0 = (15.0, 100.0)  # W/(m^2 K)
DEAD_FRACTION = (0.08, 0.3)  # dead volume over that of half the stroke
GUESS = (0.7, 1.4)  # configured over true valve coefficient
N = (1.05, 1.38)
NOISES = (1e-3, 1e-2)  # standard deviation over full scale
BITS = (12, 16)
RATES = (100.0, 200.0, 500.0, 1000.0, 2000.0)  # Hz
FULL_SCALE = 1e6  # Pa, of the pressure sensors; that of the position is the stroke
U_MAX = 10.0  # V
WARM_UP, LENGTH = 0.5, 10.0  # s: before the record begins, and the record
FINE = 2.5e-4  # s, step of the truth


class Case(NamedTuple):
    """A measurement with known truth.

    Attributes
    ----------
    truth : Plant
        With the true k_0 and k_xu; its V_d is that of the full-order run.
    configured : Plant
        What the user believes: another valve coefficient and dead volume, any k_0.
    n : float
        Index of a reduced model's truth.
    V_d : tuple of float
        Dead volumes of chambers A and B in the reduced model's truth, m^3.
    period, noise : float
        Time between samples, s, and standard deviation of the noise over full scale.
    bits : int
        Of the converters.
    u, x : numpy.ndarray
        As logged, V and m, shape (samples,).
    P : numpy.ndarray
        As logged, Pa, shape (chamber, samples): of the full-order system.
    P_exact : numpy.ndarray
        The same before the sensors.
    x_exact : numpy.ndarray
        The position before its sensor.
    """

    truth: Plant
    configured: Plant
    n: float
    V_d: tuple[float, float]
    period: float
    noise: float
    bits: int
    u: np.ndarray
    x: np.ndarray
    P: np.ndarray
    P_exact: np.ndarray
    x_exact: np.ndarray


def _log_uniform(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(ends))))


def plants(rng: np.random.Generator) -> tuple[Plant, Plant]:
    """Draw a cylinder with its valve, and what its user believes of it."""
    bore, stroke, P_s = _log_uniform(rng, BORES), _log_uniform(rng, STROKES), rng.uniform(*SUPPLIES)
    area = pi / 4 * bore**2
    speed = min(_log_uniform(rng, SPEEDS), SPEED_PER_STROKE * stroke)
    half = area * stroke / 2
    force = 0.3 * P_s * area  # N, which the controller can count on
    friction = rng.uniform(0.3, 1.0) * force / speed
    mass = force / _log_uniform(rng, (10.0, 40.0))  # m/s^2
    cylinder = Cylinder(
        bore,
        stroke,
        area,
        area,
        _log_uniform(rng, DEAD_FRACTION) * half,
        mass,
        friction,
        -stroke / 2,
        stroke / 2,
    )
    # At full command the sonic inflow fills what the piston leaves at that speed, at 0.8 P_s.
    k_xu = 0.8 * area * speed / (0.0404 * 287.0 * 293.15**0.5 * U_MAX)
    k_0 = _log_uniform(rng, LAMBDA_0) * heat_area(0.0, cylinder)
    truth = plant_of(cylinder, k_xu=k_xu, u_max=U_MAX, P_s=P_s, k_0=k_0)
    believed = truth.cylinder._replace(V_d=0.15 * half)
    valve = truth.valve._replace(k_xu=k_xu * _log_uniform(rng, GUESS))
    return truth, truth._replace(cylinder=believed, valve=valve, k_0=1.0)


def controlled(rng: np.random.Generator, plant: Plant, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Run the full-order system under the controller.

    Returns
    -------
    states : numpy.ndarray
        At every `FINE`, from rest on.
    u : numpy.ndarray
        Command of every sample, V, held for a period.
    """
    within, samples = round(period / FINE), round((WARM_UP + LENGTH) / period)
    stroke = plant.cylinder.stroke
    speed = plant.valve.k_xu * U_MAX * 0.0404 * 287.0 * 293.15**0.5 / 0.8 / plant.cylinder.A_A
    gain = U_MAX / (0.3 * stroke + 0.1 * speed)
    open_loop, state = Drive(False, 0.0, np.inf), equilibrium(plant)
    states, u = [state[None]], np.empty(samples)
    target, until = 0.0, 0
    for k in range(samples):
        if k >= until:
            target = rng.uniform(-0.42, 0.42) * stroke
            until = k + max(1, round(rng.uniform(0.3, 1.2) * max(0.5, stroke / speed) / period))
        u[k] = np.clip(gain * (target - state[0]), -U_MAX, U_MAX)
        steps = run(state, np.full(within + 1, u[k]), 0.0, open_loop, plant, FINE)
        state = steps[-1]
        states.append(steps[1:])
    return np.concatenate(states), u


def sensed(rng: np.random.Generator, signal: np.ndarray, scale: float, noise: float, bits: int) -> np.ndarray:
    """What a sensor with noise and a converter reports."""
    step = scale / 2**bits
    return np.round((signal + rng.normal(0.0, noise * scale, signal.shape)) / step) * step


def case(seed: int, model: str | None = None) -> Case:
    """Draw a case.

    Parameters
    ----------
    seed : int
    model : str, optional
        Reduced model that makes the true pressures; the full-order system where left out.
    """
    rng = np.random.default_rng(seed)
    truth, configured = plants(rng)
    period, noise = 1 / rng.choice(RATES), _log_uniform(rng, NOISES)
    bits, n = int(rng.integers(BITS[0], BITS[1] + 1)), rng.uniform(*N)
    half = truth.cylinder.A_A * truth.cylinder.stroke / 2
    other = _log_uniform(rng, DEAD_FRACTION) * half if model else truth.cylinder.V_d
    V_d = (truth.cylinder.V_d, other)
    states, u = controlled(rng, truth, period)
    within = round(period / FINE)
    P = states[::within, [2, 4]].T if model is None else reduced(truth, model, n, V_d, states, u)[:, ::within]
    first = round(WARM_UP / period)
    x, P, u = states[::within, 0][first:-1], P[:, first:-1], u[first:]
    return Case(
        truth,
        configured,
        n,
        V_d,
        float(period),
        noise,
        bits,
        sensed(rng, u, 2 * U_MAX, 0.0, bits),
        sensed(rng, x, truth.cylinder.stroke, noise, bits),
        sensed(rng, P, FULL_SCALE, noise, bits),
        P,
        x,
    )


def reduced(
    plant: Plant, model: str, n: float, V_d: tuple[float, float], states: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """Pressures that a reduced model has on a full-order run's motion, Pa, shape (chamber, steps + 1)."""
    steps = len(states) - 1
    t = FINE * np.arange(steps + 1)
    motion = CubicHermiteSpline(t, states[:, 0], states[:, 1])
    at = t[:-1, None] + DORMAND_PRINCE.c * FINE
    command = np.broadcast_to(np.repeat(u, steps // len(u))[:, None], at.shape)
    inputs = np.stack([command, motion(at), motion.derivative()(at)], axis=-1)
    row = lane_array([lane(MODELS[model], n, plant.gas.gamma)])
    result = np.empty((2, steps + 1))
    for side, volume in enumerate(V_d):
        own = plant._replace(cylinder=plant.cylinder._replace(V_d=volume))
        result[side] = pressures_on_inputs(inputs, row, own, FINE, 1)[0, side]
    return result
