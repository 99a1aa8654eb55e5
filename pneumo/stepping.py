"""A cylinder that a controller drives step by step, by the full order or a reduced model, with sensors."""

from __future__ import annotations  # or `help` would spell out the types

from collections.abc import Callable, Mapping
from math import ceil, floor, isfinite
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.arguments import number, whole_number
from pneumo.configuration.experiment import MOST_HALVINGS, Plant
from pneumo.configuration.sampling import INTERPOLATED
from pneumo.equations.named_model import FULL_ORDER, lane_for
from pneumo.errors import InputError, RunError, shown
from pneumo.physics.cylinder import acceleration, motion, stopped, with_spring
from pneumo.physics.models import Lane, Model, lane_array, temperature
from pneumo.physics.valve import Conditions
from pneumo.runs import OPEN_LOOP, State, start_state
from pneumo.selection.plants import load_plant
from pneumo.simulation.full_order import RUN_STATUS, Recording, core_recording, core_sampling, failure

if TYPE_CHECKING:
    from control import NonlinearIOSystem

NONE: Mapping[str, float] = MappingProxyType({})
PISTON_STEP = 5e-4  # s, longest between the piston and the pressures of a reduced model
ROUNDING = 1e-6  # of a step, in comparisons of times

# State after a step, from that before, the command, V, the force, N, and the step, s.
Advance = Callable[[State, float, float, float], State]


class Sensors(NamedTuple):
    """Sensors of a `Simulation`; signals are named as the fields of `State`."""

    noise: Mapping[str, float] = NONE  #: standard deviation by signal, in its SI unit; others have none
    resolution: Mapping[str, float] = NONE  #: by signal: readings are multiples of it
    sample_time: float = 0.0  #: s, between readings, held until the next; 0: at every step
    seed: int = 0  #: of the noise


def _checked(sensors: object) -> Sensors:
    if not isinstance(sensors, Sensors):
        raise InputError(f"sensors = {shown(sensors)}: must be pneumo.Sensors, or None")
    for field in ("noise", "resolution"):
        signals = getattr(sensors, field)
        if not isinstance(signals, Mapping):
            raise InputError(f"sensors: {field} = {shown(signals)}: must be numbers by signal")
        for signal, value in signals.items():
            if signal not in State._fields:
                names = ", ".join(State._fields)
                raise InputError(f"sensors: {field} of {shown(signal)}: no such signal; there are {names}")
            number(f"sensors: {field} of {signal}", value, 0.0)
    number("sensors: sample_time", sensors.sample_time, 0.0)
    whole_number("sensors: seed", sensors.seed, 0, 2**63 - 1)
    return sensors


def _full_order(plant: Plant) -> Advance:
    """Steps of the full order, as `simulate` makes them."""
    new = core.ffi.new
    before, states, halvings, reference = map(new, ("double[6]", "double[12]", "int8_t[1]", "double[2]"))
    drive, of_plant, no_u_B = core.struct("Drive", OPEN_LOOP), core.struct("Plant", plant), core.ffi.NULL

    def advance(state: State, u: float, force: float, h: float) -> State:
        before[0:6] = state
        reference[0] = u
        core.lib.run(before, reference, no_u_B, 1, force, drive, of_plant, h, MOST_HALVINGS, states, halvings)
        return State(*core.ffi.unpack(states + 6, 6))

    return advance


def _reduced(plant: Plant, lane: Lane) -> Advance:
    """Steps in which a reduced model gives the pressures that move the piston.

    In each part of a step the piston moves with constant acceleration; the core replays the chambers on that
    motion; the mean of the accelerations before and after gives the velocity.
    """
    c, cylinder = plant.conditions, plant.cylinder
    motions, commands = np.zeros((2, 6)), np.zeros(2)
    recording = core_recording(
        Recording(motions, np.zeros(2), commands, OPEN_LOOP, plant, 0.0, np.zeros(1, np.int8), MOST_HALVINGS)
    )
    sampling, row = core_sampling(INTERPOLATED), core.rows("lanes", lane_array([lane]), "Lane")
    kinds = "double[4]", "double[4]", "int64_t[2]", "double[4]", "double[6]"
    chambers, *others = map(core.ffi.new, kinds)
    in_turn = core.keep(core.struct("LanesInTurn", (row, 1, 1, chambers, *others)), row, *others)

    def part(state: State, force: float, h: float) -> State:
        x, v, *before = state
        pushed = with_spring(force, x, cylinder)
        dx, dv = motion(x, v, acceleration(v, state.P_A, state.P_B, pushed, cylinder), cylinder)
        x_end = min(max(x + h * (dx + h / 2 * dv), cylinder.x_min), cylinder.x_max)
        motions[:, 0] = x, x_end
        motions[:, 1] = dx, 2 * (x_end - x) / h - dx
        chambers[0:4] = before
        recording.h = h
        core.lib.replay_scalar(recording, sampling, in_turn)
        P_A, P_B = chambers[0], chambers[2]
        if not (P_A > 0 and P_B > 0):
            return State(x_end, v, P_A, c.T_0, P_B, c.T_0)
        v_end = v + h * dv
        pushed = with_spring(force, x_end, cylinder)
        _, dv_end = motion(x_end, v_end, acceleration(v_end, P_A, P_B, pushed, cylinder), cylinder)
        x, v = stopped(x_end, v + h / 2 * (dv + dv_end), v, cylinder)
        return _with_temperatures(State(x, v, P_A, c.T_0, P_B, c.T_0), c, lane)

    def advance(state: State, u: float, force: float, h: float) -> State:
        commands[:] = u
        parts = ceil(h / PISTON_STEP - ROUNDING)
        for _ in range(parts):
            state = part(state, force, h / parts)
        return state

    return advance


