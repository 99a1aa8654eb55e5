"""Extended Kalman filter that estimates the pressures, and on request k_0, from measured signals."""

from __future__ import annotations  # or `help` would spell out ArrayLike

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import pneumo.core as core
from pneumo.arguments import check_positive
from pneumo.configuration.experiment import Plant
from pneumo.equations.named_model import FULL_ORDER, lane_for
from pneumo.errors import InputError
from pneumo.physics.models import Model

FORCE_NOISE, PRESSURE_NOISE = 3e-4, 3e3  # process noise: s^0.5, over P_s A_A; Pa/s^0.5
# First estimate's standard deviations and steps of derivatives, as in kalman.c and in exported observers
FIRST_PRESSURE = 2e4  # Pa, of either pressure
FIRST_TEMPERATURE = 5.0  # K, likewise
DX, DV, DP, DT = 1e-4, 1e-2, 1e-3, 0.1  # strokes; m/s; P_0; K


class Estimate(NamedTuple):
    """Estimates of a filter at every sample, corrected by that sample's readings; shape (samples,)."""

    t: np.ndarray  #: time, s
    x: np.ndarray  #: position, m
    v: np.ndarray  #: velocity, m/s
    P_A: np.ndarray  #: pressure in chamber A, Pa
    P_B: np.ndarray  #: pressure in chamber B, Pa
    T_A: np.ndarray  #: temperature in chamber A, K; NaN by a reduced model
    T_B: np.ndarray  #: temperature in chamber B, K; NaN by a reduced model
    k_0: np.ndarray  #: conductance of the wall, W/K; the plant's where it is not estimated
    #: Standard deviations of the errors of (x, v, P_A, P_B, T_A, T_B, ln k_0), as the filter computes them,
    #: shape (samples, 7); 0 for quantities that are not estimated.
    deviation: np.ndarray


def _signal(name: str, values: ArrayLike | None, length: int | None, *, gaps: bool = True) -> np.ndarray:
    if values is None:
        return np.full(length or 0, np.nan)
    array = np.array(values, dtype=float)
    if array.ndim != 1 or array.size < 2 or (length is not None and array.size != length):
        expected = "at least 2 samples" if length is None else f"{length} samples, as u"
        raise InputError(f"{name}: shape {array.shape}: must be one-dimensional with {expected}")
    if np.isinf(array).any() or (not gaps and np.isnan(array).any()):
        raise InputError(f"{name}: must be finite{', or NaN where not measured' if gaps else ''}")
    return array


def ekf(
    model: Model | str,
    n: float | None,
    plant: Plant,
    h: float,
    *,
    u: ArrayLike,
    x: ArrayLike,
    P_A: ArrayLike | None = None,
    P_B: ArrayLike | None = None,
    estimate_k_0: bool = False,
    first: tuple[float, float] | None = None,
    force_noise: float | None = None,
    pressure_noise: float = PRESSURE_NOISE,
    x_deviation: float = 1e-5,
    pressure_deviation: float = 1e3,
) -> Estimate:
    """Estimate both pressures by an extended Kalman filter from measured command, position and pressures.

    The filter's states are (x, v, P_A, P_B), with the full order also (T_A, T_B); it predicts them by eq (3)
    and the model, with one step of the midpoint rule from sample to sample. The command is held between
    samples.

    Parameters
    ----------
    model : Model or str
        A row of `MODELS`, one of your own, the name of one in `MODELS`, or "full" for the full order.
    n : float or None
        Polytropic index; None where the model has none.
    plant : Plant
        Gas, valve, conditions, cylinder and k_0, from `pneumo.plant` or a configuration.
    h : float
        Time between samples, s.
    u, x : array-like
        Command, V, which this function limits, and position, m, at every sample, shape (samples,). x is NaN
        at samples without a reading, but not at the first.
    P_A, P_B : array-like, optional
        Measured pressures, Pa; NaN at samples without a reading, None without a sensor.
    estimate_k_0 : bool
        Whether to estimate k_0, with its logarithm as a further state. It starts at the plant's k_0 and stays
        within a factor of ten of it.
    first : tuple of float, optional
        First estimates of P_A and P_B, Pa; the plant's P_0 if None. Their standard deviation is 20 kPa.
    force_noise : float, optional
        Process noise of the force on the piston, N s^0.5; 3e-4 s^0.5 P_s A_A if None. Choose it larger where
        friction and load are less well known.
    pressure_noise : float
        Process noise of the pressures' rates, Pa/s^0.5. Choose it larger where valve, dead volume and wall
        are less well known. It is the first number to tune.
    x_deviation, pressure_deviation : float
        Standard deviations of the readings of position, m, and of pressure, Pa.

    Returns
    -------
    Estimate
        Estimates at every sample, corrected by its readings, with the standard deviations of their errors as
        the filter computes them.

    Raises
    ------
    InputError
        If there is no such model, n is missing or out of range, a signal has a wrong shape, a number is not
        positive, or k_0 is to be estimated with a model or a plant that has no wall heat.

    Examples
    --------
    Pressures of a simulated run from its position, by the full order with k_0 as a state::

        run = pneumo.simulate(plant, 1e-3, command=u)
        seen = pneumo.ekf("full", None, plant, 1e-3, u=run.u, x=run.x, estimate_k_0=True)
    """
    numbers = {"h": h, "pressure_noise": pressure_noise, "x_deviation": x_deviation}
    if force_noise is not None:
        numbers["force_noise"] = force_noise
    check_positive(**numbers, pressure_deviation=pressure_deviation)
    full, row = model == FULL_ORDER, lane_for(model, n, plant)
    if estimate_k_0 and not (plant.k_0 > 0 and row.wall_scale > 0):
        raise InputError("estimate_k_0: needs a model with wall heat and a plant with k_0 above 0")
    command = np.clip(_signal("u", u, None, gaps=False), -plant.valve.u_max, plant.valve.u_max)
    position = _signal("x", x, len(command))
    if np.isnan(position[0]):
        raise InputError("x: its first sample must be a number")
    P = np.column_stack([_signal(name, P, len(command)) for name, P in (("P_A", P_A), ("P_B", P_B))])
    start = np.array(first or (plant.conditions.P_0,) * 2, dtype=float)
    if start.shape != (2,) or not (np.isfinite(start) & (start > 0)).all():
        raise InputError(f"first = {first}: must be two positive pressures, Pa")
    force = FORCE_NOISE * plant.conditions.P_s * plant.cylinder.A_A if force_noise is None else force_noise
    samples = len(command)
    states, variances = np.empty((samples, 7)), np.empty((samples, 7))  # x, v, P_A, P_B, T_A, T_B, ln k_0
    core.lib.kalman_filter(
        core.array("x", position, (samples,)),
        core.array("P", P, (samples, 2)),
        core.array("u", command, (samples,)),
        core.array("first", start, (2,)),
        samples,
        core.struct("FilterModel", (bool(estimate_k_0), row)),
        core.struct("Plant", plant),
        core.struct("Noise", (force, pressure_noise, x_deviation**2, pressure_deviation**2)),
        h,
        core.out(states),
        core.out(variances),
    )
    deviation = np.sqrt(variances)
    if not full:
        states[:, 4:6], deviation[:, 4:6] = np.nan, 0.0
    if not estimate_k_0:
        deviation[:, 6] = 0.0
    k_0 = plant.k_0 * np.exp(states[:, 6])
    return Estimate(h * np.arange(samples), *states[:, :6].T, k_0=k_0, deviation=deviation)
