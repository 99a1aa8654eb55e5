"""Open-loop amplitudes and signal sampling, identified from Table 7 and checked against Table 9.

An amplitude affects its own cylinder's open-loop experiments only. So each experiment runs once per
amplitude, and the tables of every pair of amplitudes follow by averaging.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.configuration.sampling import HELD, HELD_TO_NEXT, INTERPOLATED, Sampling
from pneumo.evidence.identification.deviance import deviance_interval, log_noise, widening
from pneumo.evidence.identification.mechanics import Mapper
from pneumo.evidence.sensitivity.alternatives import OTHER_SAMPLINGS
from pneumo.papers.paper_2006.paper_models import PAPER_MODELS
from pneumo.papers.paper_2006.printed_tables import table7, table9
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.statistics.averages import rms_of

COARSE = np.geomspace(0.05, 10.0, 13)  # V
REFINED_FACTORS = (COARSE[1] / COARSE[0]) ** (np.arange(-2, 3) / 3)  # over the best of the coarse ones
MSE_DISCREPANCY = 0.03
TRIED_LAG = 0.13e-3  # s
BOTH_CYLINDERS = ("D", "E")
AS_CONFIGURED = "as configured"  # name of the study's own signal sampling among those tried


def tried_samplings(experiment: Experiment) -> dict[str, Sampling]:
    """Signal samplings that the replays of an experiment may have had."""
    return {
        AS_CONFIGURED: study_sampling(PUBLISHED, experiment),
        "linear": INTERPOLATED,
        "linear, 0.13 ms late": INTERPOLATED._replace(delay=(TRIED_LAG / experiment.h,) * 3),
        "linear, u a sample late": OTHER_SAMPLINGS["command_late"],
        "hold": HELD,
        "hold, end of step next": HELD_TO_NEXT,
        "exact": OTHER_SAMPLINGS["exact_transport"],
    }


def cell_mse(experiment: Experiment, n: tuple[float, ...], names: tuple[str, ...]) -> np.ndarray:
    """Mean square errors, Pa^2, of both chambers together, shape (transport, model of the paper, n).

    Infinite where a replay failed.
    """
    recording = record(experiment)
    lanes, index = grid_lanes(n, experiment.plant.gas.gamma)
    index = index[np.isin(list(MODELS), list(PAPER_MODELS))]
    known = tried_samplings(experiment)
    cells = [replay(recording, lanes, known[name], experiment.steps) for name in names]
    result = np.stack([replays.mse.mean(axis=1)[index] for replays in cells])
    return np.where(np.isfinite(result), result, np.inf)


def averages_of_table_7(mse: np.ndarray) -> np.ndarray:
    """Average over experiments, each model at its best n in each; from shape (..., experiment, model, n)."""
    return mse.min(axis=-1).mean(axis=-2)


def averages_of_table_9(
    mse: np.ndarray, names: Sequence[str], levels: Mapping[str, Sequence[str]]
) -> np.ndarray:
    """Average over each level's experiments, each model at its best n of that level, shape (level, model)."""
    return np.stack([mse[np.isin(names, members)].mean(axis=0).min(axis=-1) for members in levels.values()])


class AmplitudeRuns(NamedTuple):
    """Mean square errors of the experiments at each amplitude."""

    transports: tuple[str, ...]
    amplitudes: dict[str, np.ndarray]  #: of each cylinder, V, ascending
    #: By experiment and, in open loop, its amplitude (0 in closed loop): shape (transport, model, n).
    mse: dict[tuple[str, float], np.ndarray]


def run_at_amplitudes(
    study: Study, amplitudes: Mapping[str, np.ndarray], transports: tuple[str, ...], mapper: Mapper
) -> AmplitudeRuns:
    """Run every open-loop experiment at each of its cylinder's amplitudes, and every closed-loop one."""
    tasks: dict[tuple[str, float], Experiment] = {}
    for name, e in study.experiments.items():
        if e.drive.closed_loop:
            tasks[name, 0.0] = e
            continue
        for amplitude in amplitudes[e.cylinder].tolist():
            tasks[name, amplitude] = e._replace(excitation=e.excitation._replace(amplitude=amplitude))
    order = sorted(tasks, key=lambda key: -tasks[key].steps)  # longest first: the threads end together
    errors = mapper(lambda key: cell_mse(tasks[key], study.n, transports), order)
    return AmplitudeRuns(transports, dict(amplitudes), dict(zip(order, errors, strict=True)))


def grid_of(study: Study, done: AmplitudeRuns, transport: str, a_D: float, a_E: float) -> np.ndarray:
    """Cells of all experiments at one pair of amplitudes, shape (experiment, model, n)."""
    row, amplitude = done.transports.index(transport), {"D": a_D, "E": a_E}
    experiments = study.experiments.items()
    keys = [(name, 0.0 if e.drive.closed_loop else amplitude[e.cylinder]) for name, e in experiments]
    return np.stack([done.mse[key][row] for key in keys])


