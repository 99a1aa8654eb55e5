"""Full-order runs on given signals, measured signals, and replays of a model on either."""

from __future__ import annotations  # or `help` would spell out ArrayLike

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pneumo.arguments import check_positive, number
from pneumo.configuration.experiment import MOST_HALVINGS, Drive, Plant
from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED
from pneumo.equations.named_model import lane_for
from pneumo.errors import InputError, RunError, shown
from pneumo.fitting.valve_signal import opened
from pneumo.physics.models import Model, lane_array
from pneumo.physics.symbols import SYMBOLS
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics
from pneumo.publish.text.formatting import lines_html
from pneumo.selection.plants import load_plant, load_rig
from pneumo.simulation.excitation import command as command_of
from pneumo.simulation.full_order import RAN, RUN_STATUS, STATE, Recording, failure, run, supplied_mass
from pneumo.simulation.replay import STATUS
from pneumo.simulation.replay import replay as replay_lanes

if TYPE_CHECKING:  # imported where they are used: they take longer than a run
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

OPEN_LOOP = Drive(False, 0.0, np.inf)
NORMAL = 101325.0, 273.15  # Pa and K, of a normal litre: DIN 1343
MOST_STROKES = 4  # that the text of a run lists


class State(NamedTuple):
    """State of a cylinder: position from mid-stroke, velocity, pressures and temperatures."""

    x: float  #: m
    v: float  #: m/s
    P_A: float  #: Pa, absolute
    T_A: float  #: K
    P_B: float  #: Pa, absolute
    T_B: float  #: K


# Name of a start -> end of the stroke (-1: chamber A is smallest), and the pressures of chambers A and B.
STARTS = {
    "vented": (-1, "P_atm", "P_atm"),
    "retracted": (-1, "P_atm", "P_s"),
    "extended": (1, "P_s", "P_atm"),
    "rest": (0, "P_0", "P_0"),
    "pressurised": (-1, "P_s", "P_s"),
}


def start_state(plant: Plant, start: State | str) -> State:
    """Check a state from which a run shall start, or make that of a name in `STARTS`, all at T_amb.

    Raises
    ------
    InputError
        If there is no such name, or a number is impossible.
    """
    c, cylinder = plant.conditions, plant.cylinder
    if isinstance(start, str):
        if start not in STARTS:
            raise InputError(f"start = {start!r}: must be one of {', '.join(STARTS)}, or a State")
        end, P_A, P_B = STARTS[start]
        x = (cylinder.x_min, 0.0, cylinder.x_max)[end + 1]
        T = c.T_0 if start == "rest" else c.T_amb
        return State(x, 0.0, getattr(c, P_A), T, getattr(c, P_B), T)
    try:
        state = State(*map(float, start))
    except (TypeError, ValueError):
        raise InputError(f"start = {shown(start)}: must be a State, six numbers, or a name") from None
    if not cylinder.x_min <= state.x <= cylinder.x_max:
        limits = f"{cylinder.x_min:g} to {cylinder.x_max:g} m from mid-stroke"
        raise InputError(f"start: x = {state.x:g} m: must lie within the stroke, {limits}")
    number("start: v", state.v)
    check_positive(P_A=state.P_A, T_A=state.T_A, P_B=state.P_B, T_B=state.T_B)
    return state


class Stroke(NamedTuple):
    """A movement of the piston that ends at a stop."""

    switched: float  #: time of the last change of the command before the piston leaves, s
    leaves: float  #: time at which it leaves, s
    arrives: float  #: time at which it meets the stop, s
    distance: float  #: from where it left, m; positive where chamber A became larger
    end_speed: float  #: before the impact, m/s
    air: float  #: from the supply, from this change of the command to the next or the end, normal litres
    rebounds: int = 0  #: how often the piston turned back on its way, on a cushion of air, or at the stop

    @property
    def time(self) -> float:
        """Stroke time from the change of the command to the stop, s."""
        return self.arrives - self.switched

    @property
    def mean_speed(self) -> float:
        """Distance over stroke time, m/s."""
        return abs(self.distance) / self.time


def _arrival(x: np.ndarray, v: np.ndarray, k: int, stop: float, h: float) -> tuple[float, float]:
    """Time and speed at which the piston meets a stop after sample k: with the acceleration before it."""
    gap, speed = abs(stop - x[k]), abs(v[k])
    a = (speed - abs(v[k - 1])) / h if k else 0.0
    square = speed**2 + 2 * a * gap
    end_speed = square**0.5 if square > 0 else speed
    duration = 2 * gap / (speed + end_speed) if speed + end_speed else h
    return k * h + min(duration, h), end_speed


