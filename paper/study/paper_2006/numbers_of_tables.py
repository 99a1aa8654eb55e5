"""The 288 numbers of Tables 7, 8, 9 and Figs 9, 11 as one vector, printed and from cells.

ln of the mean square error, mean error (Pa) and ln of the standard deviation of Tables 7 and 9; n of Table 8;
log10 of the percentiles, Pa^2, chambers joined, linear between experiments (Hyndman and Fan's rule 7).
"""

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import PAPER_FOLDER, STATISTICS, table7, table8, table9
from paper_verdict.files import read_cells

TABLES = ("T7", "T9", "T8", "p10", "p90")  # parts of the vector, in their order
TOLERANCE_OF_N = 0.01  # for equal n: steps are 0.05
N_UNIT = 0.05  # step between the values of n
IN_FIGURES = [name != "M4" for name in PAPER_MODELS]  # Figs 9 and 11 leave it out
LEFT_OUT = "T9.isothermal.M10."  # a copy of M8's row, it seems
EXCHANGED = ("M8", "M9")  # columns of Table 8, it seems


def printed_numbers() -> pd.DataFrame:
    """Each number as printed, by the id of its claim, in the order of `numbers_of_tables`.

    Columns: ``table``, one of `TABLES`; ``printed``; ``variance`` of printing (unit squared over 12) or of
    reading a figure; ``meant``, as `printed` but for two suspected misprints: the columns M8 and M9 of
    Table 8 are exchanged, and Table 9's isothermal row of M10 has no numbers.
    """
    seven, nine, eight = table7(), table9(), table8()
    rows = _rows("T7", "T7", seven)
    for level in nine["level"].values:
        rows += _rows(f"T9.{level}", "T9", nine.sel(level=level))
    for experiment, model in itertools.product(eight["experiment"].values, eight["model"].values):
        n = eight.sel(experiment=experiment, model=model).item()
        rows.append((f"T8.{experiment}.{model}", "T8", n, N_UNIT**2 / 12))
    points = {f"F9.{c['row']}.{c['column']}": c for c in read_cells("figure9", PAPER_FOLDER)}
    points |= {f"F11.{c['level']}.{c['row']}.{c['column']}": c for c in read_cells("figure11", PAPER_FOLDER)}
    for column in ("p10", "p90"):
        for name, cell in points.items():
            if cell["column"] == column:
                rows.append((name, column, float(cell["printed"]), float(cell["sigma"]) ** 2))
    numbers = pd.DataFrame(rows, columns=["id", "table", "printed", "variance"]).set_index("id")
    return numbers.assign(meant=_meant(numbers))


def _rows(name: str, table: str, numbers: xr.Dataset) -> list[tuple[str, str, float, float]]:
    """Id, table, number and variance of printing of a table's numbers by model."""
    rows: list[tuple[str, str, float, float]] = []
    for column, (variable, *_) in STATISTICS.items():
        for model in PAPER_MODELS:
            value = numbers[variable].sel(model=model).item()
            unit = 2 * numbers[f"{variable}_half_unit"].sel(model=model).item()
            if column != "mu":
                value, unit = math.log(value), unit / value
            rows.append((f"{name}.{model}.{column}", table, value, unit**2 / 12))
    return rows


def _meant(numbers: pd.DataFrame) -> np.ndarray:
    """Printed numbers, shape (288,), both suspected misprints corrected; NaN if no number is known."""
    names, printed = numbers.index.astype(str), numbers["printed"].to_numpy()
    meant = np.where(names.str.startswith(LEFT_OUT), math.nan, printed)
    first, second = (np.flatnonzero(names.str.match(rf"T8\..*\.{model}$")) for model in EXCHANGED)
    meant[first], meant[second] = printed[second], printed[first]
    return meant


def _averages(mean_error: np.ndarray, mse: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of a table, shape (..., 3 x model), and the percentiles in a figure, shape (2, ..., model).

    From cells of shape (..., experiment, model): eqs (14), (15), (16) with a sample variance of the means.
    """
    variance = (mse - mean_error**2).mean(axis=-2) + mean_error.var(axis=-2, ddof=1)
    parts = mean_error.mean(axis=-2), np.log(variance) / 2, np.log(mse.mean(axis=-2))
    return np.concatenate(parts, axis=-1), np.log10(np.quantile(mse, [0.1, 0.9], axis=-2))[..., IN_FIGURES]


def _at(cells: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Values of cells, shape (..., n), at an index along n for each, shape (...)."""
    return np.take_along_axis(cells, index[..., np.newaxis], -1)[..., 0]


def numbers_of_tables(
    mean_error: np.ndarray,
    mse: np.ndarray,
    n: Sequence[float],
    experiments: Sequence[str],
    levels: Mapping[str, Sequence[str]],
) -> np.ndarray:
    """The 288 numbers of `printed_numbers` from cells: shape (..., 288); NaN cells give NaN, except an n.

    `mean_error`, Pa, and `mse`, Pa^2, are those of both chambers together, shape (..., experiment, model of
    the paper, n); `levels` has the names of each level's experiments.
    """
    best = mse.argmin(axis=-1)
    seven, percentiles = _averages(_at(mean_error, best), _at(mse, best))
    nine: list[np.ndarray] = []
    of_figures = [percentiles]
    for members in levels.values():
        rows = [list(experiments).index(name) for name in members]
        of_level = mean_error[..., rows, :, :], mse[..., rows, :, :]
        constant = of_level[1].mean(axis=-3).argmin(axis=-1)[..., np.newaxis, :]
        table, percentiles = _averages(*(_at(v, np.broadcast_to(constant, v.shape[:-1])) for v in of_level))
        nine.append(table)
        of_figures.append(percentiles)
    eight, models = table8(), list(PAPER_MODELS)
    in_table_8 = np.ix_(
        [list(experiments).index(name) for name in eight["experiment"].values],
        [models.index(name) for name in eight["model"].values],
    )
    best_n = np.asarray(n)[best][(..., *in_table_8)].reshape(*best.shape[:-2], -1)
    return np.concatenate([seven, *nine, best_n, *np.concatenate(of_figures, axis=-1)], axis=-1)
