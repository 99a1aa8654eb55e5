"""Floor of error that signal transport leaves: measured with replays, beside what theory says without them.

Measured on full-order runs at a fine step: the chambers' own equations, replayed on signals that were
sampled, miss the run by nothing but the transport. All errors are RMS over the run and both chambers.
"""

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.engineer.floor_theory import (
    SHIFTS,
    averages,
    floor,
    late_rest,
    predicted_error,
    sensitivities,
)
from pneumo.evidence.error_budget import refined, sliced
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation.chamber_replay import replay_chambers
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import EXACT_TRANSPORT
from pneumo.storage.layout import experiment_labels

EXPERIMENTS = ("E09", "E10", "E11", "E12", "E13", "E14", "E15", "E16")  # of at most 120 s: at full length
FINE = 10  # steps within one of the study's: every period is a multiple
PERIODS = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # s between samples
RATES = (5.0, 10.0, 20.0, 40.0, 100.0)  # draws per second, each a multiple of 1 ms apart
SIZES = (0.25, 0.5, 1.0, 2.0, 4.0)  # valve's area over that of the study
SWEEP = 20.0  # s from the start where rate and size vary; prediction and measurement see the same run
SWEEP_PERIOD = 1e-3  # s, the study's own
PRIME = 503  # fine steps between draws that do not fall on samples: 50.3 ms
MODEL, N = "M8", 1.35  # the reduced model whose floor is measured too
TOLERANCE = 0.2  # of the RMS; set before anything was measured
WAYS = {
    "measured": "replayed on sampled signals",
    "predicted": "linear theory along the run",
    "formula": "closed formula",
}


def rms(error: np.ndarray) -> float:
    """Root mean square over chambers and samples."""
    return float(np.sqrt(np.mean(error**2)))


def with_valve(experiment: Experiment, size: float) -> Experiment:
    """Return an experiment whose valve is larger by a factor."""
    valve = experiment.plant.valve
    plant = experiment.plant._replace(valve=valve._replace(k_xu=size * valve.k_xu))
    return experiment._replace(plant=plant)


def with_draws(experiment: Experiment, every: int) -> Experiment:
    """Return an experiment whose reference is drawn every so many steps."""
    return experiment._replace(excitation=experiment.excitation._replace(every=every))


def three_ways(
    e: Experiment, recording: Recording, periods: tuple[float, ...], between: bool = False
) -> np.ndarray:
    """Floor by (period, way, transport), Pa, of a run at its fine step."""
    full = recording.states[::FINE, [2, 4]].T
    known, late = averages(recording, e.excitation.every), late_rest(recording, FINE)
    found = sensitivities(e.plant, known)
    result = np.empty((len(periods), len(WAYS), len(SHIFTS)))
    for i, period in enumerate(periods):
        every = round(period / e.h)
        for j, (name, shift) in enumerate(SHIFTS.items()):
            replayed = replay_chambers(recording, shift.transport(every), FINE)
            predicted = predicted_error(recording, period, name, FINE, late)
            scattered = between and every > 1  # if every step is a sample, all jumps fall on them
            formula = floor(found, period, name, early=known.early, between=scattered)
            result[i, :, j] = rms(full - replayed), rms(predicted), formula
    return result


def reduced_floor(e: Experiment, recording: Recording, period: float) -> list[float]:
    """Floor of one reduced model by transport, Pa: its replay on exact less that on sampled signals."""
    lanes = lane_array([lane(MODELS[MODEL], N, e.plant.gas.gamma)])
    exact = replay(recording, lanes, EXACT_TRANSPORT, FINE).pressure[0]
    every = round(period / e.h)
    sampled = [replay(recording, lanes, shift.transport(every), FINE) for shift in SHIFTS.values()]
    return [rms(exact - replays.pressure[0]) for replays in sampled]


def measure(experiment: Experiment) -> xr.Dataset:
    """Floor of one experiment by time between samples, rate of excitation and size of the valve.

    Returns
    -------
    xarray.Dataset
        RMS errors, Pa: `measured`, `predicted` and `formula` by (period, transport), the same with
        ``between_`` for jumps that do not fall on samples, by (rate, transport) with ``rate_`` and by
        (size, transport) with ``size_``; `reduced` by transport at the study's own period.
    """
    e, short = refined(experiment, FINE), refined(sliced(experiment, SWEEP), FINE)
    recording, apart = record(e), with_draws(short, PRIME)

    def at_once(changed: Experiment) -> np.ndarray:
        return three_ways(changed, record(changed), (SWEEP_PERIOD,))[0]

    found = {
        "": ("period", three_ways(e, recording, PERIODS)),
        "between_": ("period", three_ways(apart, record(apart), PERIODS, between=True)),
        "rate_": ("rate", np.array([at_once(with_draws(short, round(1 / (r * short.h)))) for r in RATES])),
        "size_": ("size", np.array([at_once(with_valve(short, size)) for size in SIZES])),
    }
    result = {
        prefix + way: ((dimension, "transport"), values[:, i])
        for prefix, (dimension, values) in found.items()
        for i, way in enumerate(WAYS)
    }
    reduced = ("transport", reduced_floor(e, recording, SWEEP_PERIOD))
    coords = {"period": list(PERIODS), "rate": list(RATES), "size": list(SIZES)}
    return xr.Dataset(
        result | {"reduced": reduced}, coords | {"transport": list(SHIFTS)} | experiment_labels(experiment)
    )


def described(dataset: xr.Dataset) -> xr.Dataset:
    """Return the datasets of this module with unit and long name on every variable."""
    dataset = dataset.copy()
    about = {
        "": "jumps on samples",
        "between_": "jumps between samples",
        "rate_": f"by rate of excitation, samples {SWEEP_PERIOD} s apart",
        "size_": f"by size of the valve, samples {SWEEP_PERIOD} s apart",
    }
    for prefix, case in about.items():
        for way, words in WAYS.items():
            name = f"RMS pressure error of signal transport, {words}; {case}"
            dataset[prefix + way].attrs = {"units": "Pa", "long_name": name}
    name = f"RMS pressure error of signal transport in {MODEL} at n = {N}, samples {SWEEP_PERIOD} s apart"
    dataset["reduced"].attrs = {"units": "Pa", "long_name": name}
    dataset["period"].attrs = {"units": "s", "long_name": "time between samples"}
    dataset["rate"].attrs = {"units": "s-1", "long_name": "draws of the excitation per second"}
    dataset["size"].attrs = {"units": "1", "long_name": "area of the valve over that of the study"}
    return dataset
