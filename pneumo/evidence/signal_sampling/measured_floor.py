"""Error floor of sampled signals: measured with replays, and predicted without them.

The chambers' own equations are replayed on sampled signals of a full-order run at a fine step, so that
sampling is the only error. All errors are RMS over the run and both chambers.
"""

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.evidence.signal_sampling import floor_theory as theory
from pneumo.evidence.signal_sampling.error_budget import refined, sliced
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation.chamber_replay import replay_chambers
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.statistics.averages import rms_of
from pneumo.storage.layout import described, experiment_labels

# At most 120 s long, so at full length.
FLOOR_EXPERIMENTS = ("E09", "E10", "E11", "E12", "E13", "E14", "E15", "E16")
FLOOR_REFINEMENT = 10  # steps within one of the study's: every period is a multiple
SWEPT = ("linear", "hold", "delay")  # samplings at all periods
FLOOR_PERIODS = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2)  # s between samples
DRAW_RATES = (5.0, 10.0, 20.0, 40.0, 100.0)  # draws per second, each a multiple of 1 ms apart
VALVE_SIZES = (0.25, 0.5, 1.0, 2.0, 4.0)  # valve's area over that of the study
SWEEP = 20.0  # s from the start where rate and size vary; prediction and measurement see the same run
SWEEP_PERIOD = 1e-3  # s, the study's own
PRIME_STEPS = 503  # fine steps between draws that do not fall on samples: 50.3 ms
FLOOR_MODEL, FLOOR_N = "M8", 1.35  # the reduced model whose floor is measured too
FLOOR_SOURCES = {
    "measured": "replayed on sampled signals",
    "predicted": "linear theory along the run",
    "formula": "closed formula",
}


def floors(
    e: Experiment, recording: Recording, periods: tuple[float, ...], between: bool = False
) -> np.ndarray:
    """RMS error of replays of the full order itself on sampled signals, Pa: measured, and by theory.

    Shape (period between samples, `FLOOR_SOURCES`, `SWEPT`). `between` tells the formula that jumps of the
    signals may fall between samples.
    """
    full = recording.states[::FLOOR_REFINEMENT, [2, 4]].T
    known, late = (
        theory.averages(recording, e.excitation.every),
        theory.late_rest(recording, FLOOR_REFINEMENT),
    )
    delays = theory.sensitivities(e.plant, known)
    result = np.empty((len(periods), len(FLOOR_SOURCES), len(SWEPT)))
    for i, period in enumerate(periods):
        every = round(period / e.h)
        for j, name in enumerate(SWEPT):
            sampling = theory.SHIFTS[name].sampling._replace(every=every)
            replayed = replay_chambers(recording, sampling, FLOOR_REFINEMENT)
            predicted = theory.predicted_error(recording, period, name, FLOOR_REFINEMENT, late)
            scattered = between and every > 1  # if every step is a sample, all jumps fall on them
            formula = theory.floor(delays, period, name, early=known.early, between=scattered)
            result[i, :, j] = rms_of(full - replayed), rms_of(predicted), formula
    return result


def reduced_floor(e: Experiment, recording: Recording, period: float) -> list[float]:
    """RMS difference between a reduced model's replays on exact and on sampled signals, Pa, by `SWEPT`."""
    lanes = lane_array([lane(MODELS[FLOOR_MODEL], FLOOR_N, e.plant.gas.gamma)])
    sampled = (theory.SHIFTS[name].sampling._replace(every=round(period / e.h)) for name in SWEPT)
    exact, *others = (
        replay(recording, lanes, sampling, FLOOR_REFINEMENT).pressure[0]
        for sampling in (EXACT_SAMPLING, *sampled)
    )
    return [rms_of(exact - pressure) for pressure in others]


