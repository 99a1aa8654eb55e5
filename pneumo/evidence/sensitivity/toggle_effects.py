"""Change of Tables 5, 7, 8 and 9 by each toggled assumption, and their distance from the print."""

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.statistics.averages import rms_of
from pneumo.verdict.assumptions import AS_TAKEN
from pneumo.verdict.claims import Claims
from pneumo.verdict.comparison import compare
from pneumo.verdict.sources import Finding

LOGARITHMIC_TABLES = (5, 7, 9)  # tables whose settling times or mean square errors are compared as logarithms


def _rms_of_finite(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return rms_of(finite) if len(finite) else np.nan


def toggle_effects(reproduced: xr.DataArray, claims: Claims) -> pd.DataFrame:
    """Effect of each alternative on Tables 5, 7, 8 and 9, from the `reproduced` of `toggled_tables`.

    One row per alternative. For Tables 5, 7 and 9, here with the suffix of Table 5:

    - ``largest_5``, ``rms_5``: change of the logarithm of settling times or mean square errors against the
      study as taken
    - ``misfit_5``: root mean square of ln(reproduced / printed)
    - ``worse_5``: that misfit less the study's, over the same items

    Numbers of cells or items:

    - ``changed_8``, ``exact_8``: cells of Table 8 that differ from the study's; that equal the print
    - ``within_5``, ``inside``: cells of Table 5, and items of all four tables, within their tolerance
    - ``no_number``: items without a number
    """
    items = [claims.items[str(name)] for name in reproduced["item"].values]
    values = pd.DataFrame(reproduced.values, index=reproduced["alternative"].values.astype(str))
    taken = values.loc[AS_TAKEN].to_numpy()
    printed = np.array([claim.value for claim in items])
    tables = np.array([claim.table for claim in items])
    logarithmic = np.array([c.erratum is None and (c.table == 5 or c.column == "mse") for c in items])
    rows = {}
    for alternative, row in values.iterrows():
        toggled = row.to_numpy()
        compared = [
            compare(c, claims.classes[c.tolerance], Finding(x)) for c, x in zip(items, toggled, strict=True)
        ]
        inside = np.array([comparison.agreement is not None for comparison in compared])
        changed = (toggled != taken) & ~(np.isnan(toggled) & np.isnan(taken))
        rows[alternative] = {
            "changed_8": int(np.sum(changed & (tables == 8))),
            "exact_8": int(np.sum(np.isclose(toggled, printed) & (tables == 8))),
            "within_5": int(np.sum(inside & (tables == 5))),
            "inside": int(np.sum(inside)),
            "no_number": int(np.sum(np.isnan(toggled) & ~np.isnan(printed))),
        }
        for table in LOGARITHMIC_TABLES:
            both_positive = logarithmic & (tables == table) & (toggled > 0) & (taken > 0)
            change = np.log(toggled[both_positive] / taken[both_positive])
            misfit, before = (
                _rms_of_finite(np.log(x[both_positive] / printed[both_positive])) for x in (toggled, taken)
            )
            rows[alternative] |= {
                f"largest_{table}": float(np.max(np.abs(change), initial=0.0)),
                f"rms_{table}": _rms_of_finite(change),
                f"misfit_{table}": misfit,
                f"worse_{table}": misfit - before,
            }
    return pd.DataFrame.from_dict(rows, orient="index")
