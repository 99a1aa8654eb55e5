"""What drives the valve: Simulink's Random Number block, the PRBS and the proportional controller.

The generator is MATLAB's v4 normal generator, as documented and as found in code that Simulink
generates: a multiplicative congruential generator with the polar method, second deviate discarded.
"""

from collections.abc import Iterator
from math import log, sqrt
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

MULTIPLIER, MODULUS = 16807, 2**31 - 1
SCALE = 4.656612875245797e-10  # 1 / MODULUS as the block has it
LARGEST_STATE, STATE_FOR_ZERO = MODULUS - 1, 1144108930


def initial_state(seed: int) -> int:
    """State of the uniform generator for a block's seed."""
    r = seed >> 16
    t = seed & 0x8000
    state = ((((seed - (r << 16)) + t) << 16) + t + r) % 2**32
    return min(state or STATE_FOR_ZERO, LARGEST_STATE)


def normal_deviates(seed: int) -> Iterator[float]:
    """Yield the block's standard normal deviates for a seed, without end."""
    state = initial_state(seed)

    def uniform() -> float:
        nonlocal state
        state = MULTIPLIER * state % MODULUS
        return 2 * state * SCALE - 1

    while True:
        a, b = uniform(), uniform()
        w = a * a + b * b
        if w <= 1:
            yield sqrt(-2 * log(w) / w) * a


class Drive(NamedTuple):
    """How the command follows from the reference, Figs 4 and 5.

    Attributes
    ----------
    closed_loop : bool
        Proportional control of position, or the open-loop sequence with forced sign.
    k_p : float
        Proportional gain, V/m.
    x_reverse : float
        Distance from the centre at which the open-loop sign is forced back, m.
    """

    closed_loop: bool
    k_p: float
    x_reverse: float


def reference_series(drive: Drive, seed: int, amplitude: float, every: int, steps: int) -> np.ndarray:
    """Reference of every step, held between draws; the first draw applies from t = 0.

    Parameters
    ----------
    drive : Drive
    seed : int
        Seed of the Random Number block.
    amplitude : float
        Standard deviation of the position reference, m, in closed loop; magnitude of the
        two-valued command, V, in open loop.
    every : int
        Steps between draws.
    steps : int
        Number of steps.

    Returns
    -------
    numpy.ndarray
        Shape (steps + 1,): the value in force from each step's start (the last one at the end).
    """
    deviates = normal_deviates(seed)
    draws = np.array([next(deviates) for _ in range(steps // every + 1)])
    levels = amplitude * (draws if drive.closed_loop else np.sign(draws))
    return np.repeat(levels, every)[: steps + 1]


@register_jitable
def command(reference, x, drive):
    """Command to the valve before its limiter, V: Figs 4 and 5."""
    if drive.closed_loop:
        return drive.k_p * (reference - x)
    if x >= drive.x_reverse:
        return -abs(reference)
    if x <= -drive.x_reverse:
        return abs(reference)
    return reference
