"""What the paper leaves open, toggled one at a time: effect on every cell of Tables 5, 7, 8 and 9.

``paper/2006/assumptions.yaml`` lists the alternatives: keys of the configuration, or words for one of `VARIANTS`.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.configuration.parameters import merged, study, validated
from pneumo.errors import ConfigurationError
from pneumo.evidence.readings import first_draw_skipped, keeps_changed_sign, largest_excursions
from pneumo.papers.paper_2006 import computations  # noqa: F401 - it registers its computations
from pneumo.papers.paper_2006.computations import COMPUTATIONS
from pneumo.simulation.full_order import RAN, Recording, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.runge_kutta import STAGES
from pneumo.simulation.settling import QUANTITIES, Settling, settle
from pneumo.simulation.signals import EXACT, PUBLISHED, held, interpolated, study_transport
from pneumo.statistics.averages import statistics
from pneumo.storage.grid_layout import replay_dataset
from pneumo.storage.layout import experiment_labels
from pneumo.verdict import PAPER_FOLDER
from pneumo.verdict.assumptions import AS_TAKEN, read_assumptions
from pneumo.verdict.claims import Claim, PaperError
from pneumo.verdict.sources import MissingEvidence, StudyResults

TABLES = (5, 7, 8, 9)
LONGEST_RUN = 3000.0  # s; twice what a settling run of the study takes; one that takes longer has no time

READINGS = {  # other ways in which the replays' stages may have read (u, x, v)
    "hold": held(),
    "command_late": interpolated(np.outer(np.ones(STAGES), [1.0, 0.0, 0.0])),
    "last_stage_late": interpolated(np.outer(np.arange(STAGES) == STAGES - 1, np.ones(3))),
}


class Case(NamedTuple):
    """The whole study as one alternative would have it.

    Attributes
    ----------
    study : Study
    record : callable
        Makes the full-order run of an experiment.
    times : callable
        Reads the four settling times off a settling run; gets the step, s, too.
    transport : str
        ``published``, ``exact``, or a key of `READINGS`.
    sign : float
        Of the error.
    ddof : int
        Of the variance of means in eq (16).
    """

    study: Study
    record: Callable[[Experiment], Recording] = record
    times: Callable[[Settling, float], np.ndarray] = lambda settling, h: settling.times
    transport: str = PUBLISHED
    sign: float = 1.0
    ddof: int = 1


def _with_cylinder(case: Case, change: Callable[[Any], dict[str, Any]]) -> Case:
    experiments = {}
    for name, experiment in case.study.experiments.items():
        cylinder = experiment.plant.cylinder
        plant = experiment.plant._replace(cylinder=cylinder._replace(**change(cylinder)))
        experiments[name] = experiment._replace(plant=plant)
    return case._replace(study=case.study._replace(experiments=experiments))


ROD = 1 - 0.4**2  # share of the bore's area that a rod of 0.4 bores leaves
VARIANTS: dict[str, Callable[[Case], Case]] = {
    "rod.rod_40_percent": lambda case: _with_cylinder(
        case, lambda c: {"A_A": ROD * c.A_A, "A_B": ROD * c.A_B}
    ),
    "end_stop_law.no_rest_rule": lambda case: _with_cylinder(case, lambda c: {"rests": False}),
    "settling_change.largest_excursion": lambda case: case._replace(times=largest_excursions),
    "generator.first_draw_skipped": lambda case: case._replace(record=first_draw_skipped),
    "sign_reversal.toggle": lambda case: case._replace(record=keeps_changed_sign),
    "transport.exact_transport": lambda case: case._replace(transport=EXACT),
    **{f"transport.{name}": lambda case, name=name: case._replace(transport=name) for name in READINGS},
    "error_sign.reduced_minus_full": lambda case: case._replace(sign=-1.0),
    "variance_of_means.population": lambda case: case._replace(ddof=0),
}


def cases(configuration: Mapping[str, Any], folder: Path = PAPER_FOLDER) -> dict[str, Case]:
    """Every alternative of the ledger, named ``assumption.alternative``, after the study `AS_TAKEN`.

    Parameters
    ----------
    configuration : mapping
        The study's configuration, as in its file.
    folder : pathlib.Path
        Folder of ``assumptions.yaml``.

    Raises
    ------
    PaperError
        If an alternative in words has no code, or names a key that the configuration lacks.
    """
    file = folder / "assumptions.yaml"
    taken = Case(study(validated(configuration, [("configuration", configuration)])))
    found = {AS_TAKEN: taken}
    for assumption, entry in read_assumptions(folder).items():
        for alternative, change in entry.alternatives.items():
            name = f"{assumption}.{alternative}"
            if isinstance(change, str):
                if name not in VARIANTS:
                    raise PaperError(f"{file}: {name}: no code for {change!r}; left_out takes a reason")
                found[name] = VARIANTS[name](taken)
                continue
            found[name] = overridden(configuration, change, f"{file}: {name}")
    return found


def overridden(configuration: Mapping[str, Any], change: Mapping[str, Any], source: str) -> Case:
    """Study whose configuration has other values at some keys, such as ``supply.P_s_Pa``.

    Raises
    ------
    PaperError
        If the values are none for a configuration; `source` says where they come from.
    """
    override: dict[str, Any] = {}
    for key, value in change.items():
        override = merged(override, _nested(key.split("."), value))
    sources = [("configuration", configuration), (source, override)]
    try:
        return Case(study(validated(merged(configuration, override), sources)))
    except ConfigurationError as error:
        raise PaperError(str(error)) from None


def _nested(path: Sequence[str], value: Any) -> Any:
    return {path[0]: _nested(path[1:], value)} if path else value


class Run(NamedTuple):
    """One experiment under one alternative: every cell of the grid, and the settling times."""

    cells: xr.Dataset
    times: xr.DataArray


def run_experiment(name: str, alternatives: Mapping[str, Case]) -> dict[str, Run]:
    """Run one experiment under every alternative; what an alternative leaves alone is run once.

    Parameters
    ----------
    name : str
        Name of the experiment.
    alternatives : mapping of str to Case

    Returns
    -------
    dict of str to Run
    """
    by_recording: dict[Any, dict[Any, list[str]]] = {}
    for alternative, case in alternatives.items():
        e = case.study.experiments[name]
        same_run = (e.plant, e.drive, e.excitation, e.h, e.steps, case.record)
        lag = case.study.lag if case.transport == PUBLISHED else 0.0
        by_recording.setdefault(same_run, {}).setdefault((case.transport, lag), []).append(alternative)
    cells: dict[str, xr.Dataset] = {}
    for by_replay in by_recording.values():
        recording = None  # of one at a time: a long run holds a quarter of a gigabyte
        for (transport, lag), members in by_replay.items():
            case = alternatives[members[0]]
            experiment = case.study.experiments[name]
            recording = case.record(experiment) if recording is None else recording
            found = _cells(case.study, experiment, recording, transport, lag)
            cells |= {member: found for member in members}

    runs: dict[Any, xr.DataArray] = {}
    settled: dict[Any, Settling] = {}
    times: dict[str, xr.DataArray] = {}
    for alternative, case in alternatives.items():
        e = case.study.experiments[name]
        same_run = (e.plant, e.drive, e.push, e.h)
        if same_run not in settled:
            settled[same_run] = settle(e, longest=LONGEST_RUN)
        key = (same_run, case.times)
        if key not in runs:
            settling = settled[same_run]
            values = case.times(settling, e.h) if settling.status == RAN else settling.times
            coords = {"quantity": list(QUANTITIES)} | experiment_labels(e)
            runs[key] = xr.DataArray(values, coords, ("quantity",), "settling_time")
        times[alternative] = runs[key]
    replays = sum(map(len, by_recording.values()))
    print(
        f"{name}: {len(by_recording)} full-order runs, {replays} replays, {len(settled)} settling runs, done",
        flush=True,
    )
    return {alternative: Run(cells[alternative], times[alternative]) for alternative in alternatives}


def _cells(
    study: Study, experiment: Experiment, recording: Recording, transport: str, lag: float
) -> xr.Dataset:
    """Mean error, mean square error and failure time of every cell; no pressures."""
    lanes, index = grid_lanes(study.n, experiment.plant.gas.gamma)
    reading = READINGS.get(transport) or study_transport(transport, lag, experiment.h)
    cells = replay(recording, lanes, reading, experiment.steps)
    return replay_dataset(experiment, study.n, index, cells)[["mean_error", "mse", "failure_time"]]


class Toggled(StudyResults):
    """Tables 5, 7, 8 and 9 of one alternative in the place of results."""

    def __init__(self, case: Case, runs: Mapping[str, Run]):
        super().__init__(Path(), case.transport)
        grid = xr.concat(
            [run.cells for run in runs.values()],
            "experiment",
            coords=["cylinder", "loop", "k_0"],
            compat="equals",
        )
        grid["mean_error"] = case.sign * grid["mean_error"]
        self.study = case.study
        self.statistics = statistics(grid, case.study.experiments_by_level, case.ddof)
        self.settling_times = xr.concat(
            [run.times for run in runs.values()],
            "experiment",
            coords=["cylinder", "loop", "k_0"],
            compat="equals",
        )

    def value(self, claim: Claim) -> float:
        """What a claim's computation finds here; NaN if it finds nothing."""
        try:
            value = COMPUTATIONS[claim.compute](self, **claim.arguments).value
        except MissingEvidence:
            return np.nan
        return np.nan if value is None else value


