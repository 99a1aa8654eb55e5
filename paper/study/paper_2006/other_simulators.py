"""Runs of another simulator, judged as the study's own are: the files that docs/verdict.md describes."""

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from paper.study.averages import OVERALL, concatenated, statistics
from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2006.results import PrintedTables, StudyResults
from paper.study.paper_2006.summary import EXPERIMENTS, fit, scores
from paper.study.samplings import PUBLISHED, study_sampling
from paper.study.stored_runs import datum_dataset
from paper_verdict.findings import MissingEvidence
from paper_verdict.judging import Item, Paper, Sources, verdict
from pneumo.configuration.experiment import Experiment, Study
from pneumo.errors import ResultError, printable
from pneumo.regular_file import regular_file
from pneumo.simulation.full_order import Recording
from pneumo.storage.files import check_sizes
from pneumo.storage.layout import replayed_grid

SIGNALS = ("t", "u", "x", "v", "P_A", "P_B")  # of every run: s, V, m, m/s, Pa
TEMPERATURES = ("T_A", "T_B")  # K; where they are missing, items about them are not judged
LARGEST = 2**31  # bytes of a file, and of its content in memory
TIME_STEP = 1e-6  # s, by which a sample's time may be off


def read_columns(file: Path, names: tuple[str, ...]) -> pd.DataFrame:
    """Columns of a CSV or NetCDF file of another program; `ResultError` if it cannot be read or lacks one."""
    try:
        if file.suffix == ".nc":
            with regular_file(file, LARGEST):
                check_sizes(file, LARGEST)
            with xr.open_dataset(file.absolute(), engine="netcdf4", decode_times=False) as dataset:
                table = dataset.load().reset_coords().to_dataframe().reset_index()
        else:
            with regular_file(file, LARGEST) as stream:
                table = pd.read_csv(stream)
    except (OSError, ValueError, RuntimeError) as error:
        raise ResultError(f"{file}: cannot be read: {printable(str(error), 200)}") from None
    missing = [name for name in names if name not in table]
    if missing:
        columns = printable(", ".join(map(str, table.columns)), 200)
        raise ResultError(
            f"{file}: has no column {missing[0]}; needed are {', '.join(names)}, there are {columns}"
        )
    return table


def read_run(file: Path, e: Experiment) -> tuple[Recording, xr.Dataset]:
    """Run of an experiment by another simulator, for replays and as a dataset.

    Raises
    ------
    ResultError
        If the file is not a table with the columns of `SIGNALS`, samples are not one step of the experiment
        apart or not as many as it lasts, or one is not finite.
    """
    table = read_columns(file, SIGNALS)
    count, t = e.steps + 1, np.arange(e.steps + 1) * e.h
    if len(table) != count:
        raise ResultError(
            f"{file}: has {len(table)} samples, {e.name} has {count}: 0 to {e.duration:g} s by {e.h:g} s"
        )
    try:
        values = {name: table[name].to_numpy(float) for name in (*SIGNALS, *TEMPERATURES) if name in table}
    except (ValueError, TypeError) as error:
        raise ResultError(f"{file}: {printable(str(error), 200)}") from None
    for name in SIGNALS:
        if not np.isfinite(values[name]).all():
            raise ResultError(f"{file}: {name} is not finite at sample {np.isfinite(values[name]).argmin()}")
    if (late := np.abs(values["t"] - t)).max() > TIME_STEP:
        k = int(late.argmax())
        raise ResultError(f"{file}: t = {values['t'][k]:.9g} s at sample {k}: must be {t[k]:.9g} s")
    measured = {name: values.get(name, np.full(count, np.nan)) for name in TEMPERATURES}
    T = {name: np.where(np.isnan(T), e.plant.conditions.T_amb, T) for name, T in measured.items()}  # not read
    states = [values["x"], values["v"], values["P_A"], T["T_A"], values["P_B"], T["T_B"]]
    none = np.zeros(count)
    recording = Recording(
        states=np.column_stack(states),
        reference=none,
        u=values["u"],
        drive=e.drive,
        plant=e.plant,
        h=e.h,
        halvings=np.zeros(e.steps, np.int8),
        most_halvings=e.most_halvings,
    )
    run = datum_dataset(e, recording)
    run["T"] = ("t", "chamber"), np.column_stack([measured[name] for name in TEMPERATURES])
    return recording, run


