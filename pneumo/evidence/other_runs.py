"""Full-order and settling runs as the paper could have meant them otherwise: paper/2006/assumptions.yaml."""

import numpy as np

from pneumo.configuration.experiment import Experiment
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import STATE, Recording, equilibrium, recorded, run
from pneumo.simulation.settling import QUANTITIES, Settling, settling_time


def keeps_changed_sign(experiment: Experiment) -> Recording:
    """Full-order run whose open-loop sequence keeps the sign that 96 % of the half-stroke forced on it.

    At each crossing the rest of the sequence changes sign; in closed loop there is nothing to change.
    """
    drive, plant, every = experiment.drive, experiment.plant, experiment.excitation.every
    reference = reference_series(drive, experiment.excitation, experiment.steps)
    start, y = 0, equilibrium(plant)
    while not drive.closed_loop and start < experiment.steps:
        stop = min((start // every + 1) * every, experiment.steps)
        states = run(y, reference[start : stop + 1], 0.0, drive, plant, experiment.h)
        outward = np.flatnonzero(states[:-1, 0] * np.sign(reference[start]) >= drive.x_reverse)
        if len(outward):
            stop = start + int(outward[0])
            reference[stop:] *= -1
        start, y = stop, states[stop - start]
    return recorded(experiment, reference)


def first_draw_skipped(experiment: Experiment) -> Recording:
    """Full-order run on the same random numbers, the first of them left out."""
    excitation = experiment.excitation
    series = reference_series(experiment.drive, excitation, experiment.steps + excitation.every)
    return recorded(experiment, series[excitation.every :])


def largest_excursions(settling: Settling, h: float) -> np.ndarray:
    """Settling times of P_A, P_B, T_A, T_B, s, with delta P the largest excursion, as delta T is."""
    free = settling.states[settling.release_step :, [STATE.index(quantity) for quantity in QUANTITIES]]
    return np.array([settling_time(series, np.abs(series - series[-1]).max(), h) for series in free.T])
