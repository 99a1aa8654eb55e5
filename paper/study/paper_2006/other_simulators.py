"""Runs of another simulator, judged as the study's own are: the files that docs/verdict.md describes."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2006.results import ComputedResults, PrintedTables
from paper.study.paper_2006.summary import EXPERIMENTS, fit, scores
from paper.study.settling_run import QUANTITIES
from pneumo.configuration.experiment import Experiment, Study
from pneumo.errors import ResultError, printable
from pneumo.physics.models import MODELS
from pneumo.regular_file import regular_file
from pneumo.simulation.full_order import Recording
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.statistics.averages import OVERALL
from pneumo.storage.files import check_sizes
from pneumo.storage.grid_layout import replayed_grid
from pneumo.storage.layout import CHAMBERS, datum_dataset, experiment_labels
from pneumo.verdict.judging import Item, Paper, Sources, verdict
from pneumo.verdict.sources import MissingEvidence

SIGNALS = ("t", "u", "x", "v", "P_A", "P_B")  # of every run: s, V, m, m/s, Pa
TEMPERATURES = ("T_A", "T_B")  # K; where they are missing, items about them are not judged
ERRORS = ("model", "n", "chamber", "mean_error", "mse")  # of a simulator's own replays: Pa, Pa^2
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


def read_errors(file: Path, e: Experiment, n: tuple[float, ...]) -> xr.Dataset:
    """Errors of a simulator's own replays of an experiment, Pa and Pa^2, by (model, n, chamber).

    In the file a model without n has one row per chamber, at any n. `ResultError` if a cell of the study is
    missing or there twice.
    """
    table = read_columns(file, ERRORS)
    parts = dict[str, xr.Dataset]()
    for name, model in MODELS.items():
        rows = table[table["model"] == name]
        rows = rows.assign(n=rows["n"].round(6)) if model.has_n else rows.assign(n=n[0])
        cells = rows.set_index(["n", "chamber"])[["mean_error", "mse"]]
        asked = pd.MultiIndex.from_product([n if model.has_n else n[:1], CHAMBERS], names=["n", "chamber"])
        lost = asked.difference(cells.index)
        if cells.index.has_duplicates or len(lost):
            words = "a cell twice" if cells.index.has_duplicates else f"no cell of n, chamber {lost[0]}"
            raise ResultError(f"{file}: {name} has {words}: must have one row for each n and chamber")
        part = cells.loc[asked].to_xarray()
        parts[name] = part if model.has_n else part.isel(n=0, drop=True).expand_dims(n=list(n))
    cells = xr.concat(parts.values(), xr.Variable("model", list(parts))).astype(float)
    cells = cells.transpose("model", "n", "chamber")
    cells["variance"] = cells["mse"] - cells["mean_error"] ** 2
    cells["status"] = xr.zeros_like(cells["mse"], dtype=np.int8)
    cells["failure_time"] = xr.full_like(cells["mse"], np.nan)
    return cells.assign_coords(experiment_labels(e))


def read_settling(folder: Path, study: Study) -> xr.DataArray:
    """Settling times of ``settling.csv``, s, by (experiment, quantity); NaN where there is none."""
    files = [folder / "settling.csv"]
    table = read_columns(files[0], ("experiment",)) if files[0].exists() else pd.DataFrame({"experiment": []})
    times = table.set_index("experiment").reindex(index=list(study.experiments), columns=list(QUANTITIES))
    return xr.DataArray(
        times.to_numpy(float), {"experiment": list(study.experiments), "quantity": list(QUANTITIES)}
    )


class OtherResults(ComputedResults):
    """Results of another simulator: its runs, and replays on them."""

    def run(self, kind: str, experiment: str, /, *variables: str) -> xr.Dataset:
        """Full-order run of one experiment; `MissingEvidence` if it was not given, and for settling runs."""
        if (kind, experiment) not in self.runs:
            raise MissingEvidence(f"no {kind} run of {experiment} was given")
        return super().run(kind, experiment, *variables)


def other_results(folder: Path, study: Study, report: Any = lambda _text: None) -> OtherResults:
    """Results of another simulator from a folder of its runs, ``E01.csv`` or ``.nc`` and so on.

    Replays are those of ``E01_replays.csv`` or ``.nc`` where it is there, else pneumo replays its models on
    the run, signals sampled as in the paper. `report` is called with a line of text for each
    experiment. `ResultError` if there is no run, or one cannot be used.
    """
    cells, runs = list[xr.Dataset](), dict[tuple[str, str], xr.Dataset]()
    for name, e in study.experiments.items():
        file = _first(folder, name)
        if file is None:
            continue
        recording, run = read_run(file, e)
        replays = _first(folder, f"{name}_replays")
        if replays is None:
            cells.append(replayed_grid(e, study.n, recording, study_sampling(PUBLISHED, e), e.steps))
        else:
            cells.append(read_errors(replays, e, study.n))
        runs["datum", name] = run
        report(f"{name}: {file.name}, {'its own replays' if replays else 'replayed by pneumo'}")
    if not cells:
        raise ResultError(f"{folder}: holds no run such as E01.csv or E01.nc")
    names = [name for _, name in runs]
    part = study._replace(experiments={name: study.experiments[name] for name in names})
    labels = ["cylinder", "loop", "k_0", "experiment"]
    grid = xr.concat(
        [each.drop_vars(["pressure", "t"], errors="ignore") for each in cells], "experiment", coords=labels
    )
    results = OtherResults(part, PUBLISHED, grid, read_settling(folder, part), runs, folder)
    whole = {OVERALL: list(study.experiments), **study.experiments_by_level}
    levels = results.statistics["level"]
    lacks = [level for level in levels.values if not set(whole[level]) <= set(names)]
    results.statistics = results.statistics.map(  # an average of some experiments is not the table's
        lambda table: table.where(~levels.isin(lacks)) if "level" in table.dims else table
    )
    return results


def _first(folder: Path, stem: str) -> Path | None:
    return next((file for kind in ("nc", "csv") if (file := folder / f"{stem}.{kind}").exists()), None)


def paper_for(results: OtherResults, tool: str) -> Paper:
    """The paper of 2006, to be judged against another simulator's results."""

    def sources(_results: Path, _paper: Path) -> dict[str, Any]:
        printed = PrintedTables(results.folder)
        printed.study = results.study
        return {PUBLISHED: results, "printed": printed}

    def about(_sources: Sources) -> dict[str, Any]:
        return {"study": f"runs of {tool}", "failures": {}, "settling_failures": {}}

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
        alternatives=Paper._field_defaults["alternatives"],
        chi_square=PAPER_2006.chi_square if whole else Paper._field_defaults["chi_square"],
    )


def verdict_on(folder: Path, study: Study, tool: str, report: Any = lambda _text: None) -> dict[str, Any]:
    """Judge a folder of another simulator's runs; return the content of ``verdict.json``."""
    results = other_results(folder, study, report)
    return verdict(folder, paper_for(results, tool)._replace(folder=PAPER_FOLDER))
