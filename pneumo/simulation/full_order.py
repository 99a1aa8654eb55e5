"""The full-order system: one valve, one piston, two chambers with pressure and temperature.

State of the sixth-order model: (x, v, P_A, T_A, P_B, T_B).
"""

from typing import Any, NamedTuple

import numpy as np

import pneumo.core as core
from pneumo.configuration.experiment import Drive, Experiment, Plant
from pneumo.configuration.sampling import Sampling
from pneumo.physics.cylinder import Side, chamber_of, volume
from pneumo.simulation.excitation import command, reference_series, reversed_late

MOST_HALVINGS = 20  # that the core accepts for a step
STATE = ("x", "v", "P_A", "T_A", "P_B", "T_B")
RAN, DIVERGED, NOT_POSITIVE = 0, 1, 2
RUN_STATUS = {
    RAN: "ok",
    DIVERGED: "state left the finite numbers",
    NOT_POSITIVE: "pressure or temperature left the positive numbers",
}


class Run(NamedTuple):
    """A run of the full-order system."""

    states: np.ndarray  # (x, v, P_A, T_A, P_B, T_B) by step, shape (steps + 1, 6)
    reference: np.ndarray  # with the signs that the open loop reversed, shape (steps + 1,)
    halvings: np.ndarray  # how often each step was halved, shape (steps,)


def run(
    y_0: np.ndarray,
    reference: np.ndarray,
    force: float,
    drive: Drive,
    plant: Plant,
    h: float,
    most_halvings: int = 0,
    u_B: np.ndarray | None = None,
) -> Run:
    """Integrate the full-order system by steps of h s of Dormand and Prince's method.

    It starts from the state y_0 and follows the reference of every step, shape (steps + 1,), m in closed loop
    or V in open loop, under an external force on the piston, N. A step that fails or whose estimated error
    exceeds 1e-4 of stroke, P_0 or T_0 is repeated in two parts, then in four, up to 2**most_halvings parts;
    the way beyond a stop is such an error.
    `u_B`, of the same shape, is the command of chamber B's own valve, V, positive where it connects B to the
    supply; None: the chambers share a valve.

    Raises
    ------
    ValueError
        If an array has another shape, or most_halvings is not 0 to `MOST_HALVINGS`.
    """
    reference = np.array(reference, dtype=float)
    if reference.ndim != 1 or not len(reference):
        raise ValueError(f"reference: shape {reference.shape}; needed is a number for each step and the end")
    steps, most = len(reference) - 1, core.whole("most_halvings", most_halvings, 0, MOST_HALVINGS)
    states, halvings = np.empty((steps + 1, 6)), np.zeros(steps, np.int8)
    core.lib.run(
        core.array("y_0", y_0, (6,)),
        core.out(reference),
        core.array("u_B", u_B, (steps + 1,), optional=True),
        steps,
        force,
        core.struct("Drive", drive),
        core.struct("Plant", plant),
        h,
        most,
        core.out(states),
        core.out(halvings),
    )
    return Run(states, reference, halvings)


def equilibrium(plant: Plant) -> np.ndarray:
    """State from which every run starts: piston in the middle, both chambers at (P_0, T_0)."""
    P_0, T_0 = plant.conditions.P_0, plant.conditions.T_0
    return np.array([0.0, 0.0, P_0, T_0, P_0, T_0])


def thermal_time_constant(plant: Plant) -> float:
    """Time constant of heat exchange of chamber A's air with its wall at equilibrium, m c_v / k_0, s.

    The piston is in the middle; the result is infinite for k_0 = 0.
    """
    conditions, gas = plant.conditions, plant.gas
    V = volume(0.0, chamber_of(plant.cylinder, Side.A), plant.cylinder)
    c = conditions.P_0 * V / (conditions.T_0 * (gas.gamma - 1))
    return c / plant.k_0 if plant.k_0 else np.inf


def failure(states: np.ndarray) -> tuple[int, int]:
    """Status of a run, a key of `RUN_STATUS`, and the step at which it failed, or -1.

    A signal that is NaN at the first step was not measured; it is ignored.
    """
    missing = np.isnan(states[0])
    finite = np.isfinite(states) | missing
    positive = (states[:, 2:] > 0) | missing[2:]
    if finite.all() and positive.all():
        return RAN, -1
    failed = ~(finite.all(axis=1) & positive.all(axis=1))
    step = int(failed.argmax())
    return (NOT_POSITIVE if finite[step].all() else DIVERGED), step


