"""Error that is expected on a new run once the full order has been fitted to one record."""

from dataclasses import replace

import numpy as np

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.priors import Accuracy
from pneumo.configuration.sampling import HELD, INTERPOLATED
from pneumo.errors import PneumoError, RunError
from pneumo.fitting.fit_problem import Problem, check_valve, priors
from pneumo.fitting.fit_result import rms_of_chambers
from pneumo.fitting.held_out import Parts, expected_error
from pneumo.fitting.least_squares import solution_at
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import LONGEST_STEP, stage_signals
from pneumo.physics.models import FULL
from pneumo.selection.error_budget import NOISE, RECORD
from pneumo.simulation.full_order import RAN, failure, record

SENSORS = ("P_gain_A", "P_gain_B", "P_gain_s")


def error_after_record(experiment: Experiment, known: Accuracy) -> float:
    """Expected RMS error of a fitted full order on a new run, Pa; NaN if the experiment allows no fit.

    The error is that of the pressures, not of their sensors, whose gains and offsets move the fit. The
    experiment is simulated, and the first-order formulas of the fit are applied to it: noise leaves every
    parameter uncertain, and what is configured is `known` within its accuracy only. The new run is the
    experiment's next `RECORD` seconds.
    """
    try:
        fitted, rest = problems_of(experiment, known)
    except PneumoError:
        return np.nan
    here, there = (solution_at(problem, at_truth(problem)) for problem in (fitted, rest))
    noise = np.random.default_rng(0).normal(0.0, NOISE / experiment.plant.conditions.P_s, here.residual.shape)
    of_plant = there.jacobian * [not name.startswith("offset") for name in rest.names]
    parts = Parts(fitted, rest, replace(here, residual=noise), replace(there, derivatives=lambda: of_plant))
    return float(rms_of_chambers(expected_error(parts, known, {**known, **dict.fromkeys(SENSORS, 0.0)})))


def problems_of(experiment: Experiment, known: Accuracy) -> tuple[Problem, Problem]:
    """Full order to be fitted to a record without noise, and to the new run.

    `InputError` if the replay of a fit does not model the valve, `RunError` if the simulation fails.
    """
    plant, steps = experiment.plant, round(RECORD / experiment.h)
    check_valve(plant)
    recording = record(experiment._replace(steps=2 * steps))
    if failure(recording.states)[0] != RAN:
        raise RunError(f"{experiment.name}: the run fails")
    every = max(1, round(LONGEST_STEP / experiment.h))  # as a logger does
    states, u = recording.states[::every], recording.u[::every]
    measured = Measurement("", every * experiment.h, u, states[:, 0], states[:, [2, 4]].T)
    signals = stage_signals(measured, plant, INTERPOLATED if experiment.drive.closed_loop else HELD)
    last = len(u) - 1
    parts = (signals.part(0, last // 2), signals.part(last // 2, last))
    fitted, rest = (Problem(FULL, plant, part, {}, (), priors(plant, part, known, NOISE)) for part in parts)
    return fitted, rest


def at_truth(problem: Problem) -> np.ndarray:
    """Parameters of the configured plant, on the scale of the search."""
    return problem.inner(problem.values(problem.guess()) | {"k_0": problem.plant.k_0})
