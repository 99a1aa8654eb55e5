"""Tables as Markdown: results beside published numbers, and summaries of evidence."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.publish.labels import STUDY_SAMPLING


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


def assumptions_table(effects: pd.DataFrame) -> str:
    """Effect of every alternative assumption on Tables 5, 7, 8 and 9, from `toggle_effects`."""
    tables = (5, 7, 9)
    heads = ["assumption", "alternative", *(f"T{table}: largest, rms change of ln" for table in tables)]
    heads += ["T8: cells changed", *(f"T{table}: rms misfit of ln" for table in tables)]
    heads += ["T8: exact", "T5: in class", "all four: in class", "no number"]
    rows = [
        [
            *(str(name).partition(".")[::2]),
            *(f"{row[f'largest_{table}']:.3f}, {row[f'rms_{table}']:.3f}" for table in tables),
            f"{row['changed_8']:.0f}",
            *(f"{row[f'misfit_{table}']:.3f}" for table in tables),
            *(f"{row[key]:.0f}" for key in ("exact_8", "within_5", "inside", "no_number")),
        ]
        for name, row in effects.iterrows()
    ]
    return (
        "Each assumption of `paper/2006/assumptions.yaml` replaced alone, for the whole study.\n"
        "Changes are against the study as taken, misfits against the printed tables: settling times for"
        f" Table 5, mean square errors for Tables 7 and 9.\n\n{markdown_table(heads, rows)}\n"
    )


def variants_table(variants: xr.Dataset) -> str:
    """Number of alternatives in ``results/variants.nc`` under which each refinement pays; every ratio."""
    levels, pairs = variants["level"].values, variants["pair"].values
    columns = list(itertools.product(pairs, levels))
    counts: list[list[str]] = []
    for case in itertools.product(variants["transport"].values, variants["criterion"].values, pairs):
        part = variants.sel(dict(zip(("transport", "criterion", "pair"), case, strict=True)))
        counted = part["counted"].values.astype(int)
        pays = np.rint(np.nan_to_num(part["share"]) * counted).astype(int)
        cells = (f"{number} of {total}" for number, total in zip(pays, counted, strict=True))
        counts.append([STUDY_SAMPLING[case[0]], *case[1:], *cells])
    ratio = variants["ratio"].sel(transport="exact", criterion="mean")
    ratios = [
        [name, *(_number(ratio.sel(pair=p, level=at, alternative=name), ".2f", "-") for p, at in columns)]
        for name in variants["alternative"].values
    ]
    of_counts = markdown_table(["signals", "over experiments", "ratio", *levels], counts)
    of_ratios = markdown_table(["alternative", *(f"{pair} {level}" for pair, level in columns)], ratios)
    return (
        "Ratio of mean square errors with and without a refinement, each model at its best constant n of the"
        " level; overall, at its best n in each experiment.\n\n"
        "Alternatives under which the refinement pays (ratio below 1), of those that have a ratio:\n\n"
        f"{of_counts}\n\nEvery ratio, exact signals, mean over experiments:\n\n{of_ratios}\n"
    )


def findings_table(findings: Mapping[str, Any], headlines: bool = True) -> str:
    """Statements of 2006 about models, the main ones or all, with both samplings and intervals."""
    rows = [
        [
            *(row[key] for key in ("claim", "published", "exact", "interval")),
            f"**{row['stands']}**" + (f": {row['why']}" if row["why"] else ""),
        ]
        for row in findings["claims"]
        if row["headline"] or not headlines
    ]
    heads = ["statement of 2006", *STUDY_SAMPLING.values(), "95 % interval", "true?"]
    return f"{markdown_table(heads, rows)}\n\n{findings['note']}\n"
