# pyright: basic
"""Replay of the full-order equations of the chambers: it errs only where the signals are sampled."""

from typing import Any

import numpy as np

from pneumo.configuration.sampling import Sampling
from pneumo.physics.cylinder import chamber_of, sign_of
from pneumo.simulation.compiled import inlined, kernel
from pneumo.simulation.full_order import Recording, chamber_rates
from pneumo.simulation.runge_kutta import STAGES, dormand_prince
from pneumo.simulation.signals import stage_inputs


@inlined
def _state_rates(y: np.ndarray, i: int, context: Any, dy: np.ndarray) -> None:
    inputs, sign, chamber, plant = context
    u, x, v = sign * inputs[i, 0], sign * inputs[i, 1], sign * inputs[i, 2]
    dy[0], dy[1] = chamber_rates(u, x, v, y[0], y[1], chamber, plant)


_chamber_step = dormand_prince(_state_rates)


@kernel
def _replay_chambers(recording: Recording, sampling: Sampling, stride: int) -> np.ndarray:
    steps, plant = len(recording.states) - 1, recording.plant
    pressure = np.empty((2, steps // stride + 1))
    inputs, y, Y, K = (
        np.empty((STAGES + 1, 3)),
        np.empty(6),
        np.empty((STAGES + 1, 6)),
        np.empty((STAGES + 1, 6)),
    )
    Y_chamber, K_chamber, state = np.empty((STAGES, 2)), np.empty((STAGES, 2)), np.empty((2, 2))
    for side in range(2):
        state[side] = recording.states[0, 2 + 2 * side : 4 + 2 * side]
    pressure[:, 0] = state[:, 0]
    for k in range(steps):
        stage_inputs(recording, sampling, k, 0, 1, y, Y, K, inputs)
        for side in range(2):
            context = (inputs, sign_of(side), chamber_of(plant.cylinder, side), plant)
            _chamber_step(state[side], context, recording.h, Y_chamber, K_chamber, state[side])
        if (k + 1) % stride == 0:
            pressure[:, (k + 1) // stride] = state[:, 0]
    return pressure


def replay_chambers(recording: Recording, sampling: Sampling, stride: int = 1) -> np.ndarray:
    """Integrate the full-order equations of both chambers on the recorded command, position and velocity.

    `sampling` says how each Runge-Kutta stage reads these signals; `stride` is the number of steps between
    stored pressures. Returns pressures, Pa, shape (chamber, stored steps).
    """
    return _replay_chambers(recording, sampling, stride)
