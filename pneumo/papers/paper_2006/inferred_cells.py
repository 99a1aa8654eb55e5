"""Cells of the grid that a 10 per cent percentile of Fig. 11 implies, though no table prints them.

Over the eight experiments of a level, the rule `linear` gives p10 = 0.3 of the smallest mean square error and
0.7 of the second smallest. Where one of these two is of an experiment in `HARDLY_REVERSED`, which does not
depend on how reversals are recorded, the printed p10 implies the other.
"""

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.papers.paper_2006.printed_tables import percentiles, table5, table9

HARDLY_REVERSED = ("E05", "E09", "E13")  # at most four times a run
SMALLEST = 0.3  # fraction of the smallest of eight errors in p10; the rest is the second smallest


def inferred_cells(mse: xr.DataArray) -> pd.DataFrame:
    """Mean square errors that Fig. 11's p10 imply, beside the reproduced ones.

    Parameters
    ----------
    mse : xarray.DataArray
        Reproduced mean square errors of both chambers together by (experiment, model, n), Pa^2, of all
        sixteen experiments.

    Returns
    -------
    pandas.DataFrame
        A row for each inferred cell: level, model, n, experiment, ``inferred`` and ``reproduced``, Pa^2.
        Which two experiments are the smallest is taken from the reproduction; an implied value that
        contradicts it has no row.
    """
    printed, k_0, bounds, rows = percentiles(11), table5()["k_0"], table9(), []
    for level in printed["level"].values.tolist():
        low, high = (float(bounds[name].sel(level=level)) for name in ("k_0_low", "k_0_high"))
        of_level = k_0["experiment"].values[((k_0 >= low) & (k_0 <= high)).values]
        for model in printed["model"].values.tolist():
            at = printed.sel(level=level, model=model)
            n, p10 = at["constant_n"].item(), at["p10"].item()
            errors = mse.sel(experiment=of_level, model=model).sel(n=n, method="nearest")
            first, second, third = errors.sortby(errors).isel(experiment=slice(3))
            known = [e["experiment"].item() in HARDLY_REVERSED for e in (first, second)]
            if sum(known) != 1:
                continue
            if known[0]:
                other, value = second, (p10 - SMALLEST * first.item()) / (1 - SMALLEST)
                consistent = first.item() <= value <= third.item()
            else:
                other, value = first, (p10 - (1 - SMALLEST) * second.item()) / SMALLEST
                consistent = 0 < value <= second.item()
            if consistent:
                rows.append((level, model, n, other["experiment"].item(), value, other.item()))
    return pd.DataFrame(rows, columns=["level", "model", "n", "experiment", "inferred", "reproduced"])


def rms_of_inferred(cells: pd.DataFrame) -> float:
    """Root mean square of log10(reproduced / inferred)."""
    return float(np.sqrt(np.mean(np.log10(cells["reproduced"] / cells["inferred"]) ** 2)))
