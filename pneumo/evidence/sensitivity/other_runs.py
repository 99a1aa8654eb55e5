"""Full-order and settling runs as the paper could have meant them otherwise: paper/2006/assumptions.yaml."""

import numpy as np

from pneumo.configuration.experiment import Experiment
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import STATE, Recording, record, recorded
from pneumo.simulation.settling import QUANTITIES, Settling, settling_time


def first_draw_skipped(experiment: Experiment) -> Recording:
    """Full-order run on the same random numbers, the first of them left out."""
    excitation = experiment.excitation
    series = reference_series(experiment.drive, excitation, experiment.steps + excitation.every)
    return recorded(experiment, series[excitation.every :])


def leaking(experiment: Experiment) -> Recording:
    """Full-order run through a valve that leaks; the recording names the tight valve, for replays of it."""
    plant = experiment.plant
    valve = plant.valve._replace(leak=experiment.push.leak, net_leak=True)
    return record(experiment._replace(plant=plant._replace(valve=valve)))._replace(plant=plant)


def largest_excursions(settling: Settling, h: float) -> np.ndarray:
    """Settling times of P_A, P_B, T_A, T_B, s, with delta P the largest excursion, as delta T is."""
    free = settling.states[settling.release_step :, [STATE.index(quantity) for quantity in QUANTITIES]]
    return np.array([settling_time(series, np.abs(series - series[-1]).max(), h) for series in free.T])
