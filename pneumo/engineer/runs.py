"""Plants from plain numbers, full-order runs on one's own signals, and replays of a model on them."""

from typing import Any, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Drive, Plant
from pneumo.engineer.model_rate import chosen_lane
from pneumo.errors import InputError
from pneumo.physics.cylinder import Cylinder
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import Model, lane_array
from pneumo.physics.valve import Conditions, Gas, Valve, exact_gas
from pneumo.simulation.full_order import Recording, command_series, equilibrium, run
from pneumo.simulation.replay import STATUS
from pneumo.simulation.replay import replay as replay_lanes
from pneumo.simulation.signals import EXACT_TRANSPORT, interpolated

AIR = exact_gas(287.0, 1.4)


class Run(NamedTuple):
    """Signals of a cylinder, simulated or measured, at every step.

    Attributes
    ----------
    plant : Plant
    drive : Drive or None
        What made the command; None for measured signals.
    h : float
        Step, s.
    recording : Recording
        States, reference and command, as `pneumo.simulate` keeps them.
    """

    plant: Plant
    drive: Drive | None
    h: float
    recording: Recording

    @property
    def t(self) -> np.ndarray:
        """Time from the start, s."""
        return self.h * np.arange(len(self.u))

    @property
    def u(self) -> np.ndarray:
        """Command before the limiter, V."""
        return self.recording.u

    @property
    def x(self) -> np.ndarray:
        """Piston position from the centre, m."""
        return self.recording.states[:, 0]

    @property
    def v(self) -> np.ndarray:
        """Piston velocity, m/s."""
        return self.recording.states[:, 1]

    @property
    def P_A(self) -> np.ndarray:
        """Pressure in chamber A, Pa."""
        return self.recording.states[:, 2]

    @property
    def T_A(self) -> np.ndarray:
        """Temperature in chamber A, K."""
        return self.recording.states[:, 3]

    @property
    def P_B(self) -> np.ndarray:
        """Pressure in chamber B, Pa."""
        return self.recording.states[:, 4]

    @property
    def T_B(self) -> np.ndarray:
        """Temperature in chamber B, K."""
        return self.recording.states[:, 5]