def _turns(v: np.ndarray) -> int:
    """How often a velocity, positive towards the stop, turns negative."""
    moving = np.sign(v[v != 0])
    return int(np.count_nonzero((moving[:-1] > 0) & (moving[1:] < 0)))


def _departure(v: np.ndarray, k: int, earliest: int, switches: np.ndarray) -> int:
    """Sample at which the piston left for a stop that it meets after sample k; v is positive towards it.

    That is the first one with such a velocity since it met a stop, or since the last change of the command at
    which it was at rest or moved away. A rebound on the way is no departure.
    """
    changes = switches[(switches >= earliest) & (switches <= k)]
    changes = changes[v[changes] <= 0]
    since = int(changes[-1]) if len(changes) else earliest
    moves = np.flatnonzero(v[since : k + 1] > 0)
    return max(since + int(moves[0]) - 1, since) if len(moves) else k


def _strokes(recording: Recording, commands: np.ndarray) -> list[Stroke]:
    """Movements of a simulated run that end at a stop, in the order of time; `commands` by step and valve."""
    (x, v), h, cylinder = recording.states[:, :2].T, recording.h, recording.plant.cylinder
    drawn = np.concatenate([[0.0], np.cumsum(supplied_mass(recording))])
    if recording.drive.closed_loop:  # its command changes all the time
        commands = recording.reference
    changed = np.diff(commands, axis=0).reshape(len(x) - 1, -1).any(axis=1)
    switches = np.concatenate([[0], np.flatnonzero(changed) + 1])
    P_n, T_n = NORMAL
    per_kg = 1e3 * recording.plant.gas.R * T_n / P_n  # litres
    strokes = list[Stroke]()
    last_stop, met = None, 0
    for k in np.flatnonzero(np.isin(x[1:], (cylinder.x_min, cylinder.x_max)) & (x[1:] != x[:-1])):
        stop = x[k + 1]
        towards = v if stop == cylinder.x_max else -v
        left = _departure(towards, int(k), met, switches)
        switch = int(np.searchsorted(switches, left, side="right")) - 1
        first, end = switches[switch], [*switches[1:], len(x) - 1][switch]
        bounced = bool(strokes) and stop == last_stop and first < met
        last_stop, met = stop, int(k) + 1
        if bounced:
            strokes[-1] = strokes[-1]._replace(rebounds=strokes[-1].rebounds + 1)
            continue
        arrives, end_speed = _arrival(x, v, int(k), stop, h)
        air = float(per_kg * (drawn[end] - drawn[first]))
        turns = _turns(towards[left : k + 1])
        strokes.append(Stroke(first * h, left * h, arrives, stop - x[left], end_speed, air, turns))
    return strokes


def _counted(rebounds: int) -> str:
    return f", {rebounds} rebound{'s' if rebounds > 1 else ''}" if rebounds else ""


def _later(delay: float) -> str:
    return f"{1e3 * delay:.3g} ms later" if delay > 0 else "at once"


def _column(name: str, doc: str) -> Any:
    return property(lambda run: run.recording.states[:, STATE.index(name)], doc=doc)


