"""Full-order runs on given signals, measured signals, and replays of a model on either."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pneumo.configuration.experiment import Drive, Plant
from pneumo.engineer.model_rate import lane_for
from pneumo.engineer.plants import check_positive
from pneumo.errors import InputError
from pneumo.physics.models import Model, lane_array
from pneumo.simulation.full_order import Recording, command_series, equilibrium, run
from pneumo.simulation.replay import STATUS
from pneumo.simulation.replay import replay as replay_lanes
from pneumo.simulation.signals import EXACT_TRANSPORT, interpolated

OPEN_LOOP = Drive(False, 0.0, np.inf)


class _Column:
    """One column of a run's states, as an attribute of the run."""

    def __init__(self, index: int) -> None:
        self.index = index

    def __get__(self, run: "Run", owner: type) -> np.ndarray:
        return run.recording.states[:, self.index]


class Run(NamedTuple):
    """Signals of a cylinder at every step; those that were not measured are NaN.

    Attributes
    ----------
    recording : Recording
        States, reference and command, with plant and step.
    simulated : bool
        By `simulate`; else measured.
    x, v : numpy.ndarray
        Piston position from mid-stroke, m, and velocity, m/s.
    P_A, T_A, P_B, T_B : numpy.ndarray
        Pressures, Pa, and temperatures, K, in the chambers.
    """

    recording: Recording
    simulated: bool

    x, v, P_A, T_A, P_B, T_B = (_Column(i) for i in range(6))

    @property
    def u(self) -> np.ndarray:
        """Command before the limiter, V."""
        return self.recording.u

    @property
    def t(self) -> np.ndarray:
        """Time from the start, s."""
        return self.recording.h * np.arange(len(self.u))


class Prediction(NamedTuple):
    """Pressures of a reduced model on a run, and their error.

    Attributes
    ----------
    t : numpy.ndarray
        Time, s.
    P_A, P_B : numpy.ndarray
        Pressures by the model, Pa.
    mean_error, mse : numpy.ndarray
        Mean, Pa, and mean square, Pa^2, of the run's minus the model's pressure, chambers A and B.
    status : tuple of str
        "ok", or why a chamber's pressures end in NaN, chambers A and B.
    """

    t: np.ndarray
    P_A: np.ndarray
    P_B: np.ndarray
    mean_error: np.ndarray
    mse: np.ndarray
    status: tuple[str, ...]


def _series(**signals: ArrayLike) -> list[np.ndarray]:
    """Signals as arrays of floats: one-dimensional, finite and of one length."""
    arrays = {name: np.array(values, dtype=float) for name, values in signals.items()}
    length = next(iter(arrays.values())).size
    for name, values in arrays.items():
        if values.ndim != 1 or values.size != length or length < 2 or not np.isfinite(values).all():
            raise InputError(f"{name}: must be one finite number for each step, all signals equally many")
    return list(arrays.values())


def simulate(
    plant: Plant,
    h: float,
    *,
    command: ArrayLike | None = None,
    reference: ArrayLike | None = None,
    k_p: float = 0.0,
) -> Run:
    """Run the full-order system, eqs (1) to (8), from rest in mid-stroke at (P_0, T_0).

    Parameters
    ----------
    h : float
        Step, s; 1 ms in the paper.
    command : array-like
        Command from every step's start on, V.
    reference : array-like
        Instead of a command: position reference from every step's start on, m.
    k_p : float
        Gain of the proportional control that follows the reference, V/m.

    Raises
    ------
    InputError
        If not exactly one of command and reference is given, or a number is out of range.
    """
    check_positive(h=h)
    if command is not None and reference is None:
        drive, (signal,) = OPEN_LOOP, _series(command=command)
    elif reference is not None and command is None:
        check_positive(k_p=k_p)
        drive, (signal,) = Drive(True, float(k_p), np.inf), _series(reference=reference)
    else:
        raise InputError("give either command or reference")
    states = run(equilibrium(plant), signal, 0.0, drive, plant, float(h))
    u = command_series(states, signal, drive)
    return Run(Recording(states, signal, u, drive, plant, float(h)), simulated=True)


def recorded(
    plant: Plant,
    h: float,
    *,
    u: ArrayLike,
    x: ArrayLike,
    v: ArrayLike,
    P_A: ArrayLike | None = None,
    P_B: ArrayLike | None = None,
) -> Run:
    """Run of measured signals, for `replay`.

    Parameters
    ----------
    h : float
        Time between samples, s.
    u, x, v : array-like
        Command, V, position, m, and velocity, m/s, at every sample, from rest at P_0 on.
    P_A, P_B : array-like
        Pressures, Pa, to compare with; where None, errors are NaN.

    Raises
    ------
    InputError
        If a signal has a wrong shape or numbers that are not finite.
    """
    check_positive(h=h)
    u, x, v = _series(u=u, x=x, v=v)
    states = np.full((len(u), 6), np.nan)
    states[:, 0], states[:, 1] = x, v
    for column, (name, P) in zip((2, 4), {"P_A": P_A, "P_B": P_B}.items(), strict=True):
        if P is not None:
            states[:, column] = _series(u=u, **{name: P})[1]
    return Run(Recording(states, np.zeros(len(u)), u, OPEN_LOOP, plant, float(h)), simulated=False)


def replay(model: Model | str, n: float | None, run: Run) -> Prediction:
    """Replay a reduced model on a run, Fig. 6, from P_0 on.

    The model sees the signals of a simulated run exactly at every stage of the integrator; measured samples
    are interpolated linearly.

    Raises
    ------
    InputError
        If there is no such model, or n is missing or out of range.
    """
    lanes = lane_array([lane_for(model, n, run.recording.plant)])
    replayed = replay_lanes(run.recording, lanes, EXACT_TRANSPORT if run.simulated else interpolated())
    P_A, P_B = replayed.pressure[0]
    status = tuple(STATUS[int(code)] for code in replayed.status[0])
    return Prediction(run.t, P_A, P_B, replayed.mean_error[0], replayed.mse[0], status)