def reproduced(alternatives: Mapping[str, Case], claims: Mapping[str, Claim], threads: int = 1) -> xr.Dataset:
    """Every cell of Tables 5, 7, 8 and 9 under every alternative.

    Parameters
    ----------
    alternatives : mapping of str to Case
        From `cases`; all of the same experiments.
    claims : mapping of str to Claim
        Items of the verdict; those of other tables are passed over.
    threads : int
        Experiments that run side by side.

    Returns
    -------
    xarray.Dataset
        `reproduced` by (alternative, item), each in its item's unit, NaN where there is no number.
    """
    items = {name: claim for name, claim in claims.items() if claim.table in TABLES}
    experiments = next(iter(alternatives.values())).study.experiments
    longest_first = sorted(experiments, key=lambda name: -experiments[name].steps)
    with ThreadPoolExecutor(threads) as pool:
        runs = dict(
            zip(
                longest_first,
                pool.map(lambda name: run_experiment(name, alternatives), longest_first),
                strict=True,
            )
        )
    values = np.empty((len(alternatives), len(items)))
    for i, (name, case) in enumerate(alternatives.items()):
        results = Toggled(case, {experiment: runs[experiment][name] for experiment in experiments})
        values[i] = [results.value(claim) for claim in items.values()]
    attributes = {"units": "1", "long_name": "reproduced value, in the unit of its item"}
    coords = {"alternative": list(alternatives), "item": list(items)}
    return xr.Dataset({"reproduced": (tuple(coords), values, attributes)}, coords)
