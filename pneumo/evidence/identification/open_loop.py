"""The open loops' setup, chosen by one likelihood of Tables 7, 8, 9 and Figs 9, 11: paper/decisions/0062."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.errors import ResultError
from pneumo.evidence.identification.open_loop_cells import (
    OPTIONS,
    SETUPS,
    OpenLoopSetup,
    configured_setup,
    setup_coordinates,
)
from pneumo.papers.paper_2006.numbers_of_tables import TABLES, numbers_of_tables
from pneumo.papers.paper_2006.paper_models import PAPER_MODELS
from pneumo.papers.paper_2006.printed_tables import table5
from pneumo.papers.paper_2006.table_likelihood import TableLikelihood, numbers_of_seed_sets
from pneumo.statistics.averages import rms_of
from pneumo.storage.layout import described

BEST = 20  # pairs that the ledger has
CRITERIA = ("decision 62", "as printed", "Tables 7 to 9", "percentiles")
TOLERANCE_OF_N = 0.01  # steps of n are 0.05
BOTH_CYLINDERS = ("D", "E")
TODAY = "today"  # name of the study's own pair in the ledger
ERRORS = ("mean_error", "mse")

LONG_NAMES = {
    "score": ("1", "chi-square of Tables 7, 8, 9 and Figs 9, 11 with the penalty of the choices"),
    "place": ("1", "place of the pair by score"),
    "setup_number": ("1", "position of a cylinder's setup along setup"),
    "penalty": ("1", "penalty of the choices"),
    "scores": ("1", "chi-square with penalty, by criterion"),
    "chi_square": ("1", "chi-square of one table, without penalty"),
    "misfit": (
        "1",
        "rms of ln(MSE), Tables 7 and 9; cells of Table 8 as printed; rms of log10 of a percentile",
    ),
    "cylinder_of": ("1", "position of the experiment's cylinder along cylinder"),
    "reversals": ("1", "changes of sign between command and draws in a run"),
    "seeds_chi_square": ("1", "chi-square with other seeds, numbers as printed"),
    "mean_error": ("Pa", "mean of full-order minus reduced pressure, both chambers"),
    "mse": ("Pa2", "mean square of full-order minus reduced pressure, both chambers"),
    "shrinkage": ("1", "lambda: correlations over seeds are multiplied by 1 - lambda"),
}


def check_all_experiments(study: Study) -> None:
    """Raise `ResultError` for a study that lacks an experiment: Tables 7 and 9 average over all."""
    for name in table5()["experiment"].values:
        if name not in study.experiments:
            raise ResultError(f"{name}: missing in this study; Tables 7 and 9 need all 16 experiments")


def penalty(pair: Sequence[OpenLoopSetup]) -> float:
    """Penalty of the setups of D and E: 2 ln(number of options) of each key, twice that where they differ."""
    keys = zip(OPTIONS.values(), *pair, strict=True)
    return float(sum(2 * np.log(len(options)) * len({of_D, of_E}) for options, of_D, of_E in keys))


def _numbers(study: Study, mean_error: np.ndarray, mse: np.ndarray) -> np.ndarray:
    return numbers_of_tables(mean_error, mse, study.n, list(study.experiments), study.experiments_by_level)


def scores_by_criterion(likelihood: TableLikelihood, numbers: np.ndarray) -> np.ndarray:
    """Chi-square by each of `CRITERIA`, shape (criterion, ...).

    `numbers` are those of `numbers_of_tables`, shape (..., 288).
    """
    return np.stack(
        [
            likelihood.chi_square(numbers, TABLES),
            likelihood.chi_square(numbers, TABLES, "printed"),
            likelihood.chi_square(numbers, ("T7", "T9", "T8")),
            likelihood.chi_square(numbers, ("p10", "p90")),
        ]
    )


def misfits(likelihood: TableLikelihood, numbers: np.ndarray) -> list[float]:
    """Misfit of each of `TABLES`.

    Tables 7 and 9: rms deviation of ln(MSE). Table 8: number of cells that are as printed. Percentiles of the
    figures: rms deviation of log10.
    """
    values: list[float] = []
    off = numbers - likelihood.printed["printed"].to_numpy()
    for table in TABLES:
        part = (likelihood.printed["table"] == table).to_numpy()
        if table == "T8":
            values.append(float(np.count_nonzero(np.abs(off[part]) < TOLERANCE_OF_N)))
        elif table in ("T7", "T9"):
            values.append(float(likelihood.rms_of_ln_mse(numbers, table)))
        else:
            values.append(rms_of(off[part]))
    return values


class PairErrors:
    """Errors of the study with one setup of D and one of E, from `open_loop_cells`."""

    def __init__(self, study: Study, cells: xr.Dataset) -> None:
        self.study = study
        cells = cells.sel(model=list(PAPER_MODELS))
        self.closed = {
            name: cells[[f"closed_{error}" for error in ERRORS]].sel(closed_loop=name).to_array().values
            for name in cells["closed_loop"].values.tolist()
        }
        by_setup = cells[list(ERRORS)].transpose("open_loop", "setup", "model", "n")
        self.open = {
            name: by_setup.sel(open_loop=name).to_array().values
            for name in cells["open_loop"].values.tolist()
        }

    def __call__(self, i: int, j: int | slice) -> np.ndarray:
        """Mean error, Pa, and mean square error, Pa^2, with setup i of D and setup or setups j of E.

        Of shape (2, ..., experiment, model of the paper, n).
        """
        parts: list[np.ndarray] = []
        for name, e in self.study.experiments.items():
            of_D = e.cylinder == BOTH_CYLINDERS[0]
            parts.append(self.closed[name] if e.drive.closed_loop else self.open[name][:, i if of_D else j])
        parts = [part if part.ndim == 4 or isinstance(j, int) else part[:, np.newaxis] for part in parts]
        shape = np.broadcast_shapes(*(part.shape for part in parts))
        return np.stack([np.broadcast_to(part, shape) for part in parts], axis=-3)


def choose_open_loop(
    study: Study, cells: xr.Dataset, seed_sets: xr.Dataset, progress: Callable[[str], None]
) -> xr.Dataset:
    """Score every pair of setups of D and E, and list the best ones: paper/decisions/0062.

    `ResultError` unless the study has all sixteen experiments.

    Parameters
    ----------
    study : Study
        The paper's.
    cells : xarray.Dataset
        From `open_loop_cells`.
    seed_sets : xarray.Dataset
        From `read_seed_sets`; the first set has the study's own seeds and is left out of the covariance.
    progress : callable
        Gets a line after the search.

    Returns
    -------
    xarray.Dataset
        ``score`` by (setup_D, setup_E), positions along ``setup``. For each ``pair`` of the ledger (the
        `BEST` ones, the best by each other criterion, and the study's own): ``place``, ``setup_number``,
        ``penalty``, ``scores`` by criterion, ``chi_square`` and ``misfit`` by table. ``mean_error``, Pa, and
        ``mse``, Pa^2, of every cell with the best pair. ``seeds_chi_square`` of each seed set, against the
        numbers as printed.
    """
    check_all_experiments(study)
    over_seeds = numbers_of_seed_sets(study, seed_sets)
    likelihood, errors = TableLikelihood(over_seeds), PairErrors(study, cells)
    numbers = np.stack([_numbers(study, *errors(i, slice(None))) for i in range(len(SETUPS))])
    penalties = np.array([[penalty((of_D, of_E)) for of_E in SETUPS] for of_D in SETUPS])
    scores = np.nan_to_num(scores_by_criterion(likelihood, numbers) + penalties, nan=np.inf)
    progress(f"{len(SETUPS) ** 2} pairs of setups, done")

    order = np.argsort(scores[0], axis=None, kind="stable")
    today = tuple(SETUPS.index(configured_setup(study, cylinder)) for cylinder in BOTH_CYLINDERS)
    best_by = {
        name: np.unravel_index(values.argmin(), values.shape)
        for name, values in zip(CRITERIA, scores, strict=True)
    }
    pairs = {str(k + 1): np.unravel_index(order[k], scores[0].shape) for k in range(BEST)}
    pairs |= {f"best by {name}": best_by[name] for name in CRITERIA[1:]} | {TODAY: today}
    rows: list[dict[str, object]] = []
    for i, j in pairs.values():
        rows.append(
            {
                "place": 1 + int(np.count_nonzero(scores[0] < scores[0, i, j])),
                "setup_number": [int(i), int(j)],
                "penalty": penalties[i, j],
                "scores": scores[:, i, j],
                "chi_square": [likelihood.chi_square(numbers[i, j], (table,)) for table in TABLES],
                "misfit": misfits(likelihood, numbers[i, j]),
            }
        )
    ledger = pd.DataFrame(rows)
    of_best = errors(*map(int, pairs["1"]))
    dims = {"place": (), "setup_number": ("cylinder",), "penalty": (), "scores": ("criterion",)}
    dims |= {"chi_square": ("table",), "misfit": ("table",)}
    names = cells["open_loop"].values.tolist()
    cylinders = [study.experiments[name].cylinder for name in names]
    parts = [TABLES, *((table,) for table in TABLES)]
    seeds_chi_square = [likelihood.chi_square(over_seeds, tables, "printed") for tables in parts]
    result = xr.Dataset(
        {"score": (("setup_D", "setup_E"), scores[0])}
        | {name: (("pair", *dims[name]), np.array(ledger[name].tolist())) for name in dims}
        | {name: (("experiment", "model", "n"), values) for name, values in zip(ERRORS, of_best, strict=True)}
        | {
            "cylinder_of": (
                "open_loop",
                [BOTH_CYLINDERS.index(cylinder) for cylinder in cylinders],
            ),
            "reversals": (("open_loop", "setup"), cells["reversals"].transpose("open_loop", "setup").values),
            "seeds_chi_square": (("seeds", "tables"), np.stack(seeds_chi_square, axis=-1)),
            "shrinkage": ((), likelihood.shrinkage),
        },
        coords={"pair": list(pairs), "cylinder": list(BOTH_CYLINDERS), "criterion": list(CRITERIA)}
        | {"table": list(TABLES), "tables": ["all", *TABLES]}
        | {"experiment": list(study.experiments), "model": list(PAPER_MODELS), "n": list(study.n)}
        | {"open_loop": names, "seeds": seed_sets["seeds"].values}
        | setup_coordinates(),
    )
    return described(result, LONG_NAMES)