class Recording(NamedTuple):
    """Signals of a run, simulated or measured, from which the replays integrate reduced models."""

    states: np.ndarray  # (x, v, P_A, T_A, P_B, T_B) by step, shape (steps + 1, 6); NaN after a `failure`
    reference: np.ndarray  # in force from every step's start, shape (steps + 1,)
    u: np.ndarray  # command before the limiter as recorded at every step, V, shape (steps + 1,)
    drive: Drive
    plant: Plant
    h: float  # step, s
    halvings: np.ndarray  # how often the run halved each step, shape (steps,)
    most_halvings: int  # that a replay may make of a step
    u_B: np.ndarray | None = None  # command of chamber B's own valve, V; None: the chambers share one


def core_recording(recording: Recording) -> Any:
    """C struct of a recording; it keeps the arrays alive that the core reads.

    Raises
    ------
    ValueError
        If an array has another shape, or a number of halvings is not 0 to `MOST_HALVINGS`.
    """
    steps = core.whole("steps", len(recording.states) - 1, 0)
    for value in (np.max(recording.halvings, initial=0), np.min(recording.halvings, initial=0)):
        core.whole("halvings", value, 0, MOST_HALVINGS)
    core.whole("most_halvings", recording.most_halvings, 0, MOST_HALVINGS)
    arrays = {
        "states": core.array("states", recording.states, (steps + 1, 6)),
        "halvings": core.array("halvings", recording.halvings, (steps,), np.int8),
    }
    for name in ("reference", "u", "u_B"):
        arrays[name] = core.array(name, getattr(recording, name), (steps + 1,), optional=name == "u_B")
    fields = recording._asdict() | arrays | {"steps": steps}
    return core.keep(core.struct("Recording", fields), *arrays.values())


def core_sampling(sampling: Sampling) -> Any:
    """C struct of a sampling; `ValueError` if delays are not finite or `every` is not positive."""
    core.whole("every", sampling.every, 1)
    if not all(abs(delay) < core.LONGEST for delay in sampling.delay):
        raise ValueError(f"delay = {sampling.delay}: must be finite")
    flags = (sampling.rule == "exact", sampling.rule.startswith("hold"), sampling.rule == "hold_next")
    return core.struct("Sampling", (*flags, sampling.delay, sampling.every))


def supplied_mass(recording: Recording) -> np.ndarray:
    """Mass that flows from the supply into both chambers in each step, kg: shape (steps,)."""
    steps = len(recording.states) - 1
    m = np.empty(steps)
    core.lib.supplied_mass(
        core.array("states", recording.states, (steps + 1, 6)),
        core.array("u", recording.u, (steps + 1,)),
        core.array("u_B", recording.u_B, (steps + 1,), optional=True),
        steps,
        core.struct("Plant", recording.plant),
        recording.h,
        core.out(m),
    )
    return m


def recorded(experiment: Experiment, draws: np.ndarray, start: np.ndarray | None = None) -> Recording:
    """Run an experiment's full-order system on a given reference and record it.

    `draws` is the reference before any reversal, m or V, shape (steps + 1,). The run begins at the state
    `start`, by default at equilibrium.
    """
    drive = experiment.drive
    plant = experiment.plant
    most = experiment.most_halvings
    y_0 = equilibrium(plant) if start is None else start
    states, reference, halvings = run(y_0, draws, 0.0, drive, plant, experiment.h, most)
    status, step = failure(states)
    if status != RAN:
        states[step + 1 :] = np.nan
    u = command(reference, states[:, 0], drive)
    u = reversed_late(u, draws, drive.late) if drive.late else u
    return Recording(states, reference, u, drive, plant, experiment.h, halvings, most)


def record(experiment: Experiment) -> Recording:
    """Run an experiment's full-order system from equilibrium and record it."""
    return recorded(experiment, reference_series(experiment.drive, experiment.excitation, experiment.steps))
