"""Error that is expected on a new run once the full order has been fitted to one record."""

import numpy as np

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.parameters import Accuracy
from pneumo.configuration.sampling import HELD, INTERPOLATED
from pneumo.errors import InputError
from pneumo.fitting.fit_problem import FULL, Problem, check_valve, priors
from pneumo.fitting.fit_result import rms_of_chambers
from pneumo.fitting.held_out import Parts, expected_error
from pneumo.fitting.least_squares import Solution, solution_at
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import LONGEST_STEP, stage_signals
from pneumo.simulation.full_order import RAN, failure, record

RECORD = 10.0  # s, of the record, and of the new run
NOISE = 1e3  # Pa, standard deviation of the pressure sensors; ASSUME


def error_after_record(experiment: Experiment, known: Accuracy) -> float:
    """Expected RMS error of a fitted full order on a new run, Pa; NaN if the experiment allows no fit.

    The error is that of the pressures, not of their sensors, whose gains and offsets move the fit. The
    experiment is simulated, and the first-order formulas of the fit are applied to it: noise leaves every
    parameter uncertain, and what is configured is `known` within its accuracy only. The new run is the
    experiment's next `RECORD` seconds.
    """
    plant, count = experiment.plant, round(RECORD / experiment.h)
    try:
        check_valve(plant)
    except InputError:
        return np.nan
    recording = record(experiment._replace(steps=2 * count))
    if failure(recording.states)[0] != RAN:
        return np.nan
    every = max(1, round(LONGEST_STEP / experiment.h))  # as a logger does
    states, u = recording.states[::every], recording.u[::every]
    measured = Measurement("", every * experiment.h, u, states[:, 0], states[:, [2, 4]].T)
    signals = stage_signals(measured, plant, INTERPOLATED if experiment.drive.closed_loop else HELD)
    last = len(u) - 1
    signals_of = (signals.part(0, last // 2), signals.part(last // 2, last))
    fitted, rest = (
        Problem(FULL, plant, part, {}, (), priors(plant, part, known, NOISE)) for part in signals_of
    )
    here, there = _at_truth(fitted), _at_truth(rest)
    of_plant = [not name.startswith("offset") for name in rest.names]
    parts = Parts(fitted, rest, here, there._replace(jacobian=there.jacobian * of_plant))
    return float(rms_of_chambers(expected_error(parts, known, known._replace(P_gain=0.0))))


def _at_truth(problem: Problem) -> Solution:
    """Derivatives at the configured plant, and the sensors' noise as the residual."""
    truth = problem.values(problem.guess()) | {"k_0": problem.plant.k_0}
    found = solution_at(problem, problem.inner(truth))
    noise = np.random.default_rng(0).normal(0.0, NOISE, found.residual.shape)
    return found._replace(residual=noise / problem.plant.conditions.P_s)