class Prediction(NamedTuple):
    """What a reduced model makes of a run.

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


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} = {value:g}: must be a positive number")


def plant(
    cylinder: Cylinder,
    *,
    k_xu: float,
    u_max: float,
    P_s: float,
    k_0: float,
    P_atm: float = 101325.0,
    T_amb: float = 293.15,
    T_in: float | None = None,
    P_0: float | None = None,
    gas: Gas = AIR,
) -> Plant:
    """Put a cylinder, its valve and its supply together.

    Parameters
    ----------
    cylinder : Cylinder
    k_xu : float
        Area of an open restriction of the valve per volt, m^2/V: eq (2).
    u_max : float
        Limit of the command, V.
    P_s, P_atm : float
        Absolute supply and atmospheric pressure, Pa.
    k_0 : float
        Thermal conductance of each chamber's wall, W/K: eq (12).
    T_amb, T_in : float
        Temperature of the walls and of incoming air (None: the same), K.
    P_0 : float
        Pressure at rest, Pa; None for that of the leaking valve, Appendix 2.
    gas : Gas

    Raises
    ------
    InputError
        If a number is not positive, k_0 is negative, or P_s does not exceed P_atm.
    """
    c = Cylinder._make(float(value) for value in cylinder)._replace(rests=bool(cylinder.rests))
    _positive(k_xu=k_xu, u_max=u_max, P_s=P_s, P_atm=P_atm, T_amb=T_amb)
    _positive(bore=c.bore, stroke=c.stroke, A_A=c.A_A, A_B=c.A_B, V_d=c.V_d, M=c.M)
    if not (np.isfinite(k_0) and k_0 >= 0):
        raise InputError(f"k_0 = {k_0:g} W/K: must not be negative")
    if P_s <= P_atm:
        raise InputError(f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)")
    T_in = T_amb if T_in is None else T_in
    P_0 = equilibrium_pressure(P_s, P_atm, gas) if P_0 is None else P_0
    _positive(T_in=T_in, P_0=P_0)
    conditions = Conditions(*(float(value) for value in (P_s, P_atm, T_in, T_amb, P_0, T_amb)))
    return Plant(gas, Valve(float(k_xu), float(u_max)), conditions, c, float(k_0))


def _series(**signals: Any) -> list[np.ndarray]:
    """Signals as arrays of floats, one-dimensional, finite and of one length."""
    arrays = {name: np.array(values, dtype=float) for name, values in signals.items()}
    length = next(iter(arrays.values())).size
    for name, values in arrays.items():
        if values.ndim != 1 or values.size != length or length < 2 or not np.isfinite(values).all():
            raise InputError(f"{name}: must be one finite number for each step, all signals equally many")
    return list(arrays.values())


def simulate(plant: Plant, h: float, *, command: Any = None, reference: Any = None, k_p: float = 0.0) -> Run:
    """Run the full-order system, eqs (1) to (8), from rest in mid-stroke at (P_0, T_0).

    Parameters
    ----------
    plant : Plant
    h : float
        Step, s; 1 ms in the paper.
    command : array-like
        Command in force from every step's start, V; or instead
    reference : array-like
        Position reference in force from every step's start, m, followed by proportional control
    k_p : float
        with this gain, V/m.

    Raises
    ------
    InputError
        If not exactly one of command and reference is given, or a number is out of range.
    """
    if (command is None) == (reference is None):
        raise InputError("give either command or reference")
    _positive(h=h)
    if reference is None:
        drive, (signal,) = Drive(False, 0.0, np.inf), _series(command=command)
    else:
        _positive(k_p=k_p)
        drive, (signal,) = Drive(True, float(k_p), np.inf), _series(reference=reference)
    states = run(equilibrium(plant), signal, 0.0, drive, plant, float(h))
    u = command_series(states, signal, drive)
    return Run(plant, drive, float(h), Recording(states, signal, u, drive, plant, float(h)))


def recorded(plant: Plant, h: float, *, u: Any, x: Any, v: Any, P_A: Any = None, P_B: Any = None) -> Run:
    """Make a run of measured signals, for `replay`.

    Parameters
    ----------
    plant : Plant
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
    _positive(h=h)
    u, x, v = _series(u=u, x=x, v=v)
    states = np.full((len(u), 6), np.nan)
    states[:, 0], states[:, 1] = x, v
    for column, (name, P) in zip((2, 4), {"P_A": P_A, "P_B": P_B}.items(), strict=True):
        if P is not None:
            states[:, column] = _series(u=u, **{name: P})[1]
    no_drive = Drive(False, 0.0, np.inf)
    return Run(plant, None, float(h), Recording(states, np.zeros(len(u)), u, no_drive, plant, float(h)))


def replay(model: Model | str, n: float | None, run: Run) -> Prediction:
    """Replay a reduced model on a run: Fig. 6.

    On a simulated run the model sees the signals at every stage of the integrator exactly; between measured
    samples they are interpolated linearly. The model starts at P_0.

    Parameters
    ----------
    model : Model or str
        A row of one's own, or the name of one in `MODELS`.
    n : float or None
        Polytropic index.
    run : Run
        From `simulate` or `recorded`.

    Raises
    ------
    InputError
        If there is no such model, or n is missing or out of range.
    """
    lanes = lane_array([chosen_lane(model, n, run.plant)])
    found = replay_lanes(run.recording, lanes, EXACT_TRANSPORT if run.drive else interpolated())
    P_A, P_B = found.pressure[0]
    status = tuple(STATUS[int(code)] for code in found.status[0])
    return Prediction(run.t, P_A, P_B, found.mean_error[0], found.mse[0], status)