def _with_temperatures(state: State, c: Conditions, lane: Lane) -> State:
    """State with the temperatures that a reduced model gives its pressures, eq (6)."""
    T_A, T_B = (temperature(P, c.P_0, c.T_0, lane.a) for P in (state.P_A, state.P_B))
    return state._replace(T_A=T_A, T_B=T_B)


class Simulation:
    """A cylinder with valve and piston that is simulated step by step, for a controller of your own.

    Parameters
    ----------
    plant : Plant or path
        The plant, or a configuration with one.
    model : str or Model
        "full", the full order, eqs (1) to (8), whose steps are those of `simulate` to the last bit; or a
        reduced model, by eqs (1) to (3), (6) and (10).
    n : float
        Polytropic index of a reduced model that has one.
    start : State or str
        State at the start, or a name as in `simulate`. A reduced model assigns its own temperatures.
    h : float
        Longest step of the integration, s.
    sensors : Sensors
        What `measured` reads; None: the state itself.

    Raises
    ------
    InputError
        If there is no such model, or a number is out of range.

    Attributes
    ----------
    state : State
        State after the last step.
    t : float
        Time since the start, s.
    """

    def __init__(
        self,
        plant: Plant | Path | str,
        *,
        model: Model | str = FULL_ORDER,
        n: float | None = None,
        start: State | str = "rest",
        h: float = 1e-3,
        sensors: Sensors | None = None,
    ) -> None:
        plant = plant if isinstance(plant, Plant) else load_plant(plant)
        self.h = number("h", h, 0.0, above=True)
        if plant.sag:
            raise InputError(
                f"supply.sag = {plant.sag:g}: a simulation step by step has a constant supply; leave it out,"
                " or use simulate"
            )
        lane, first = lane_for(model, n, plant), start_state(plant, start)
        self._sensors = None if sensors is None else _checked(sensors)
        if model == FULL_ORDER:
            self._advance = _full_order(plant)
        else:
            first = _with_temperatures(first, plant.conditions, lane)
            self._advance = _reduced(plant, lane)
        self._start = first
        self.reset()

    def reset(self) -> State:
        """Return to the start, with the sensors' noise from its seed; returns the state."""
        self.t = 0.0
        self.state = self._start
        self._noise = np.random.default_rng(self._sensors.seed if self._sensors else 0)
        self._next_sample = 0.0
        self._read()
        return self.state

    def step(self, u: float, dt: float | None = None, *, force: float = 0.0) -> State:
        """Hold a command for a time and return the state after it.

        Parameters
        ----------
        u : float
            Command, V; positive connects chamber A to the supply.
        dt : float
            Time, s; None: h. A longer one is divided into equal steps of at most h.
        force : float
            External force on the piston, N, towards a larger chamber A.

        Raises
        ------
        InputError
            If a number is not finite, or dt not positive.
        RunError
            If the state leaves the finite or positive numbers; `state` is then the last possible one.
        """
        u, force = number("u", u), number("force", force)
        dt = self.h if dt is None else number("dt", dt, 0.0, above=True)
        steps = ceil(dt / self.h - ROUNDING)
        h = self.h if abs(dt - steps * self.h) < ROUNDING * self.h else dt / steps
        for _ in range(steps):
            self.state = self._after(self.state, u, force, h, self.t)
            self.t += h
            self._read()
        return self.state

    def _after(self, state: State, u: float, force: float, h: float, t: float) -> State:
        """State one step after another; `RunError`, with the time t, if it is not possible."""
        after = self._advance(state, u, force, h)
        if not (min(after[2:]) > 0 and all(map(isfinite, after))):
            status, _ = failure(np.array([self._start, after]))
            raise RunError(f"{RUN_STATUS[status]} at {t:.4g} s: check start, plant and step, {h:g} s")
        return after

    def to_nlsys(self) -> NonlinearIOSystem:
        """System in discrete time for python-control, with the steps of this simulation.

        Its sample time is h, its inputs are `u` and `force`, its states and outputs the fields of `State`. It
        has no sensors; its start is yours: ``X0=sim.state``.

        Raises
        ------
        ImportError
            If python-control is not installed: ``pip install 'pneumo[control]'``.
        """
        import control

        def update(t: float, x: np.ndarray, inputs: np.ndarray, _: object) -> State:
            u, force = inputs.tolist()
            return self._after(State(*x.tolist()), u, force, self.h, t)

        fields = list(State._fields)
        return control.nlsys(
            update, inputs=["u", "force"], states=fields, outputs=fields, dt=self.h, name="cylinder"
        )

    def measured(self) -> State:
        """Latest readings of the sensors, in SI units."""
        return self._readings

    def _read(self) -> None:
        """Take readings if they are due: at multiples of the sample time since the start."""
        sensors, tolerance = self._sensors, ROUNDING * self.h
        if sensors is None:
            self._readings = self.state
            return
        if self.t < self._next_sample - tolerance:
            return
        if sensors.sample_time:
            self._next_sample = sensors.sample_time * (floor((self.t + tolerance) / sensors.sample_time) + 1)
        readings = dict[str, float]()
        for signal, draw in zip(State._fields, self._noise.standard_normal(6).tolist(), strict=True):
            reading = getattr(self.state, signal) + sensors.noise.get(signal, 0.0) * draw
            resolution = sensors.resolution.get(signal, 0.0)
            readings[signal] = resolution * round(reading / resolution) if resolution else reading
        self._readings = State(**readings)
