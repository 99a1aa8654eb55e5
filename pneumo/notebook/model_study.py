"""Studies for notebooks and scripts."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from pneumo.arguments import listed, whole_number
from pneumo.configuration.experiment import MOST_SEEDS, Study
from pneumo.configuration.parameters import load
from pneumo.configuration.parameters import study as in_SI
from pneumo.configuration.priors import uncertainties
from pneumo.configuration.schema import Configuration
from pneumo.errors import InputError
from pneumo.publish.pages.study_page import check_folder, save_study
from pneumo.publish.text.terminal_tables import answer_html, study_text
from pneumo.selection.answer import Answer, answers, export_command, exported_name
from pneumo.selection.cylinder_ranking import run_study, selected

if TYPE_CHECKING:  # a study without figures and exports needs neither Matplotlib nor SymPy
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ModelStudy:
    """Models compared on the cylinders of a configuration, from `pneumo.study`."""

    study: Study
    cells: xr.Dataset  #: errors of every model, run and drawn cylinder
    configuration: Configuration
    files: Sequence[str] = ()  #: of the configuration, for the commands of the text

    @cached_property
    def answers(self) -> list[Answer]:
        """Answer for each cylinder: the model to take, the error budget, and the error after one record."""
        return answers(self.cells)

    @cached_property
    def _configured(self) -> Study:
        """All experiments of the configuration, those of the study first: a command names their first k_0."""
        configured = in_SI(self.configuration)
        return configured._replace(experiments={**self.study.experiments, **configured.experiments})

    def _answer(self, cylinder: str | None) -> Answer:
        """Answer for a cylinder, by default the first; `InputError` if it is unknown or has no model."""
        named = {answer.ranking.cylinder: answer for answer in self.answers}
        answer = named.get(next(iter(named)) if cylinder is None else cylinder)
        if answer is None:
            raise InputError(f"cylinder = {cylinder!r}: must be one of {', '.join(named)}")
        if not answer.chosen:
            raise InputError(f"{answer.ranking.cylinder}: no model to show: {answer.reason}")
        return answer

    def plot(self, cylinder: str | None = None) -> "Figure":
        """Figure of the error budget of a cylinder; by default of the first."""
        from pneumo.publish.figures.study_figures import budget_figure

        return budget_figure(self._answer(cylinder))

    def to_xarray(self) -> xr.Dataset:
        """Errors of every model, run and drawn cylinder, as ``study.nc`` has them."""
        return self.cells

    def export(
        self, file: Path | str, to: str = "c", cylinder: str | None = None, name: str | None = None
    ) -> list[Path]:
        """Write the recommended model of a cylinder, by default the first, as source code or FMU.

        `name` is the option ``--name`` of `pneumo export`: names in the code begin with it.
        """
        from pneumo.notebook.export_model import export_model

        answer = self._answer(cylinder)
        n = answer.budget.row(answer.chosen).n
        model, n = exported_name(answer.chosen), None if np.isnan(n) else n
        return export_model(self.configuration, answer.ranking.cylinder, model, n, to, file, name)

    def save(self, folder: Path | str) -> tuple[Path, Path]:
        """Write study.html and study.nc into a folder; return their paths."""
        check_folder(Path(folder))
        commands = [export_command(answer, self._configured, self.files) for answer in self.answers]
        return save_study(self.study, self.cells, self.answers, Path(folder), commands)

    def text(self, width: int = 80) -> str:
        """Text that `pneumo study` prints, for a terminal of a width."""
        return study_text(self.answers, self._configured, self.files, width)

    def __repr__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        """Answer, error budget and advice for each cylinder, for notebooks."""
        return "".join(map(answer_html, self.answers))


def study(
    configuration: Path | str | Configuration,
    *,
    cylinders: Sequence[str] = (),
    experiments: Sequence[str] = (),
    seeds: int | None = None,
    threads: int = 2,
) -> ModelStudy:
    """Compare all models on the cylinders of a configuration; `pneumo study` does the same.

    Parameters
    ----------
    configuration
        File, such as that of `pneumo init` or ``fitted.yaml``, or its content from `load`.
    cylinders, experiments : sequence of str
        Only these; by default all.
    seeds : int
        Runs of each experiment; by default as configured.

    Raises
    ------
    InputError
        If a cylinder or experiment is unknown, or seeds are not 1 to 1000.
    ConfigurationError
        If the configuration is wrong.
    """
    cylinders, experiments = listed("cylinders", cylinders), listed("experiments", experiments)
    if seeds is not None:
        whole_number("seeds", seeds, 1, MOST_SEEDS)
    files = () if isinstance(configuration, Configuration) else (str(configuration),)
    content = configuration if isinstance(configuration, Configuration) else load(Path(configuration))
    chosen = selected(in_SI(content), cylinders, experiments)
    chosen = chosen._replace(seeds=chosen.seeds if seeds is None else seeds)
    return ModelStudy(chosen, run_study(chosen, threads, uncertain=uncertainties(content)), content, files)
