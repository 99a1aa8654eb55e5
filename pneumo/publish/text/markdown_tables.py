"""Tables as Markdown, reproduced values beside published ones."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.publish.text.terminal_tables import TRANSPORT_HEADS


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def _head(cells: Sequence[str]) -> list[str]:
    return [_line(cells), "|---" * len(cells) + "|"]


def _number(value: xr.DataArray, form: str) -> str:
    """Write a number, or a dash where there is none."""
    return f"{value.item():{form}}" if np.isfinite(value) else "–"


def table_7(statistics: xr.Dataset, published: xr.Dataset) -> str:
    """Average MSE, mean and standard deviation of the error of every model at its best n.

    Parameters
    ----------
    statistics : xarray.Dataset
        From `pneumo.statistics.averages.statistics`, published transport.
    published : xarray.Dataset
        From `pneumo.verdict.published.table7`; a model that it lacks gets dashes.
    """
    reproduced = statistics.sel(level="overall")
    published = published.reindex(model=reproduced["model"])
    heads = ["model", "MSE, published (Pa²)", "MSE, reproduced (Pa²)", "ratio"]
    heads += [f"{symbol}, {source} (Pa)" for symbol in "μσ" for source in ("published", "reproduced")]
    lines = _head(heads)
    for model in reproduced["model"].values:
        a, b = published.sel(model=model), reproduced.sel(model=model)
        cells = [_number(a["mse"], ".2e"), _number(b["mse"], ".2e"), _number(b["mse"] / a["mse"], ".2f")]
        cells += [_number(of[name], ".0f") for name in ("mean_error", "std") for of in (a, b)]
        lines.append(_line([model, *cells]))
    failure_time = statistics["failure_time"].dropna("experiment")
    lines += [
        f"\n{name} is left out: its full-order run failed at t = {time:g} s."
        for name, time in zip(failure_time["experiment"].values, failure_time.values, strict=True)
    ]
    return "\n".join(lines) + "\n"


def assumptions_table(effects: pd.DataFrame) -> str:
    """Effect of every alternative assumption on Tables 5, 7, 8 and 9, from `toggle_effects`."""
    tables = (5, 7, 9)
    heads = ["assumption", "alternative", *(f"T{table}: largest, rms change of ln" for table in tables)]
    heads += ["T8: cells changed", *(f"T{table}: rms misfit of ln" for table in tables)]
    heads += ["T8: exact", "T5: in class", "all four: in class", "no number"]
    lines = [
        "Each assumption of `paper/2006/assumptions.yaml` toggled alone, for the whole study.",
        "Changes are against the study as taken, misfits against the print: settling times for Table 5, mean"
        " square errors for Tables 7 and 9.",
        "",
        *_head(heads),
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
        lines.append(_line(cells))
    return "\n".join(lines) + "\n"


def variants_table(variants: xr.Dataset) -> str:
    """Share of the alternatives in ``results/variants.nc`` for which a refinement pays; then every ratio."""
    levels = list(variants["level"].values)
    pairs = list(variants["pair"].values)
    lines = [
        "Ratio of mean square errors with and without a refinement, each model at its best constant n of the"
        " level; overall, at its best n in each experiment.",
        "",
        "Alternatives under which the refinement pays (ratio below 1), of those that have a ratio:",
        "",
        _line(["transport", "over experiments", "ratio", *levels]),
        _line(["---"] * (3 + len(levels))),
    ]
    for transport in variants["transport"].values:
        for criterion in variants["criterion"].values:
            for pair in pairs:
                one = variants.sel(transport=transport, criterion=criterion, pair=pair)
                counted = [int(one["counted"].sel(level=level)) for level in levels]
                share = np.nan_to_num(one["share"].sel(level=levels))
                shares = [f"{round(part * of)} of {of}" for part, of in zip(share, counted, strict=True)]
                lines.append(_line([transport, criterion, pair, *shares]))
    lines += ["", "Every ratio, exact transport, mean over experiments:", ""]
    lines += [
        _line(["alternative", *(f"{pair} {level}" for pair in pairs for level in levels)]),
        _line(["---"] * (1 + len(pairs) * len(levels))),
    ]
    ratio = variants["ratio"].sel(transport="exact", criterion="mean")
    for alternative in variants["alternative"].values:
        one = ratio.sel(alternative=alternative)
        values = [one.sel(pair=pair, level=level).item() for pair in pairs for level in levels]
        cells = (f"{value:.2f}" if np.isfinite(value) else "-" for value in values)
        lines.append(_line([alternative, *cells]))
    return "\n".join(lines) + "\n"


def findings_table(findings: Mapping[str, Any], headlines: bool = True) -> str:
    """Statements of 2006 about models, the main ones or all, with both transports and intervals."""
    lines = _head(["statement of 2006", *TRANSPORT_HEADS.values(), "95 % interval", "stands?"])
    for row in findings["claims"]:
        if row["headline"] or not headlines:
            stands = f"**{row['stands']}**" + (f": {row['why']}" if row["why"] else "")
            lines.append(_line([row["claim"], row["published"], row["exact"], row["interval"], stands]))
    return "\n".join([*lines, "", findings["note"]]) + "\n"
