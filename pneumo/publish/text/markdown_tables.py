"""Tables as Markdown, reproduced values beside published ones."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
import xarray as xr


def table_7(statistics: xr.Dataset, published: xr.Dataset) -> str:
    """Average MSE, mean and standard deviation of the error of every model at its best n.

    Parameters
    ----------
    statistics : xarray.Dataset
        From `pneumo.statistics.averages.statistics`, published transport.
    published : xarray.Dataset
        From `pneumo.verdict.published.table7`.
    """
    ours = statistics.sel(level="overall")
    lines = [
        "| model | MSE, published (Pa²) | MSE, reproduced (Pa²) | ratio | μ, published (Pa)"
        " | μ, reproduced (Pa) | σ, published (Pa) | σ, reproduced (Pa) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for model in published["model"].values:
        a, b = published.sel(model=model), ours.sel(model=model)
        lines.append(
            f"| {model} | {a['mse'].item():.2e} | {b['mse'].item():.2e} | {(b['mse'] / a['mse']).item():.2f}"
            f" | {a['mean_error'].item():.0f} | {b['mean_error'].item():.0f}"
            f" | {a['std'].item():.0f} | {b['std'].item():.0f} |"
        )
    failure_time = statistics["failure_time"].dropna("experiment")
    lines += [
        f"\n{name} is left out: its full-order run failed at t = {time:g} s."
        for name, time in zip(failure_time["experiment"].values, failure_time.values, strict=True)
    ]
    return "\n".join(lines) + "\n"


def assumptions(effects: pd.DataFrame) -> str:
    """Effect of every alternative assumption on Tables 5, 7, 8 and 9.

    Parameters
    ----------
    effects : pandas.DataFrame
        From `pneumo.evidence.toggle_effects.effects`.
    """
    tables = (5, 7, 9)
    heads = [
        "assumption",
        "alternative",
        *(f"T{table}: largest, rms change of ln" for table in tables),
        "T8: cells changed",
        *(f"T{table}: rms misfit of ln" for table in tables),
        "T8: exact",
        "T5: in class",
        "all four: in class",
        "no number",
    ]
    lines = [
        "Each assumption of `paper/2006/assumptions.yaml` toggled alone, for the whole study.",
        "Changes are against the study as taken, misfits against the print: settling times for Table 5, mean"
        " square errors for Tables 7 and 9.",
        "",
        f"| {' | '.join(heads)} |",
        "|---" * len(heads) + "|",
    ]
    for name, row in effects.iterrows():
        assumption, _, alternative = str(name).partition(".")
        cells = [
            assumption,
            alternative,
            *(f"{row[f'largest_{table}']:.3f}, {row[f'rms_{table}']:.3f}" for table in tables),
            f"{row['changed_8']:.0f}",
            *(f"{row[f'misfit_{table}']:.3f}" for table in tables),
            *(f"{row[key]:.0f}" for key in ("exact_8", "within_5", "inside", "no_number")),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def findings(found: Mapping[str, Any], headlines: bool = True) -> str:
    """Statements of 2006 about models, with both transports and intervals, and whether they stand.

    Parameters
    ----------
    found : mapping
        From `pneumo.evidence.findings.findings`.
    headlines : bool
        Only those of short lists.
    """
    lines = [
        "| statement of 2006 | transport as published | exact transport | 95 % interval | stands? |",
        "|---|---|---|---|---|",
    ]
    for row in found["claims"]:
        if row["headline"] or not headlines:
            stands = f"**{row['stands']}**" + (f": {row['why']}" if row["why"] else "")
            cells = (row["claim"], row["published"], row["exact"], row["interval"], stands)
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, "", found["note"]]) + "\n"
