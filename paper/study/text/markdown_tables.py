"""Tables as Markdown: results beside published numbers, and summaries of evidence."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr


def markdown_table(heads: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Table of cells that are Markdown already; no newline at its end."""
    head, *cells = (f"| {' | '.join(map(str, row))} |" for row in (heads, *rows))
    return "\n".join([head, "| --- " * (head.count(" | ") + 1) + "|", *cells])


def _number(value: xr.DataArray, form: str, missing: str = "–") -> str:
    """Write a number, or a dash where there is none."""
    return f"{value.item():{form}}" if np.isfinite(value) else missing


def table_7(statistics: xr.Dataset, published: xr.Dataset) -> str:
    """Average MSE, mean and standard deviation of the error of every model at its best n.

    `statistics` are with signals as in the paper; a model that the printed Table 7, `published`, lacks gets
    dashes.
    """
    reproduced = statistics.sel(level="overall")
    published = published.reindex(model=reproduced["model"])
    heads = ["model", "MSE, published (Pa²)", "MSE, reproduced (Pa²)", "ratio"]
    heads += [f"{symbol}, {source} (Pa)" for symbol in "μσ" for source in ("published", "reproduced")]
    rows: list[list[str]] = []
    for model in reproduced["model"].values:
        a, b = published.sel(model=model), reproduced.sel(model=model)
        cells = [_number(a["mse"], ".2e"), _number(b["mse"], ".2e"), _number(b["mse"] / a["mse"], ".2f")]
        cells += [_number(source[name], ".0f") for name in ("mean_error", "std") for source in (a, b)]
        rows.append([model, *cells])
    left_out = [
        f"\n{name} is left out: its full-order run failed at t = {time:g} s."
        for name, time in statistics["failure_time"].dropna("experiment").to_series().items()
    ]
    return "\n".join([markdown_table(heads, rows), *left_out]) + "\n"
