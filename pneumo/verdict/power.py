"""Power of a verdict: known mistakes that would lose an item, and what each mistake loses and wins."""

from collections.abc import Mapping
from typing import Any

import xarray as xr

from pneumo.verdict.claims import BASES

NO_MISTAKE = "none"  # name of the study as it is among the mistakes


def losing_mistakes(agrees: xr.DataArray) -> dict[str, list[str]]:
    """For each item that agrees without a mistake: the mistakes under which it no longer agrees.

    `agrees` is true or false by (mistake, item), with `NO_MISTAKE` among the mistakes.
    """
    before, mistaken = agrees.sel(mistake=NO_MISTAKE), agrees.drop_sel(mistake=NO_MISTAKE)
    names = mistaken["mistake"].values
    agreeing = agrees["item"].values[before.values].tolist()
    return {item: names[~mistaken.sel(item=item).values].tolist() for item in agreeing}


def mistakes_table(agrees: xr.DataArray, basis: Mapping[str, str]) -> list[dict[str, Any]]:
    """One row per mistake, with the number of items that agree only without it, or only with it.

    Keys: `mistake`; number of items `lost` and `won`; `net`, lost less won; `of`, number of items that agree
    without a mistake; then the number lost of each kind of evidence. `agrees` is that of `losing_mistakes`;
    `basis` is the kind of evidence of each item that counts.
    """
    agrees = agrees.sel(item=[name for name in agrees["item"].values.tolist() if name in basis])
    before, rows = agrees.sel(mistake=NO_MISTAKE), []
    for name in agrees["mistake"].values.tolist():
        if name == NO_MISTAKE:
            continue
        after = agrees.sel(mistake=name)
        lost = [basis[item] for item in agrees["item"].values[(before & ~after).values].tolist()]
        won = int((after & ~before).sum())
        row = {"mistake": name, "lost": len(lost), "won": won, "net": len(lost) - won}
        rows.append(row | {"of": int(before.sum())} | {kind: lost.count(kind) for kind in BASES})
    return rows
