"""Deviation of the numbers of Tables 7, 8, 9 and Figs 9, 11 from print, against the spread over seeds.

The covariance of the 288 numbers is that over the sets of seeds plus that of printing or reading:
decision 67.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from paper.study.kept_evidence import evidence_file
from paper.study.paper_2006.likelihood import chi_square, shrunk_covariance
from paper.study.paper_2006.numbers_of_tables import numbers_of_tables, printed_numbers
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.samplings import PUBLISHED
from pneumo.configuration.experiment import Study
from pneumo.storage.files import read


def numbers_over_seeds(results: Path, study: Study) -> np.ndarray | None:
    """Numbers of the tables with each set of seeds, shape (seeds, 288), the study's own first.

    From ``seed_sets.nc``; None if it was made from another configuration, or has other experiments.
    """
    file = evidence_file(results, "seed_sets.nc", study.config_sha256)
    if file is None:
        return None
    cells = read(file, "mean_error", "mse")
    whole = set(cells["experiment"].values) == set(study.experiments)
    return numbers_of_seed_sets(study, cells) if whole else None


def numbers_of_seed_sets(study: Study, seed_sets: xr.Dataset) -> np.ndarray:
    """Numbers of the tables with each set of seeds, shape (seeds, 288), from ``seed_sets.nc``."""
    names = list(study.experiments)
    cells = seed_sets[["mean_error", "mse"]].squeeze("chamber", drop=True)
    cells = cells.sel(transport=PUBLISHED, experiment=names, model=list(PAPER_MODELS))
    cells = cells.transpose("seeds", "experiment", "model", "n").astype(float)
    levels = study.experiments_by_level
    return numbers_of_tables(cells["mean_error"].values, cells["mse"].values, study.n, names, levels)


class TableLikelihood:
    """Chi-squares of the tables' numbers, with the covariance over seeds and of printing.

    Parameters
    ----------
    over_seeds : numpy.ndarray
        From `numbers_of_seed_sets`; the first row, with the study's own seeds, is left out of the covariance.
    """

    def __init__(self, over_seeds: np.ndarray) -> None:
        self.printed = printed_numbers()
        self.over_seeds = over_seeds
        seeds, self.shrinkage = shrunk_covariance(over_seeds[1:])
        self.covariance = seeds + np.diag(self.printed["variance"])

    def of_items(self, numbers: np.ndarray, items: Sequence[str]) -> float | None:
        """Chi-square of items as printed, from numbers of shape (288,); None if one is no such number."""
        part = self.printed.index.get_indexer(list(items))
        if len(part) == 0 or part.min() < 0:
            return None
        deviations = numbers[part] - self.printed["printed"].to_numpy()[part]
        return float(chi_square(deviations, self.covariance[np.ix_(part, part)]))

    def _part(self, tables: Sequence[str], column: str) -> np.ndarray:
        of_tables = self.printed["table"].isin(tables) & np.isfinite(self.printed[column])
        return np.flatnonzero(of_tables.to_numpy())

    def degrees_of_freedom(self, tables: Sequence[str], column: str = "meant") -> int:
        """Count of the numbers that are compared in these tables."""
        return len(self._part(tables, column))

    def chi_square(self, numbers: np.ndarray, tables: Sequence[str], column: str = "meant") -> np.ndarray:
        """Chi-square of some tables, shape (...), from numbers of shape (..., 288).

        `column` of `printed_numbers`: ``printed``, or ``meant``, with suspected misprints corrected.
        """
        part = self._part(tables, column)
        deviations = numbers[..., part] - self.printed[column].to_numpy()[part]
        return chi_square(deviations, self.covariance[np.ix_(part, part)])

    def rms_of_ln_mse(self, numbers: np.ndarray, table: str) -> np.ndarray:
        """Rms of ln(reproduced / printed) of a table's mean square errors, shape (...)."""
        names = self.printed.index.astype(str)
        part = (self.printed["table"] == table).to_numpy() & names.str.endswith(".mse")
        off = numbers[..., part] - self.printed["printed"].to_numpy()[part]
        return np.sqrt(np.mean(off**2, axis=-1))
