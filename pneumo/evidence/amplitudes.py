"""Open-loop amplitudes and the transport of signals from the mean square errors of Tables 7 and 9.

Fitted is Table 7, scored is Table 9. An open-loop amplitude concerns its own cylinder's open-loop experiments
only, so each experiment runs once per amplitude, and every pair of amplitudes follows by averaging.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.evidence.mechanics import Mapper
from pneumo.evidence.misfit import interval, noise, rms, scale
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.runge_kutta import STAGES
from pneumo.simulation.signals import EXACT_TRANSPORT, Transport, held, interpolated
from pneumo.verdict.published import table7, table9

AMPLITUDE_BOUNDS = (0.05, 10.0)  # V
COARSE = np.geomspace(*AMPLITUDE_BOUNDS, 13)
FINE = (COARSE[1] / COARSE[0]) ** (np.arange(-2, 3) / 3)  # around the best of the coarse ones, over it
DISCREPANCY = 0.03
LAG = 0.13e-3  # s
CYLINDERS = ("D", "E")


def transports(h: float) -> dict[str, Transport]:
    """Ways in which recorded signals, sampled every h seconds, may have reached the replays."""
    last_stage, u_late = np.zeros((STAGES, 3)), np.zeros((STAGES, 3))
    last_stage[-1] = 1.0
    u_late[:, 0] = 1.0
    return {
        "linear": interpolated(),
        "linear, 0.13 ms late": interpolated(LAG / h),
        "linear, last stage held": interpolated(last_stage),
        "linear, u a sample late": interpolated(u_late),
        "hold": held(),
        "exact": EXACT_TRANSPORT,
    }


def cell_mse(experiment: Experiment, n: tuple[float, ...], names: tuple[str, ...]) -> np.ndarray:
    """Mean square errors, Pa^2, of both chambers together, shape (transport, model, n).

    Infinite where a replay failed.
    """
    recording = record(experiment)
    lanes, index = grid_lanes(n, experiment.plant.gas.gamma)
    known = transports(experiment.h)
    cells = [replay(recording, lanes, known[name], experiment.steps) for name in names]
    result = np.stack([replays.mse.mean(axis=1)[index] for replays in cells])
    return np.where(np.isfinite(result), result, np.inf)


def table_7(mse: np.ndarray) -> np.ndarray:
    """Average over experiments, each model at its best n in each; from shape (..., experiment, model, n)."""
    return mse.min(axis=-1).mean(axis=-2)


def table_9(mse: np.ndarray, names: Sequence[str], levels: Mapping[str, Sequence[str]]) -> np.ndarray:
    """Average over each level's experiments, each model at its best n of that level, shape (level, model)."""
    return np.stack([mse[np.isin(names, members)].mean(axis=0).min(axis=-1) for members in levels.values()])


class Printed(NamedTuple):
    """Mean square errors as printed, Pa^2, and the standard deviation of their logarithm."""

    mse: np.ndarray
    sigma: np.ndarray


def printed(table: xr.Dataset) -> Printed:
    """Take the mean square errors out of Table 7 or 9."""
    mse = table["mse"].sel(model=list(MODELS))
    return Printed(mse.values, noise(mse.values, mse["mse_half_unit"].values, DISCREPANCY))


class Runs(NamedTuple):
    """What has been computed so far.

    Attributes
    ----------
    transports : tuple of str
    amplitudes : dict of str to numpy.ndarray
        Amplitudes of each cylinder, V, ascending.
    mse : dict of (str, float) to numpy.ndarray
        By experiment and, in open loop, its amplitude (0 in closed loop): shape (transport, model, n).
    """

    transports: tuple[str, ...]
    amplitudes: dict[str, np.ndarray]
    mse: dict[tuple[str, float], np.ndarray]


def runs(
    study: Study, amplitudes: Mapping[str, np.ndarray], transports: tuple[str, ...], mapper: Mapper
) -> Runs:
    """Run every open-loop experiment at each of its cylinder's amplitudes, and every closed-loop one."""
    tasks: dict[tuple[str, float], Experiment] = {}
    for name, experiment in study.experiments.items():
        if experiment.drive.closed_loop:
            tasks[name, 0.0] = experiment
            continue
        for amplitude in amplitudes[experiment.cylinder]:
            excitation = experiment.excitation._replace(amplitude=float(amplitude))
            tasks[name, float(amplitude)] = experiment._replace(excitation=excitation)
    order = sorted(tasks, key=lambda key: -tasks[key].steps)  # longest first: the threads end together
    found = mapper(lambda key: cell_mse(tasks[key], study.n, transports), order)
    return Runs(transports, dict(amplitudes), dict(zip(order, found, strict=True)))