def own_floor(e: Experiment) -> tuple[float, float]:
    """Floor of the published sampling at the experiment's own step, Pa: measured, and by linear theory."""
    recording = record(e)
    replayed = replay_chambers(recording, study_sampling(PUBLISHED, e), 1)
    predicted = theory.predicted_error(recording, e.h, e.sampling.rule)
    return rms_of(recording.states[:, [2, 4]].T - replayed), rms_of(predicted)


def measured_floor(experiment: Experiment) -> xr.Dataset:
    """Floor of one experiment by time between samples, rate of excitation and size of the valve.

    RMS errors, Pa: `measured`, `predicted` and `formula` by (period, transport); the same with the prefix
    ``between_`` for jumps that do not fall on samples, ``rate_`` by (rate, transport) and ``size_`` by (size,
    transport); `reduced` by transport at the study's own period; `own_measured` and `own_predicted` of the
    published sampling. In all but these last two, reversals are recorded without delay.
    """
    on_time = experiment._replace(drive=experiment.drive._replace(late=0.0))
    e, short = refined(on_time, FLOOR_REFINEMENT), refined(sliced(on_time, SWEEP), FLOOR_REFINEMENT)
    recording, plant = record(e), short.plant

    def with_draws(every: int) -> Experiment:
        return short._replace(excitation=short.excitation._replace(every=every))

    def with_valve(size: float) -> Experiment:
        valve = plant.valve._replace(k_xu=size * plant.valve.k_xu)
        return short._replace(plant=plant._replace(valve=valve))

    def at_once(changed: Experiment) -> np.ndarray:
        return floors(changed, record(changed), (SWEEP_PERIOD,))[0]

    apart, rates = (
        with_draws(PRIME_STEPS),
        [at_once(with_draws(round(1 / (r * short.h)))) for r in DRAW_RATES],
    )
    sweeps = {
        "": ("period", floors(e, recording, FLOOR_PERIODS)),
        "between_": ("period", floors(apart, record(apart), FLOOR_PERIODS, between=True)),
        "rate_": ("rate", np.array(rates)),
        "size_": ("size", np.array([at_once(with_valve(size)) for size in VALVE_SIZES])),
    }
    result = {
        prefix + source: ((dimension, "transport"), values[:, i])
        for prefix, (dimension, values) in sweeps.items()
        for i, source in enumerate(FLOOR_SOURCES)
    }
    reduced = ("transport", reduced_floor(e, recording, SWEEP_PERIOD))
    coords = {"period": list(FLOOR_PERIODS), "rate": list(DRAW_RATES), "size": list(VALVE_SIZES)}
    coords |= {"transport": list(SWEPT)} | experiment_labels(experiment)
    own_measured, own_predicted = own_floor(experiment)
    result |= {"reduced": reduced, "own_measured": own_measured, "own_predicted": own_predicted}
    return xr.Dataset(result, coords)


def with_floor_attributes(dataset: xr.Dataset) -> xr.Dataset:
    """Return floors with unit and long name on every variable."""
    floor, apart = "RMS pressure error of signal sampling", f"samples {SWEEP_PERIOD} s apart"
    cases = {
        "": "jumps on samples",
        "between_": "jumps between samples",
        "rate_": f"by rate of excitation, {apart}",
        "size_": f"by size of the valve, {apart}",
    }
    about = {
        "own_measured": ("Pa", f"{floor}, published signal sampling, {FLOOR_SOURCES['measured']}"),
        "own_predicted": ("Pa", f"{floor}, published signal sampling, {FLOOR_SOURCES['predicted']}"),
        "reduced": ("Pa", f"{floor} in {FLOOR_MODEL} at n = {FLOOR_N}, {apart}"),
        "period": ("s", "time between samples"),
        "rate": ("s-1", "draws of the excitation per second"),
        "size": ("1", "area of the valve over that of the study"),
    }
    for prefix, case in cases.items():
        about |= {prefix + name: ("Pa", f"{floor}, {words}; {case}") for name, words in FLOOR_SOURCES.items()}
    return described(dataset, about)
