"""Signals that drive the valve: Simulink's Random Number block, the PRBS, other signals, the controller.

The generator is MATLAB's v4 normal generator, as documented and as found in code that Simulink
generates: a multiplicative congruential generator with the polar method, second deviate discarded.
"""

from collections.abc import Iterator
from math import sqrt
from typing import Any

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Drive, Excitation

MULTIPLIER, MODULUS = 16807, 2**31 - 1
SCALE = 4.656612875245797e-10  # 1 / MODULUS as the block has it
LARGEST_STATE, STATE_FOR_ZERO = MODULUS - 1, 1144108930


def initial_state(seed: int) -> int:
    """First state of the uniform generator in Simulink's Random Number block, from the block's seed."""
    r = seed >> 16
    t = seed & 0x8000
    state = ((((seed - (r << 16)) + t) << 16) + t + r) % 2**32
    return min(state or STATE_FOR_ZERO, LARGEST_STATE)


def normal_deviates(seed: int) -> Iterator[float]:
    """Yield the standard normal deviates of Simulink's Random Number block for a seed, without end."""
    state = initial_state(seed)

    def uniform() -> float:
        nonlocal state
        state = MULTIPLIER * state % MODULUS
        return 2 * state * SCALE - 1

    while True:
        a, b = uniform(), uniform()
        w = a * a + b * b
        if w <= 1:
            yield sqrt(-2 * core.lib.core_log(w) / w) * a


def reference_series(drive: Drive, excitation: Excitation, steps: int) -> np.ndarray:
    """Reference at the start of each step and at the end of the run, before any reversal: shape (steps + 1,).

    It is a position, m, in closed loop and a command, V, in open loop. Random numbers are held for
    `Excitation.every` steps; the first applies from t = 0.
    """
    amplitude, signal = excitation.amplitude, excitation.signal
    if signal == "sweep":
        k, (low, high) = np.arange(steps + 1), excitation.band
        return amplitude * sine_of_turns(k * (low + (high - low) * k / (2 * steps)))
    if signal == "levels":
        return amplitude * np.resize(np.repeat(excitation.levels, excitation.every), steps + 1)
    deviates = normal_deviates(excitation.seed)
    draws = np.array([next(deviates) for _ in range(steps // excitation.every + 1)])
    two_valued = signal == "prbs" or (signal == "loop's own" and not drive.closed_loop)
    levels = amplitude * (np.sign(draws) if two_valued else draws)
    return np.repeat(levels, excitation.every)[: steps + 1]


def sine_of_turns(turns: np.ndarray) -> np.ndarray:
    """Return sin(2 pi turns) within 4e-16, with the same bits on every processor (`numpy.sin` differs)."""
    r = turns - np.rint(turns)  # exact, as is the next line
    r = np.where(np.abs(r) > 0.25, np.copysign(0.5, r) - r, r)
    angle, series = 2 * np.pi * r, np.ones_like(r)
    for k in range(22, 0, -2):
        series = 1 - angle * angle / (k * (k + 1)) * series
    return angle * series


def reversed_late(u: np.ndarray, draws: np.ndarray, late: float) -> np.ndarray:
    """Command as recorded, V, if each of its reversals is late by the fraction `late` of a sample, 0 to 1.

    `u` is the command and `draws` the sequence before any reversal, V, both of shape (steps + 1,). The
    sample just after a reversal has the new sign with weight 1 - late and the old sign with weight late. New
    draws are not late.
    """
    sign = np.sign(u * draws)
    before = np.concatenate([sign[:1], sign[:-1]])
    return draws * ((1 - late) * sign + late * before)


def command(reference: Any, x: Any, drive: Drive) -> Any:
    """Command to the valve before its limiter, V, of floats or arrays: Figs 4 and 5."""
    if drive.closed_loop:
        return drive.k_p * (reference - x)
    if not drive.each_stage:
        return reference  # reversed, if at all, for the whole step
    forced = np.abs(x) >= drive.x_reverse
    return np.where(forced, -np.sign(x) * np.abs(reference), reference)