class Run(NamedTuple):
    """Signals of a cylinder at every step, simulated or measured; NaN for signals that were not measured."""

    recording: Recording  #: states, reference and what opens the valve, with plant and step
    simulated: bool  #: by `simulate`; else measured
    command: np.ndarray  #: before limiter and dynamics of each valve, V, shape (steps + 1, 1 or 2)

    x, v = _column("x", "Piston position from mid-stroke, m."), _column("v", "Piston velocity, m/s.")
    P_A, P_B = (_column(f"P_{side}", f"Pressure in chamber {side}, Pa.") for side in "AB")
    T_A, T_B = (_column(f"T_{side}", f"Temperature in chamber {side}, K.") for side in "AB")

    @property
    def u(self) -> np.ndarray:
        """Command before the limiter, V."""
        return self.command[:, 0]

    @property
    def u_B(self) -> np.ndarray | None:
        """Command to chamber B's own valve, V; None: the chambers share one."""
        return self.command[:, 1] if self.command.shape[1] == 2 else None

    @property
    def t(self) -> np.ndarray:
        """Time from the start, s."""
        return self.recording.h * np.arange(len(self.u))

    @property
    def strokes(self) -> list[Stroke]:
        """Movements of a simulated run that end at a stop; empty for a measured one."""
        return _strokes(self.recording, self.command) if self.simulated else []

    def to_xarray(self) -> xr.Dataset:
        """Dataset with u, x and v over t, and P and T over (t, chamber), in SI units."""
        import xarray as xr

        pairs = {name: np.stack([getattr(self, f"{name}_{side}") for side in "AB"], axis=-1) for name in "PT"}
        variables: dict[str, Any] = {name: ("t", getattr(self, name)) for name in ("u", "x", "v")}
        variables |= {name: (("t", "chamber"), pair) for name, pair in pairs.items()}
        if self.u_B is not None:
            about = {"units": "V", "long_name": "command to the valve of chamber B, positive from the supply"}
            variables["u_B"] = ("t", self.u_B, about)
        dataset = xr.Dataset(variables, {"t": self.t, "chamber": ["A", "B"]})
        for name in dataset.variables:
            if symbol := SYMBOLS.get(str(name)):
                dataset[name].attrs = {"units": symbol.unit, "long_name": symbol.long_name}
        return dataset

    def to_table(self) -> pd.DataFrame:
        """Table with a column for each signal, headed as `pneumo.read_record` reads them."""
        import pandas as pd

        u_B = self.u_B
        columns = {"t_s": self.t} | ({"u_V": self.u} if u_B is None else {"u_A_V": self.u, "u_B_V": u_B})
        columns |= {"x_m": self.x, "v_m/s": self.v}
        columns |= {f"P_{side}_Pa": getattr(self, f"P_{side}") for side in "AB"}
        return pd.DataFrame(columns | {f"T_{side}_K": getattr(self, f"T_{side}") for side in "AB"})

    def plot(self) -> Figure:
        """Figure of command, position, velocity, pressures and temperatures."""
        from pneumo.publish.figures.run_figure import run_figure

        return run_figure(self.to_xarray())

    def _repr_html_(self) -> str:
        return lines_html(self)

    def __repr__(self) -> str:
        """Text of at most ten lines: start, strokes, extremes of pressures and temperatures."""
        kind = "simulated" if self.simulated else "measured"
        lines = [f"{kind} run of {self.t[-1]:.4g} s in steps of {1e3 * self.recording.h:.4g} ms"]
        strokes = self.strokes
        lines += [
            f"stroke of {1e3 * s.distance:+.4g} mm in {1e3 * s.time:.3g} ms (valve opens at {s.switched:.4g}"
            f" s, piston moves {_later(s.leaves - s.switched)}): mean {s.mean_speed:.3g} m/s, end"
            f" {s.end_speed:.3g} m/s, {s.air:.3g} normal litres (0 °C) of supply air until the command"
            f" changes or ends{_counted(s.rebounds)}"
            for s in strokes[:MOST_STROKES]
        ]
        lines += [f"... and {len(strokes) - MOST_STROKES} more"] if len(strokes) > MOST_STROKES else []
        if not strokes:
            unended = f"; {1e3 * self.x[-1]:.4g} mm at the end: no whole stroke" if self.simulated else ""
            lines.append(f"x: {1e3 * self.x.min():.4g} to {1e3 * self.x.max():.4g} mm{unended}")
        for side in "AB":
            P, T = getattr(self, f"P_{side}") / 1e5, getattr(self, f"T_{side}")
            pressures = f"chamber {side}: {np.min(P):.4g} to {np.max(P):.4g} bar absolute"
            lines.append(f"{pressures}, {np.min(T):.4g} to {np.max(T):.4g} K")
        return "\n".join(lines)


