# pyright: basic
"""Position control with a reduced model: feedback linearisation on the states of its observer.

In every model the third derivative of the position is linear in ``|u|`` for either sign of the command; the
controller solves it for u. Baseline: P control of the position, without a model.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.evidence.at_work.sampled_plant import X_STEP, air_from_supply, held_step, pressure_read, rounded
from pneumo.physics.cylinder import acceleration
from pneumo.physics.valve import limited
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.full_order import equilibrium
from pneumo.simulation.kalman_filter import (
    SIZE,
    FilterModel,
    Noise,
    correct_all,
    first_estimate,
    model_rates,
    predict,
)

PARTS = {"step": (0.0, 2.0), "sine": (2.0, 5.0), "handling": (5.0, 8.0), "force": (8.0, 10.0)}  # s
DURATION = 10.0  # s
SINE, MOVE, REST = 1.0, 0.5, 0.25  # Hz; s of a move, s after it
SIZES, WAYPOINTS = (0.1, 0.2), 0.3  # of step and sine; of handling, from the middle; over the stroke
PUSH, PUSHED = 0.1, (8.5, 9.5)  # force over P_s A_A; s
P_CONTROL = 0.0  # bandwidth that means the baseline

equilibrium_of = inlined(equilibrium)


class Task(NamedTuple):
    """Reference of the position, and the disturbing force, at every sample."""

    reference: np.ndarray  #: m and its derivatives up to the third, shape (samples, 4)
    force: np.ndarray  #: N, shape (samples,)


class Controller(NamedTuple):
    """Settings of a controller."""

    measured_pressures: int  #: that correct the observer: 0, 1 (P_A) or 2
    bandwidth: float  #: of the four poles, rad/s; 0: P control
    gain: float  #: of P control, V/m
    noise: Noise  #: of the observer


class Controlled(NamedTuple):
    """Result of a task."""

    x: np.ndarray  #: m, at every sample
    u: np.ndarray  #: limited command held from every sample on, V
    air: float  #: from the supply, kg


def minimum_jerk(t: np.ndarray, distance: float, duration: float) -> np.ndarray:
    """Rest-to-rest motion over a distance, m, with its first three derivatives: shape (samples, 4)."""
    s = np.clip(t / duration, 0.0, 1.0)
    moving = (s > 0) & (s < 1)
    derivatives = (
        10 * s**3 - 15 * s**4 + 6 * s**5,
        30 * s**2 - 60 * s**3 + 30 * s**4,
        60 * s - 180 * s**2 + 120 * s**3,
        (60 - 360 * s + 360 * s**2) * moving,
    )
    return distance * np.column_stack([d / duration**k for k, d in enumerate(derivatives)])


def drawn_task(rng: np.random.Generator, plant: Plant, h: float) -> Task:
    """Draw a task: sizes of step and sine, way points, direction of the force; paper/decisions/0049."""
    c = plant.cylinder
    t = h * np.arange(round(DURATION / h) + 1)
    reference, force = np.zeros((len(t), 4)), np.zeros(len(t))
    step, sine = c.stroke * rng.uniform(*SIZES, 2) * rng.choice([-1.0, 1.0], 2)
    (_, step_end), (sine_start, sine_end), (handling_start, _), _ = PARTS.values()
    reference[t < step_end / 2, 0] = step
    during, w = (t >= sine_start) & (t < sine_end), 2 * np.pi * SINE
    phase = w * (t[during] - sine_start)
    waves = np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase), -(w**3) * np.cos(phase)
    reference[during] = sine * np.column_stack(waves)
    places = [0.0, *(c.stroke * rng.uniform(-WAYPOINTS, WAYPOINTS, 3)), 0.0]
    for k, (start, end) in enumerate(pairwise(places)):
        reference += minimum_jerk(t - handling_start - k * (MOVE + REST), end - start, MOVE)
    pushed = (t >= PUSHED[0]) & (t < PUSHED[1])
    force[pushed] = PUSH * plant.conditions.P_s * c.A_A * rng.choice([-1.0, 1.0])
    return Task(reference, force)


@inlined
def third_derivative(y: np.ndarray, a: float, u: float, plant: Plant, model: FilterModel) -> float:
    """Third derivative of the position by the model at acceleration a, m/s^3: eq (3) differentiated."""
    c, dy = plant.cylinder, np.empty(SIZE)
    model_rates(y, u, plant, model, dy)
    return (c.A_A * dy[2] - c.A_B * dy[3] - c.k_f * a) / c.M


@inlined
def linearising_command(
    y: np.ndarray, wanted: np.ndarray, integral: float, bandwidth: float, plant: Plant, model: FilterModel
) -> float:
    """Unlimited command, V, with which the model has all four poles of the position error at -bandwidth.

    `bandwidth` is in rad/s. `wanted` holds the reference and its three derivatives; `integral` is that of
    reference minus position, m s.
    """
    a = acceleration(y[1], y[2], y[3], 0.0, plant.cylinder)
    w, u_max = bandwidth, plant.valve.u_max
    jerk = wanted[3] + 4 * w * (wanted[2] - a) + 6 * w**2 * (wanted[1] - y[1])
    jerk += 4 * w**3 * (wanted[0] - y[0]) + w**4 * integral
    closed = third_derivative(y, a, 0.0, plant, model)
    towards = u_max if jerk > closed else -u_max
    change = third_derivative(y, a, towards, plant, model) - closed
    if change * towards <= 0:  # the valve cannot give this jerk
        return towards
    return towards * (jerk - closed) / change


@kernel
def controlled(
    task: Task,
    sensor_noise: np.ndarray,
    first: np.ndarray,
    controller: Controller,
    model: FilterModel,
    plant: Plant,
    told: Plant,
    smooth: Plant,
    h: float,
    most_halvings: int,
) -> Controlled:
    """Run the full-order system under a controller, from rest in mid-stroke.

    Parameters
    ----------
    sensor_noise : numpy.ndarray
        Noise of the pressure sensors, Pa, shape (samples, 2).
    first : numpy.ndarray
        First estimate of P_A and P_B, Pa.
    told : Plant
        The plant as the observer assumes it.
    smooth : Plant
        `told` without Coulomb friction, for the control law: at rest the sign of the friction is noise.
    """
    samples, noise = len(task.force), controller.noise
    xs, us, air, integral, state = np.empty(samples), np.empty(samples), 0.0, 0.0, equilibrium_of(plant)
    (y, C), W = first_estimate(0.0, first, told, noise), np.empty((4, SIZE, SIZE))
    P, u_max = np.full(2, np.nan), plant.valve.u_max
    for k in range(samples):
        x, wanted = rounded(state[0], X_STEP), task.reference[k]
        if controller.bandwidth > 0:
            for side in range(controller.measured_pressures):
                P[side] = pressure_read(state[2 + 2 * side], sensor_noise[k, side])
            correct_all(y, C, x, P, told, model, noise)
            free = linearising_command(y, wanted, integral, controller.bandwidth, smooth, model)
            if abs(free) < u_max:
                integral += h * (wanted[0] - y[0])
            u = limited(free, u_max)
            predict(y, C, u, told, model, noise, h, W)
        else:
            u = limited(controller.gain * (wanted[0] - x), u_max)
        xs[k], us[k] = state[0], u
        air += h * air_from_supply(u, state, plant)
        state, _ = held_step(state, u, task.force[k], plant, h, most_halvings)
    return Controlled(xs, us, air)


def part_errors(task: Task, done: Controlled, h: float) -> np.ndarray:
    """Mean square of the tracking error in each of `PARTS`, m^2."""
    squares = (done.x - task.reference[:, 0]) ** 2
    return np.array([squares[round(a / h) : round(b / h)].mean() for a, b in PARTS.values()])
