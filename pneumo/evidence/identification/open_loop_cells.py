"""Errors of the models in open loop, with each setup that paper/decisions/0062 names.

A setup says how an open-loop command is reversed near the ends of the stroke, how late the record shows it,
how replays read the samples, and how large the command is. It is about one cylinder's open loops only.
"""

import itertools
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.configuration.sampling import SAMPLINGS
from pneumo.physics.models import MODELS
from pneumo.simulation.excitation import reference_series, reversed_late
from pneumo.simulation.full_order import Recording, record
from pneumo.storage.grid_layout import replayed_grid


class OpenLoopSetup(NamedTuple):
    """How the open-loop command of one cylinder is made, recorded and read; words as in the configuration."""

    late: float  # samples by which a reversal is late in the recorded command; draws are on time
    reversal: str
    reversal_tested: str
    replays_read: str
    amplitude: float  # V


OPTIONS: dict[str, tuple[Any, ...]] = {  # of each key
    "late": (0.0, 0.5, 1.0),
    "reversal": ("forced", "toggled"),
    "reversal_tested": ("each step", "each stage"),
    "replays_read": ("linear", "hold_next", "hold"),
    "amplitude": (0.5, 0.3**0.5, 0.6, 0.8),
}
SETUPS = tuple(OpenLoopSetup(*options) for options in itertools.product(*OPTIONS.values()))


def configured_setup(study: Study, cylinder: str) -> OpenLoopSetup:
    """Setup that a study has for a cylinder's open loops."""
    open_loops = (e for e in study.experiments.values() if not e.drive.closed_loop)
    e = next(e for e in open_loops if e.cylinder == cylinder)
    reversal = "toggled" if e.drive.toggles else "forced"
    tested = "each stage" if e.drive.each_stage else "each step"
    return OpenLoopSetup(e.drive.late, reversal, tested, e.sampling.rule, e.excitation.amplitude)


def with_setup(experiment: Experiment, setup: OpenLoopSetup) -> Experiment:
    """Return an open-loop experiment with a setup."""
    toggles, each_stage = setup.reversal == "toggled", setup.reversal_tested == "each stage"
    return experiment._replace(
        drive=experiment.drive._replace(toggles=toggles, each_stage=each_stage, late=setup.late),
        excitation=experiment.excitation._replace(amplitude=setup.amplitude),
        sampling=SAMPLINGS[setup.replays_read],
    )


def draws_of(experiment: Experiment) -> np.ndarray:
    """Open-loop sequence before any reversal, V, shape (steps + 1,)."""
    return reference_series(experiment.drive, experiment.excitation, experiment.steps)


def reversals(recording: Recording, draws: np.ndarray) -> int:
    """Number of reversals in a run: changes of sign of the product of command and draws."""
    return int(np.count_nonzero(np.diff(np.sign(recording.u * draws))))


def joined_cells(study: Study, experiment: Experiment, recording: Recording) -> np.ndarray:
    """Mean error, Pa, and mean square error, Pa^2, of both chambers together, shape (2, model, n).

    Both are NaN where a replay failed.
    """
    cells = replayed_grid(experiment, study.n, recording, experiment.sampling, experiment.steps)
    both = [cells[name].mean("chamber", skipna=False) for name in ("mean_error", "mse")]
    return np.stack([values.transpose("model", "n").values for values in both])


def open_loop_cells(study: Study, threads: int, progress: Callable[[str], None]) -> xr.Dataset:
    """Errors of every cell of the study: open loops with each of `SETUPS`, closed loops as configured.

    ``mean_error``, Pa, and ``mse``, Pa^2, of both chambers together by (open_loop, model, n, setup);
    ``closed_mean_error`` and ``closed_mse`` by (closed_loop, model, n); ``reversals`` in a run by (open_loop,
    setup). The result does not depend on `threads`; `progress` gets a line after each open-loop experiment.
    """
    open_loops = {name: e for name, e in study.experiments.items() if not e.drive.closed_loop}
    closed_loops = {name: e for name, e in study.experiments.items() if e.drive.closed_loop}
    shape = (len(MODELS), len(study.n))
    errors = np.empty((2, len(open_loops), *shape, len(SETUPS)))
    closed = np.empty((2, len(closed_loops), *shape))
    counts = np.empty((len(open_loops), len(SETUPS)), dtype=np.int32)

    def run(name: str, same_run: OpenLoopSetup) -> None:
        """Run an experiment once, and replay it with each setup that differs in late and replays_read."""
        i, e = list(open_loops).index(name), with_setup(open_loops[name], same_run)
        recording, draws = record(e), draws_of(e)
        for late, read in itertools.product(OPTIONS["late"], OPTIONS["replays_read"]):
            setup = same_run._replace(late=late, replays_read=read)
            j = SETUPS.index(setup)
            recorded = recording._replace(u=reversed_late(recording.u, draws, late))  # of one run, on time
            errors[:, i, :, :, j] = joined_cells(study, with_setup(e, setup), recorded)
            counts[i, j] = reversals(recording, draws)

    runs = [setup for setup in SETUPS if (setup.late, setup.replays_read) == (0.0, "linear")]
    with ThreadPoolExecutor(threads) as pool:  # the kernels hold no lock while they run
        for name in sorted(open_loops, key=lambda name: open_loops[name].steps):
            list(pool.map(lambda setup, name=name: run(name, setup), runs))
            progress(f"{name}: {len(SETUPS)} open-loop setups, done")
    for i, e in enumerate(closed_loops.values()):
        closed[:, i] = joined_cells(study, e, record(e))

    by_setup = ("open_loop", "model", "n", "setup")
    by_run = ("closed_loop", "model", "n")
    dataset = xr.Dataset(
        {
            "mean_error": (by_setup, errors[0]),
            "mse": (by_setup, errors[1]),
            "closed_mean_error": (by_run, closed[0], {"units": "Pa", "long_name": "mean_error, closed loop"}),
            "closed_mse": (by_run, closed[1], {"units": "Pa2", "long_name": "mse, closed loop"}),
            "reversals": (("open_loop", "setup"), counts, {"units": "1", "long_name": "reversals in a run"}),
        },
        coords={"model": list(MODELS), "n": list(study.n)}
        | {"open_loop": list(open_loops), "closed_loop": list(closed_loops)},
    )
    return dataset.assign_coords(setup_coordinates())


SETUP_LONG_NAMES = {  # (long name, unit)
    "late": ("samples by which a reversal is late in the recorded command", "1"),
    "reversal": ("reversal of the open-loop command", ""),
    "reversal_tested": ("when the position is tested for a reversal", ""),
    "replays_read": ("how replays read the samples", ""),
    "amplitude": ("magnitude of the open-loop command", "V"),
}


def setup_coordinates() -> dict[str, xr.Variable]:
    """Coordinates along ``setup``: one for each field of `OpenLoopSetup`."""
    columns = dict(zip(OpenLoopSetup._fields, map(list, zip(*SETUPS, strict=True)), strict=True))
    described = {name: {"long_name": text, "units": unit} for name, (text, unit) in SETUP_LONG_NAMES.items()}
    for about in described.values():
        if not about["units"]:
            del about["units"]
    return {name: xr.Variable("setup", values, described[name]) for name, values in columns.items()}