class Prediction(NamedTuple):
    """Pressures of a reduced model on a run, and their errors, each a pair: chamber A, chamber B."""

    t: np.ndarray  #: time, s
    P_A: np.ndarray  #: pressure by the model, Pa
    P_B: np.ndarray  #: the same of chamber B
    mean_error: np.ndarray  #: mean of the run's minus the model's pressure, Pa: a pair
    mse: np.ndarray  #: mean of its square, Pa^2: a pair
    status: tuple[str, ...]  #: "ok", or why a chamber's pressures end in NaN: a pair
    model: str = ""  #: its name, with n if it has one

    def to_xarray(self) -> xr.Dataset:
        """Dataset with `P` by (t, chamber), Pa, and `mean_error` and `mse` by chamber."""
        import xarray as xr

        by_chamber = {"mean_error": ("chamber", self.mean_error), "mse": ("chamber", self.mse)}
        P = np.stack([self.P_A, self.P_B], axis=1)
        return xr.Dataset(
            {"P": (("t", "chamber"), P, {"units": "Pa"}), **by_chamber},
            {"t": ("t", self.t, {"units": "s"}), "chamber": ["A", "B"]},
            {"model": self.model},
        )

    def _repr_html_(self) -> str:
        return lines_html(self)

    def __repr__(self) -> str:
        """Model with its root mean square errors; a replay that failed says why."""
        rms = zip("AB", np.sqrt(self.mse) / 1e3, self.status, strict=True)
        errors = ", ".join(
            f"{side} {error:.3g} kPa" if status == "ok" else f"{side} {status}" for side, error, status in rms
        )
        return f"replay of {self.model} over {self.t[-1]:.4g} s: RMS error {errors}"


