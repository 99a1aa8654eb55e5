"""Table and picture of budget-test.md, from the kept results of the test."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper.study.text.markdown_tables import markdown_table
from pneumo.publish.style import DOUBLE_MM, GREY, new_figure, paper_style

TOLERANCE = 1.1  # of RMS errors, in the third statement
INSIDE, OUTSIDE = "#2f74b5", "#f0922f"


def of_recommended(cells: xr.Dataset) -> xr.Dataset:
    """Errors of the model that each answer recommends."""
    return cells.isel(row=cells["recommended"])


def inside(cells: xr.Dataset) -> xr.DataArray:
    """Whether the interval of the answer holds the realised error."""
    own = of_recommended(cells)
    return (own["expected_low"] <= own["realised"]) & (own["realised"] <= own["expected_high"])


def row(cells: xr.Dataset) -> list[str]:
    """Row of the table: how far the three statements hold."""
    own = of_recommended(cells)
    first = cells["realised_known"].isel(group=cells["first_group"])
    least = cells["realised_known"].min("group")
    fractions = [
        inside(cells).mean(),
        (own["realised"] > own["expected_high"]).mean(),
        (own["realised"] / cells["lowest"]).median() - 1,
        (own["realised"] / cells["realised"].min("row")).median() - 1,
        (first <= TOLERANCE * least).mean(),
        (first == least).mean(),
        cells["predicted_first"].mean(),
    ]
    return [str(cells.sizes["cylinder"]), *(f"{100 * float(value):.1f} %" for value in fractions)]


def numbers(cells: xr.Dataset, repeated: xr.Dataset) -> dict[str, str]:
    """Table of the outcome of test and repetition for `docs/numbers.yaml`."""
    parts = {
        "all": cells["closed"] >= 0,
        "wall of the full order": cells["other_wall"] == 0,
        "another wall": cells["other_wall"] == 1,
        "open loop": cells["closed"] == 0,
        "position control": cells["closed"] == 1,
    }
    heads = ["", "cylinders", "in the interval", "above it", "median loss", "at the answer's n"]
    heads += ["measure first: right", "strictly", "predicted"]
    rows = [[name, *row(cells.sel(cylinder=chosen))] for name, chosen in parts.items()]
    rows.append(["repeated", *row(repeated)])
    return {"table": markdown_table(heads, rows), "commit": cells.attrs["commit"][:8]}


@paper_style()
def picture(cells: xr.Dataset) -> Figure:
    """Realised errors and intervals of all cylinders, over the expected error."""
    own, held = of_recommended(cells), inside(cells).values
    ratio = own["realised"].values / own["expected_rms"].values
    order = np.argsort(ratio)
    place = np.arange(len(order))
    low, high = (own[f"expected_{end}"].values / own["expected_rms"].values for end in ("low", "high"))
    fig = new_figure(DOUBLE_MM, 80)
    ax = fig.subplots()
    ax.vlines(place, low[order], high[order], color=GREY, lw=0.5, label="interval")
    for chosen, color, label in ((held, INSIDE, "error inside"), (~held, OUTSIDE, "error outside")):
        at = np.flatnonzero(chosen[order])
        ax.plot(at, ratio[order][at], ".", ms=3, color=color, label=label)
    ax.set_yscale("log")
    ax.set_xlabel("cylinders, by realised over expected error")
    ax.set_ylabel("over the expected error")
    ax.legend(loc="upper left")
    return fig
