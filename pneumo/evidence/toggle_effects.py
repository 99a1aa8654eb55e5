"""How much each toggled assumption changes Tables 5, 7, 8 and 9, and how far they then are from the print."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.verdict.assumptions import AS_TAKEN
from pneumo.verdict.claims import Claim, Claims
from pneumo.verdict.comparison import compare
from pneumo.verdict.sources import Finding

LOGARITHMIC_TABLES = (5, 7, 9)  # tables whose settling times or mean square errors are compared as logarithms


def _rms(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else np.nan


def _logarithmic(table: int, items: Mapping[str, Claim]) -> np.ndarray:
    """Mask of a table's settling times or mean square errors, where the print can be read."""
    return np.array(
        [c.table == table and not c.unreadable and (table == 5 or c.column == "mse") for c in items.values()]
    )


def toggle_effects(reproduced: xr.DataArray, claims: Claims) -> pd.DataFrame:
    """Summarise the effect of each alternative, from `pneumo.evidence.toggles.toggled_tables`.

    Returns
    -------
    pandas.DataFrame
        One row per alternative. For tables 5, 7 and 9:

        - ``largest_5``, ``rms_5``: change of the logarithm of settling times or mean square errors against
          the study as taken
        - ``misfit_5``: root mean square of ln(reproduced / printed)
        - ``worse_5``: by how much that exceeds the study's, over the same items

        and ``changed_8``, ``exact_8``: cells of Table 8 that differ from the study's, that equal the print;
        ``within_5``: cells of Table 5 in their class; ``inside``: items of all four tables in their class;
        ``no_number``: items for which there is none.
    """
    items = {str(name): claims.items[str(name)] for name in reproduced["item"].values}
    values = pd.DataFrame(reproduced.values, index=reproduced["alternative"].values.astype(str))
    taken = values.loc[AS_TAKEN].to_numpy()
    printed = np.array([np.nan if claim.unreadable else claim.value for claim in items.values()])
    table_8 = np.array([claim.table == 8 for claim in items.values()])
    table_5 = np.array([claim.table == 5 for claim in items.values()])
    rows = {}
    for alternative, row in values.iterrows():
        toggled = row.to_numpy()
        inside = np.array(
            [
                not claim.unreadable
                and compare(claim, claims.classes[claim.tolerance], Finding(value)).agreement is not None
                for claim, value in zip(items.values(), toggled, strict=True)
            ]
        )
        changed = (toggled != taken) & ~(np.isnan(toggled) & np.isnan(taken))
        rows[alternative] = {
            "changed_8": int(np.sum(changed & table_8)),
            "exact_8": int(np.sum(np.isclose(toggled, printed) & table_8)),
            "within_5": int(np.sum(inside & table_5)),
            "inside": int(np.sum(inside)),
            "no_number": int(np.sum(np.isnan(toggled) & ~np.isnan(printed))),
        }
        for table in LOGARITHMIC_TABLES:
            here = _logarithmic(table, items) & (toggled > 0) & (taken > 0)
            change = np.log(toggled[here] / taken[here])
            misfit, before = (_rms(np.log(x[here] / printed[here])) for x in (toggled, taken))
            rows[alternative] |= {
                f"largest_{table}": float(np.max(np.abs(change), initial=0.0)),
                f"rms_{table}": _rms(change),
                f"misfit_{table}": misfit,
                f"worse_{table}": misfit - before,
            }
    return pd.DataFrame.from_dict(rows, orient="index")
