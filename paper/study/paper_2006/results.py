"""Results that the claims of 2006 are compared with: those of a study, or the printed tables."""

from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import xarray as xr

from paper.study.averages import OVERALL, concatenated
from paper.study.paper_2006.numbers_of_tables import numbers_of_tables
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import STATISTICS, percentiles, table5, table7, table8, table9
from paper.study.paper_2006.table_likelihood import TableLikelihood, numbers_over_seeds
from paper.study.stored_runs import failure_text, read_study
from paper_verdict.findings import MissingEvidence
from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.errors import ResultError
from pneumo.storage.files import open_grid, read


class StudyResults:
    """Results of a study with ``published`` or ``exact`` signals; files are read when needed."""

    def __init__(self, folder: Path, transport: str) -> None:
        self.folder, self.transport = folder, transport
        self._read = lru_cache(maxsize=1)(read)  # successive claims mostly read the same run

    @cached_property
    def study(self) -> Study:
        """The study that the results belong to."""
        return read_study(self.folder / "parameters.json")

    @cached_property
    def statistics(self) -> xr.Dataset:
        """Tables 7 to 9 by (level, model) and (experiment, model)."""
        return read(self.folder / self.transport / "statistics.nc")

    @cached_property
    def settling_times(self) -> xr.DataArray:
        """Table 5 by (experiment, quantity), s."""
        return read(self.folder / "settling.nc")["settling_time"]

    @cached_property
    def cells(self) -> xr.Dataset:
        """Errors of both chambers as one vector, by (experiment, model, n)."""
        grid = open_grid(self.folder / self.transport)
        missing = set(self.study.experiments) - set(grid["experiment"].values.tolist())
        if missing:
            raise ResultError(f"{self.folder / self.transport}: no replays of {', '.join(sorted(missing))}")
        return concatenated(grid.sel(experiment=list(self.study.experiments)))

    @cached_property
    def numbers(self) -> np.ndarray:
        """The 288 numbers of `numbers_of_tables`."""
        names, study = list(self.study.experiments), self.study
        cells = self.cells.sel(experiment=names, model=list(PAPER_MODELS))
        cells = cells.transpose("experiment", "model", "n")
        errors = cells["mean_error"].values, cells["mse"].values
        return numbers_of_tables(*errors, study.n, names, study.experiments_by_level)

    @cached_property
    def likelihood(self) -> TableLikelihood | None:
        """Likelihood of `numbers`; None if other sets of seeds were not run with this configuration."""
        over_seeds = numbers_over_seeds(self.folder, self.study)
        return None if over_seeds is None else TableLikelihood(over_seeds)

    def failures(self, kind: str) -> dict[str, str]:
        """Text on how each failed run of a kind, ``datum`` or ``settling``, ended, by experiment."""
        settling = kind == "settling"
        table = read(self.folder / "settling.nc") if settling else self.statistics
        name = "settling run" if settling else "full-order run"
        failed = table["failure_time"].dropna("experiment")["experiment"].values.tolist()
        return {experiment: failure_text(self.run(kind, experiment), name) for experiment in failed}

    def run(self, kind: str, experiment: str, /, *variables: str) -> xr.Dataset:
        """Full-order (``datum``) or ``settling`` run of one experiment, or some of its variables."""
        self.experiment(experiment)
        return self._read(self.folder / kind / f"{experiment}.nc", *variables)

    def experiment(self, name: str) -> Experiment:
        """Parameters of one experiment."""
        if name not in self.study.experiments:
            raise MissingEvidence(f"this study has no experiment {name}")
        return self.study.experiments[name]

    def plant(self, cylinder: str) -> Plant:
        """Plant of a cylinder, as in its first experiment of the study."""
        return next(iter(self.experiments(cylinder).values())).plant

    def experiments(
        self, cylinder: str | None = None, closed_loop: bool | None = None
    ) -> dict[str, Experiment]:
        """Experiments of a cylinder and a loop, by name; `MissingEvidence` if there is none."""
        selected = {
            name: e
            for name, e in self.study.experiments.items()
            if cylinder in (None, e.cylinder) and closed_loop in (None, e.drive.closed_loop)
        }
        if not selected:
            raise MissingEvidence("this study has no such experiment")
        return selected


class PrintedTables(StudyResults):
    """The paper's own Tables 5, 7, 8, 9 and Figs 9, 11 as results; the folder gives parameters only."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, "printed")

    @cached_property
    def statistics(self) -> xr.Dataset:
        """Tables 7 to 9 as printed, with the percentiles and constant n read off Figs 9 and 11."""
        names = [name for name, *_ in STATISTICS.values()]
        parts = (table7().expand_dims(level=[OVERALL]), table9())
        numbers = [part[names].drop_vars(set(part.coords) - {"level", "model"}) for part in parts]
        tables = xr.concat(numbers, "level").assign(best_n=table8().drop_vars(["printed", "half_unit"]))
        figures = xr.merge([percentiles(9), percentiles(11)], join="outer", compat="no_conflicts")
        return tables.merge(figures, join="left")

    @cached_property
    def settling_times(self) -> xr.DataArray:
        """Table 5 as printed."""
        return table5()

    @cached_property
    def cells(self) -> xr.Dataset:
        """Raise `MissingEvidence`: the paper prints no errors of single experiments, models and n."""
        raise MissingEvidence("the paper prints no single cells")

    def run(self, *names: str) -> xr.Dataset:
        """Raise `MissingEvidence`: the paper prints no runs."""
        raise MissingEvidence(f"the paper prints no run of {names[1]}")
