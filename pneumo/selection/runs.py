"""Full-order runs on given signals, measured signals, and replays of a model on either."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pneumo.configuration.experiment import MOST_HALVINGS, Drive, Plant
from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED
from pneumo.equations.chamber_rate import lane_for
from pneumo.errors import InputError
from pneumo.physics.models import Model, lane_array
from pneumo.selection.plants import check_positive
from pneumo.simulation.full_order import STATE, Recording, command_series, equilibrium, run
from pneumo.simulation.replay import STATUS
from pneumo.simulation.replay import replay as replay_lanes

OPEN_LOOP = Drive(False, 0.0, np.inf)


def _column(name: str, doc: str) -> Any:
    return property(lambda run: run.recording.states[:, STATE.index(name)], doc=doc)


class Run(NamedTuple):
    """Signals of a cylinder at every step, simulated or measured; NaN for signals that were not measured."""

    recording: Recording  #: states, reference and command, with plant and step
    simulated: bool  #: by `simulate`; else measured

    x, v = _column("x", "Piston position from mid-stroke, m."), _column("v", "Piston velocity, m/s.")
    P_A, P_B = (_column(f"P_{side}", f"Pressure in chamber {side}, Pa.") for side in "AB")
    T_A, T_B = (_column(f"T_{side}", f"Temperature in chamber {side}, K.") for side in "AB")

    @property
    def u(self) -> np.ndarray:
        """Command before the limiter, V."""
        return self.recording.u

    @property
    def t(self) -> np.ndarray:
        """Time from the start, s."""
        return self.recording.h * np.arange(len(self.u))


class Prediction(NamedTuple):
    """Pressures of a reduced model on a run, and their errors, each a pair: chamber A, chamber B."""

    t: np.ndarray  #: time, s
    P_A: np.ndarray  #: pressure by the model, Pa
    P_B: np.ndarray  #: the same of chamber B
    mean_error: np.ndarray  #: mean of the run's minus the model's pressure, Pa: a pair
    mse: np.ndarray  #: mean of its square, Pa^2: a pair
    status: tuple[str, ...]  #: "ok", or why a chamber's pressures end in NaN: a pair


def _series(**signals: ArrayLike) -> dict[str, np.ndarray]:
    """Signals as arrays of floats: one-dimensional, finite and of one length."""
    arrays = {name: np.array(values, dtype=float) for name, values in signals.items()}
    length = next(iter(arrays.values())).size
    for name, values in arrays.items():
        if values.ndim != 1 or values.size != length or length < 2 or not np.isfinite(values).all():
            raise InputError(
                f"{name}: must be one-dimensional, finite, and of equal length for all signals, at least 2"
            )
    return arrays


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
        Command, V, one value for each step, held during it.
    reference : array-like
        Instead of a command: position reference, m, one value for each step, held during it.
    k_p : float
        Gain of the proportional control that follows the reference, V/m.

    Raises
    ------
    InputError
        If not exactly one of command and reference is given, or a number is out of range.
    """
    check_positive(h=h)
    if command is not None and reference is None:
        drive, signal = OPEN_LOOP, _series(command=command)["command"]
    elif reference is not None and command is None:
        check_positive(k_p=k_p)
        drive, signal = Drive(True, float(k_p), np.inf), _series(reference=reference)["reference"]
    else:
        raise InputError("command, reference: give exactly one")
    states, signal, halvings = run(equilibrium(plant), signal, 0.0, drive, plant, float(h), MOST_HALVINGS)
    u = command_series(states, signal, drive)
    recording = Recording(
        states=states,
        reference=signal,
        u=u,
        drive=drive,
        plant=plant,
        h=float(h),
        halvings=halvings,
        most_halvings=MOST_HALVINGS,
    )
    return Run(recording, simulated=True)


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
    """Make a `Run` of measured signals, for `replay`.

    Parameters
    ----------
    h : float
        Time between samples, s.
    u, x, v : array-like
        Command, V, position, m, and velocity, m/s, at every sample. At the first one the piston is at rest
        and both pressures are the plant's P_0.
    P_A, P_B : array-like
        Measured pressures, Pa, with which a replay is compared; its errors are NaN without them.

    Raises
    ------
    InputError
        If a signal has a wrong shape or numbers that are not finite.
    """
    check_positive(h=h)
    measured = {name: P for name, P in (("P_A", P_A), ("P_B", P_B)) if P is not None}
    signals = _series(u=u, x=x, v=v, **measured)
    u, states = signals["u"], np.full((len(signals["u"]), len(STATE)), np.nan)
    for name in ("x", "v", *measured):
        states[:, STATE.index(name)] = signals[name]
    reference, halvings = np.zeros(len(u)), np.zeros(len(u) - 1, dtype=np.int8)
    recording = Recording(
        states=states,
        reference=reference,
        u=u,
        drive=OPEN_LOOP,
        plant=plant,
        h=float(h),
        halvings=halvings,
        most_halvings=MOST_HALVINGS,
    )
    return Run(recording, simulated=False)


def replay(model: Model | str, n: float | None, run: Run) -> Prediction:
    """Integrate a reduced model from P_0 on the command, position and velocity of a run, Fig. 6.

    Signals of a simulated run are those at every stage of its integrator; measured samples are interpolated
    linearly.

    Raises
    ------
    InputError
        If there is no such model, or n is missing or out of range.
    """
    lanes = lane_array([lane_for(model, n, run.recording.plant)])
    replayed = replay_lanes(run.recording, lanes, EXACT_SAMPLING if run.simulated else INTERPOLATED)
    P_A, P_B = replayed.pressure[0]
    status = tuple(STATUS[int(code)] for code in replayed.status[0])
    return Prediction(run.t, P_A, P_B, replayed.mean_error[0], replayed.mse[0], status)
