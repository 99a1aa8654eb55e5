"""What claims are compared with: results of a study through one transport, or the paper's own tables.

A computation takes one of these, `StudyResults` or `PrintedTables`, and the arguments that stand with the
claim; it returns a `Finding`.
"""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.errors import ResultError
from pneumo.statistics.averages import OVERALL, concatenated
from pneumo.storage.files import open_grid, read, read_study
from pneumo.storage.layout import failure_text
from pneumo.verdict.published import STATISTICS, table5, table7, table8, table9


class MissingEvidence(LookupError):
    """A claim cannot be judged: the study lacks what it needs, or the paper does not print it."""


class Finding(NamedTuple):
    """What a computation found."""

    value: float | None = None  # in the claim's unit (a fraction where the claim has per cent)
    holds: bool | None = None  # whether a statement is true, where there is no number to compare
    shown: str = ""  # what was found, in words, where the number alone does not say it
    low: float | None = None  # an interval in place of a value, where the paper leaves open which run it
    high: float | None = None  # speaks of
    swing: float | None = None  # change during the run, in the unit of the value


Computation = Callable[..., Finding]


class StudyResults:
    """Results of a study with one transport, ``published`` or ``exact``; files are read when needed."""

    def __init__(self, folder: Path, transport: str) -> None:
        self.folder, self.transport = folder, transport

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

    def failures(self, kind: str) -> dict[str, str]:
        """When and how each failed run of a kind, ``datum`` or ``settling``, ended, by experiment."""
        table, name = self.statistics, "full-order run"
        if kind == "settling":
            table, name = read(self.folder / "settling.nc"), "settling run"
        time = table["failure_time"]
        failed = time["experiment"].values[time.notnull()].tolist()
        return {experiment: failure_text(self.run(kind, experiment), name) for experiment in failed}

    def run(self, kind: str, experiment: str, /, *variables: str) -> xr.Dataset:
        """Full-order (``datum``) or ``settling`` run of one experiment, or some of its variables."""
        self.experiment(experiment)
        return read(self.folder / kind / f"{experiment}.nc", *variables)

    def experiment(self, name: str) -> Experiment:
        """Parameters of one experiment."""
        if name not in self.study.experiments:
            raise MissingEvidence(f"this study has no experiment {name}")
        return self.study.experiments[name]

    def plant(self, cylinder: str) -> Plant:
        """Parameters of a cylinder, from its first experiment."""
        return next(iter(self.experiments(cylinder).values())).plant

    def experiments(
        self, cylinder: str | None = None, closed_loop: bool | None = None
    ) -> dict[str, Experiment]:
        """Experiments of a cylinder and a loop, by name; `MissingEvidence` if there is none."""
        selected = {
            name: experiment
            for name, experiment in self.study.experiments.items()
            if cylinder in (None, experiment.cylinder) and closed_loop in (None, experiment.drive.closed_loop)
        }
        if not selected:
            raise MissingEvidence("this study has no such experiment")
        return selected


class PrintedTables(StudyResults):
    """The paper's own Tables 5, 7, 8 and 9 in place of results, of which only the parameters are read."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, "printed")

    @cached_property
    def statistics(self) -> xr.Dataset:
        """Tables 7 to 9 as printed."""
        names = [name for name, *_ in STATISTICS.values()]
        parts = [
            part[names].drop_vars(set(part.coords) - {"level", "model"})
            for part in (table7().expand_dims(level=[OVERALL]), table9())
        ]
        result = xr.concat(parts, "level")
        result["best_n"] = table8().drop_vars(["printed", "half_unit"])
        return result

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