def grid_of(study: Study, done: Runs, transport: str, a_D: float, a_E: float) -> np.ndarray:
    """Cells of all experiments at one pair of amplitudes, shape (experiment, model, n)."""
    row, of = done.transports.index(transport), {"D": a_D, "E": a_E}
    keys = (
        (name, 0.0 if experiment.drive.closed_loop else of[experiment.cylinder])
        for name, experiment in study.experiments.items()
    )
    return np.stack([done.mse[key][row] for key in keys])


def surface(study: Study, done: Runs, transport: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deviance of Table 7, and rms of Tables 7 and 9, for every pair of amplitudes of D and E."""
    seven, nine = printed(table7()), printed(table9())
    names = list(study.experiments)
    shape = tuple(len(done.amplitudes[cylinder]) for cylinder in CYLINDERS)
    deviance, rms_7, rms_9 = np.empty(shape), np.empty(shape), np.empty(shape)
    for i, a_D in enumerate(done.amplitudes["D"]):
        for j, a_E in enumerate(done.amplitudes["E"]):
            mse = grid_of(study, done, transport, float(a_D), float(a_E))
            ratio_7 = np.log(table_7(mse) / seven.mse)
            deviance[i, j] = np.sum((ratio_7 / seven.sigma) ** 2)
            rms_7[i, j] = rms(ratio_7)
            rms_9[i, j] = rms(np.log(table_9(mse, names, study.experiments_by_level) / nine.mse))
    return deviance, rms_7, rms_9


def identify_amplitudes(study: Study, mapper: Mapper, say: Callable[[str], None]) -> xr.Dataset:
    """Estimate the open-loop amplitudes, and compare the transports by the same misfit.

    Parameters
    ----------
    study : Study
        With all experiments of the paper, at full length.
    mapper
        ``map``, or that of a pool.
    say
        Told what was just found.
    """
    coarse = runs(study, dict.fromkeys(CYLINDERS, COARSE), ("linear",), mapper)
    best = np.unravel_index(np.argmin(surface(study, coarse, "linear")[0]), (len(COARSE),) * 2)
    inner = np.clip(best, 1, len(COARSE) - 2)  # so that the finer ones stay within the bounds
    centre = {cylinder: COARSE[i] for cylinder, i in zip(CYLINDERS, inner, strict=True)}
    say("amplitudes, wide bounds: " + ", ".join(f"{name} {a:.3g} V" for name, a in centre.items()))

    names = tuple(transports(1.0))
    around = {name: a * FINE for name, a in centre.items()}
    fine = runs(study, around, names, mapper)
    say(f"amplitudes, refined, and {len(names)} transports")

    both = {name: np.union1d(COARSE, around[name]) for name in CYLINDERS}
    cells = coarse.mse | {key: value[:1] for key, value in fine.mse.items()}
    deviance, rms_7, rms_9 = surface(study, Runs(("linear",), both, cells), "linear")
    lowest = np.unravel_index(np.argmin(deviance), deviance.shape)
    widen = scale(deviance[lowest], len(MODELS), len(CYLINDERS))
    deviance = (deviance - deviance[lowest]) / widen
    profiles = [deviance.min(axis=1), deviance.min(axis=0)]
    ends = [interval(np.log(both[name]), curve) for name, curve in zip(CYLINDERS, profiles, strict=True)]

    misfits = [surface(study, fine, name) for name in names]
    at = [np.unravel_index(np.argmin(one[0]), one[0].shape) for one in misfits]
    return xr.Dataset(
        {
            "amplitude": ("cylinder", [both[name][i] for name, i in zip(CYLINDERS, lowest, strict=True)]),
            "amplitude_low": ("cylinder", np.exp([end[0] for end in ends])),
            "amplitude_high": ("cylinder", np.exp([end[1] for end in ends])),
            "amplitude_value": (("cylinder", "amplitude_point"), np.stack([both[n] for n in CYLINDERS])),
            "amplitude_deviance": (("cylinder", "amplitude_point"), np.stack(profiles)),
            "amplitude_widening": ((), widen),
            "amplitude_rms": ("table", [rms_7[lowest], rms_9[lowest]]),
            "transport_rms": (
                ("transport", "table"),
                [[one[1][i], one[2][i]] for one, i in zip(misfits, at, strict=True)],
            ),
            "transport_amplitude": (
                ("transport", "cylinder"),
                [[fine.amplitudes[n][k] for n, k in zip(CYLINDERS, i, strict=True)] for i in at],
            ),
            "runs": ((), len(coarse.mse) + len(fine.mse)),
        },
        coords={"cylinder": list(CYLINDERS), "transport": list(names), "table": [7, 9]},
    )