def _floats(name: str, values: ArrayLike) -> np.ndarray:
    """An array of floats; `InputError` for anything else."""
    try:
        array = np.array(values)
        if array.dtype.kind in "cUS":  # NumPy would drop imaginary parts, and read text
            raise TypeError
        return array.astype(float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {shown(values)}: must be an array of real numbers") from None


def _series(**signals: ArrayLike) -> dict[str, np.ndarray]:
    """Signals as arrays of floats: one-dimensional, finite and of one length."""
    arrays = {name: _floats(name, values) for name, values in signals.items()}
    first, *_ = arrays.values()
    for name, values in arrays.items():
        if values.ndim != 1 or len(values) < 2:
            raise InputError(f"{name}: shape {values.shape}: must be (steps,), with at least 2 steps")
        if len(values) != len(first):
            raise InputError(f"{name}: {len(values)} steps: must be {len(first)}, as of {next(iter(arrays))}")
        for k in np.flatnonzero(~np.isfinite(values))[:1]:
            raise InputError(f"{name} = {values[k]:g} at step {k}: must be finite")
    return arrays


def simulate(
    plant: Plant | Path | str,
    h: float,
    *,
    command: ArrayLike | None = None,
    reference: ArrayLike | None = None,
    k_p: float = 0.0,
    start: State | str = "rest",
    dynamics: ValveDynamics | None = None,
) -> Run:
    """Run the full-order system, eqs (1) to (8), behind a valve with dynamics as exports have it.

    Parameters
    ----------
    plant : Plant or path
        The plant, or a configuration with one.
    h : float
        Step, s; 1 ms in the paper.
    command : array-like
        Command, V, one value for each step, held during it; with shape (steps, 2), those of a valve for each
        chamber, both positive where they connect their chamber to the supply.
    reference : array-like
        Instead of a command: position reference, m, one value for each step, held during it.
    k_p : float
        Gain of the proportional control that follows the reference, V/m.
    start : State or str
        State at the start, or a name: `rest`, in mid-stroke at (P_0, T_0); `vented`, at the end where chamber
        A is smallest with both chambers at P_atm; `retracted`, there with B at P_s; `extended`, at the other
        end with A at P_s and B at P_atm; `pressurised`, retracted with both at P_s.
    dynamics : ValveDynamics
        How the valve follows a command, from 0 V before the start: dead time, lag, null offset and dead band.
        None: the `valve_dynamics` of a configuration; a `Plant` has none.

    Raises
    ------
    InputError
        If not exactly one of command and reference is given, a reference meets `dynamics`, or a number is out
        of range.
    RunError
        If the run fails: its start, its plant or its step is not physical.
    """
    check_positive(h=h)
    plant, configured = (plant, PROPORTIONAL) if isinstance(plant, Plant) else load_rig(plant)
    dynamics = configured if dynamics is None else dynamics
    u_B, y_0 = None, np.array(start_state(plant, start))
    if command is not None and reference is None:
        drive, own = OPEN_LOOP, _floats("command", command)
        if own.ndim == 2 and own.shape[1] == 2:
            signal, u_B = _series(u_A=own[:, 0], u_B=own[:, 1]).values()
        else:
            signal = _series(command=own)["command"]
        given = np.stack([signal] if u_B is None else [signal, u_B], axis=-1)
    elif reference is not None and command is None:
        check_positive(k_p=k_p)
        if dynamics != PROPORTIONAL:
            remedy = "give a command, or leave the section out"
            raise InputError(f"valve_dynamics: not with a position reference; {remedy}")
        given = None
        drive, signal = Drive(True, float(k_p), np.inf), _series(reference=reference)["reference"]
    else:
        raise InputError("command, reference: give exactly one")
    if given is not None and dynamics != PROPORTIONAL:
        plant, signal, u_B = _opened(given, float(h), plant, dynamics)
    states, signal, halvings = run(y_0, signal, 0.0, drive, plant, float(h), MOST_HALVINGS, u_B)
    status, step = failure(states)
    if status != RAN:
        raise RunError(f"{RUN_STATUS[status]} at {step * h:.4g} s: check start, plant and step, {h:g} s")
    u = command_of(signal, states[:, 0], drive)
    recording = Recording(states, signal, u, drive, plant, float(h), halvings, MOST_HALVINGS, u_B)
    return Run(recording, simulated=True, command=u[:, None] if given is None else given)


def _opened(
    given: np.ndarray, h: float, plant: Plant, dynamics: ValveDynamics
) -> tuple[Plant, np.ndarray, np.ndarray | None]:
    """Plant and openings, V, of one valve or two, with which the core runs behind `dynamics`.

    The command meets the limiter first. That of the returned plant lets every opening pass, to which a null
    offset can add.
    """
    u_max = plant.valve.u_max
    openings = [opened(u, h, dynamics) for u in np.clip(given.T, -u_max, u_max)]
    wide = plant.valve._replace(u_max=u_max + abs(dynamics.null))
    return plant._replace(valve=wide), openings[0], openings[1] if len(openings) == 2 else None


def recorded(
    plant: Plant | Path | str,
    h: float,
    *,
    u: ArrayLike,
    x: ArrayLike,
    v: ArrayLike,
    P_A: ArrayLike | None = None,
    P_B: ArrayLike | None = None,
) -> Run:
    """Make a `Run` of measured signals, for `replay`, in which the valve follows its command at once.

    Parameters
    ----------
    plant : Plant or path
        The plant, or a configuration with one.
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
        If a signal has a wrong shape or numbers that are not finite, or a chamber would have no volume.
    """
    check_positive(h=h)
    plant = plant if isinstance(plant, Plant) else load_plant(plant)
    measured = {name: P for name, P in (("P_A", P_A), ("P_B", P_B)) if P is not None}
    signals = _series(u=u, x=x, v=v, **measured)
    cylinder, x = plant.cylinder, signals["x"]
    low = -cylinder.stroke / 2 - cylinder.V_d_A / cylinder.A_A
    high = cylinder.stroke / 2 + cylinder.V_d_B / cylinder.A_B
    for k in np.flatnonzero((x <= low) | (x >= high))[:1]:
        raise InputError(f"x = {x[k]:g} m at step {k}: must be {low:.4g} to {high:.4g} m from mid-stroke")
    u, states = signals["u"], np.full((len(signals["u"]), len(STATE)), np.nan)
    for name in ("x", "v", *measured):
        states[:, STATE.index(name)] = signals[name]
    reference, halvings = np.zeros(len(u)), np.zeros(len(u) - 1, dtype=np.int8)
    recording = Recording(states, reference, u, OPEN_LOOP, plant, float(h), halvings, MOST_HALVINGS)
    return Run(recording, simulated=False, command=u[:, None])


def replay(model: Model | str, n: float | None, run: Run) -> Prediction:
    """Integrate a reduced model, or the full order, on command, position and velocity of a run, Fig. 6.

    The full order is the model "full", without n.

    On a simulated run it starts at the run's first pressures and reads the signals at every stage of the
    integrator; on a measured one it starts at P_0, the full order at the first measured
    pressures and T_0, and reads samples, interpolated linearly.

    Raises
    ------
    InputError
        If there is no such model, or n is missing or out of range.
    """
    given: Any = run  # callers without a type checker give anything
    if not isinstance(given, Run):
        raise InputError(f"run = {shown(run)}: must be a Run, as `simulate` and `recorded` return it")
    plant = run.recording.plant
    lanes = lane_array([lane_for(model, n, plant)])
    replayed = replay_lanes(run.recording, lanes, EXACT_SAMPLING if run.simulated else INTERPOLATED)
    P_A, P_B = replayed.pressure[0]
    status = tuple(STATUS[int(code)] for code in replayed.status[0])
    name = model if isinstance(model, str) else model.name
    name = f"{name} at n = {n:g}" if n is not None else name
    return Prediction(run.t, P_A, P_B, replayed.mean_error[0], replayed.mse[0], status, name)