def surface(study: Study, done: AmplitudeRuns, transport: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deviance of Table 7, and rms of Tables 7 and 9, for every pair of amplitudes of D and E."""
    seven, nine = (table["mse"].sel(model=list(PAPER_MODELS)) for table in (table7(), table9()))
    sigma = log_noise(seven.values, seven["mse_half_unit"].values, MSE_DISCREPANCY)
    names = list(study.experiments)
    deviance, rms_7, rms_9 = np.empty((3, *(len(done.amplitudes[name]) for name in BOTH_CYLINDERS)))
    for i, a_D in enumerate(done.amplitudes["D"]):
        for j, a_E in enumerate(done.amplitudes["E"]):
            mse = grid_of(study, done, transport, float(a_D), float(a_E))
            ratio_7 = np.log(averages_of_table_7(mse) / seven.values)
            deviance[i, j] = np.sum((ratio_7 / sigma) ** 2)
            ratio_9 = np.log(averages_of_table_9(mse, names, study.experiments_by_level) / nine.values)
            rms_7[i, j], rms_9[i, j] = rms_of(ratio_7), rms_of(ratio_9)
    return deviance, rms_7, rms_9


def identify_amplitudes(study: Study, mapper: Mapper, progress: Callable[[str], None]) -> xr.Dataset:
    """Estimate the open-loop amplitudes, and compare signal samplings by the same misfit.

    The study has all experiments of the paper at full length; `progress` gets a line after each stage.
    """
    coarse = run_at_amplitudes(study, dict.fromkeys(BOTH_CYLINDERS, COARSE), (AS_CONFIGURED,), mapper)
    best = np.unravel_index(np.argmin(surface(study, coarse, AS_CONFIGURED)[0]), (len(COARSE),) * 2)
    inner = np.clip(best, 1, len(COARSE) - 2)  # so that the finer ones stay within the bounds
    centre = {cylinder: COARSE[i] for cylinder, i in zip(BOTH_CYLINDERS, inner, strict=True)}
    progress("amplitudes, wide bounds: " + ", ".join(f"{name} {a:.3g} V" for name, a in centre.items()))

    names = tuple(tried_samplings(next(iter(study.experiments.values()))))
    around = {name: a * REFINED_FACTORS for name, a in centre.items()}
    fine = run_at_amplitudes(study, around, names, mapper)
    progress(f"amplitudes, refined, and {len(names)} transports")

    both = {name: np.union1d(COARSE, around[name]) for name in BOTH_CYLINDERS}
    cells = coarse.mse | {key: value[:1] for key, value in fine.mse.items()}
    deviance, rms_7, rms_9 = surface(study, AmplitudeRuns((AS_CONFIGURED,), both, cells), AS_CONFIGURED)
    lowest = np.unravel_index(np.argmin(deviance), deviance.shape)
    widen = widening(deviance[lowest], len(PAPER_MODELS), len(BOTH_CYLINDERS))
    deviance = (deviance - deviance[lowest]) / widen
    values, profiles = [both[name] for name in BOTH_CYLINDERS], [deviance.min(axis=1), deviance.min(axis=0)]
    ends = [deviance_interval(np.log(a), curve) for a, curve in zip(values, profiles, strict=True)]

    misfits = [surface(study, fine, name) for name in names]
    best_pairs = [np.unravel_index(np.argmin(deviances), deviances.shape) for deviances, _, _ in misfits]
    rms = [[on_7[i], on_9[i]] for (_, on_7, on_9), i in zip(misfits, best_pairs, strict=True)]
    tried = [[fine.amplitudes[n][k] for n, k in zip(BOTH_CYLINDERS, i, strict=True)] for i in best_pairs]
    return xr.Dataset(
        {
            "amplitude": ("cylinder", [amplitudes[i] for amplitudes, i in zip(values, lowest, strict=True)]),
            "amplitude_low": ("cylinder", np.exp([end[0] for end in ends])),
            "amplitude_high": ("cylinder", np.exp([end[1] for end in ends])),
            "amplitude_value": (("cylinder", "amplitude_point"), np.stack(values)),
            "amplitude_deviance": (("cylinder", "amplitude_point"), np.stack(profiles)),
            "amplitude_widening": ((), widen),
            "amplitude_rms": ("table", [rms_7[lowest], rms_9[lowest]]),
            "transport_rms": (("transport", "table"), rms),
            "transport_amplitude": (("transport", "cylinder"), tried),
            "runs": ((), len(coarse.mse) + len(fine.mse)),
        },
        coords={"cylinder": list(BOTH_CYLINDERS), "transport": list(names), "table": [7, 9]},
    )