class OtherResults(StudyResults):
    """Results of another simulator: its runs by experiment, and pneumo's replays on them."""

    def __init__(self, folder: Path, study: Study, cells: xr.Dataset, runs: dict[str, xr.Dataset]) -> None:
        super().__init__(folder, PUBLISHED)
        self.study, self.runs = study, runs
        self.statistics = statistics(cells, study.experiments_by_level, percentile_rule=study.percentile_rule)
        self.cells = concatenated(cells)

    @cached_property
    def settling_times(self) -> xr.DataArray:
        """Raise `MissingEvidence`: settling runs are not read."""
        raise MissingEvidence("no settling runs were given")

    def run(self, kind: str, experiment: str, /, *variables: str) -> xr.Dataset:
        """Full-order run of one experiment; `MissingEvidence` if it was not given, and for settling runs."""
        if kind != "datum" or experiment not in self.runs:
            raise MissingEvidence(f"no {kind} run of {experiment} was given")
        run = self.runs[experiment]
        return run[list(variables)] if variables else run


def other_results(folder: Path, study: Study, report: Any = lambda _text: None) -> OtherResults:
    """Results of another simulator from a folder of its runs, ``E01.csv`` or ``.nc`` and so on.

    pneumo replays its models on each run, signals sampled as in the paper. `report` is called with a line of
    text for each experiment. `ResultError` if there is no run, or one cannot be used.
    """
    cells, runs = list[xr.Dataset](), dict[str, xr.Dataset]()
    for name, e in study.experiments.items():
        file = next((f for kind in ("nc", "csv") if (f := folder / f"{name}.{kind}").exists()), None)
        if file is None:
            continue
        recording, run = read_run(file, e)
        grid = replayed_grid(e, study.n, recording, study_sampling(PUBLISHED, e), e.steps)
        cells.append(grid.drop_vars(["pressure", "t"]))
        runs[name] = run
        report(f"{name}: {file.name}, replayed")
    if not cells:
        raise ResultError(f"{folder}: holds no run such as E01.csv or E01.nc")
    part = study._replace(experiments={name: study.experiments[name] for name in runs})
    cells = xr.concat(cells, "experiment", coords=["cylinder", "loop", "k_0", "experiment"])
    results = OtherResults(folder, part, cells, runs)
    whole = {OVERALL: list(study.experiments), **study.experiments_by_level}
    levels = results.statistics["level"]
    lacks = [level for level in levels.values if not set(whole[level]) <= set(runs)]
    results.statistics = results.statistics.map(  # an average of some experiments is not the table's
        lambda table: table.where(~levels.isin(lacks)) if "level" in table.dims else table
    )
    return results


def paper_for(results: OtherResults, tool: str) -> Paper:
    """The paper of 2006, to be judged against another simulator's results."""

    def sources(_results: Path, _paper: Path) -> dict[str, Any]:
        printed = PrintedTables(results.folder)
        printed.study = results.study
        return {PUBLISHED: results, "printed": printed}

    def about(_sources: Sources) -> dict[str, Any]:
        return {"study": f"runs of {tool}", "failures": {}}

    whole = list(results.study.experiments) == EXPERIMENTS

    def highlights(judged: Sources, items: list[Item]) -> dict[str, Any]:
        agreement = fit(judged) if whole else None
        if agreement is not None:  # seeds are those of the study's own runs
            agreement |= {"seeds": None}
        none = dict.fromkeys(("wrong_row", "transport", "by_experiment"))
        return {"scores": scores(items), "fit": agreement} | none

    return PAPER_2006._replace(
        sources=sources,
        about=about,
        highlights=highlights,
        chi_square=PAPER_2006.chi_square if whole else Paper._field_defaults["chi_square"],
    )


def verdict_on(folder: Path, study: Study, tool: str, report: Any = lambda _text: None) -> dict[str, Any]:
    """Judge a folder of another simulator's runs; return the content of ``verdict.json``."""
    results = other_results(folder, study, report)
    return verdict(paper_for(results, tool)._replace(folder=PAPER_FOLDER), folder)
