"""Extended Kalman filter that estimates motion, pressures and, optionally, temperatures and k_0.

It predicts by eq (3) and a reduced model or the full order, with one step of the midpoint rule per sample.
"""

from typing import NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Plant
from pneumo.physics.models import Lane

# Temperatures are states of the full order only, k_0 only where it is asked for.
STATES = ("x", "v", "P_A", "P_B", "T_A", "T_B", "ln k_0")
SIZE, LN_K_0 = len(STATES), 6
# First estimate's standard deviations and steps of derivatives, as in kalman.c and in exported observers
FIRST_PRESSURE = 2e4  # Pa, of either pressure
FIRST_TEMPERATURE = 5.0  # K, likewise
DX, DV, DP, DT = 1e-4, 1e-2, 1e-3, 0.1  # strokes; m/s; P_0; K


class Noise(NamedTuple):
    """White noise that a filter assumes, of the process and of the readings."""

    force: float  #: N s^0.5, on the piston
    pressure: float  #: Pa/s^0.5, on the rate of either pressure, and over P_0 on T/T_0
    x_variance: float  #: m^2, of the position's readings
    pressure_variance: float  #: Pa^2, of the pressures' readings


class FilterModel(NamedTuple):
    """The model by which a filter predicts."""

    estimates_k_0: bool  #: whether ln k_0 is a state, relative to the plant's
    lane: Lane  #: coefficients of a reduced model, or of the full order, with both temperatures as states


def estimated(
    x: np.ndarray,
    P: np.ndarray,
    u: np.ndarray,
    first: np.ndarray,
    model: FilterModel,
    plant: Plant,
    noise: Noise,
    h: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimates of `STATES` at every sample, corrected by its readings, and their variances: (samples, 7).

    Parameters
    ----------
    x, P : numpy.ndarray
        Readings: position, m, shape (samples,), and pressures, Pa, shape (samples, 2); NaN: not measured.
    u : numpy.ndarray
        Limited command held from each sample on, V.
    first : numpy.ndarray
        First estimate of P_A and P_B, Pa.
    """
    samples = len(x)
    estimates, variances = np.empty((samples, SIZE)), np.zeros((samples, SIZE))
    core.lib.kalman_filter(
        core.array("x", x, (samples,)),
        core.array("P", P, (samples, 2)),
        core.array("u", u, (samples,)),
        core.array("first", first, (2,)),
        samples,
        core.struct("FilterModel", model),
        core.struct("Plant", plant),
        core.struct("Noise", noise),
        h,
        core.out(estimates),
        core.out(variances),
    )
    return estimates, variances
