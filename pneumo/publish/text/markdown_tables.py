"""Tables as Markdown, reproduced values beside published ones."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.publish.text.terminal_tables import TRANSPORT_HEADS


def _table(heads: Sequence[str], rows: Iterable[Iterable[Any]], rule: str = "---") -> list[str]:
    """Lines of a table, with a rule below each heading."""
    head, *lines = (f"| {' | '.join(map(str, cells))} |" for cells in (heads, *rows))
    return [head, f"|{'|'.join([rule] * len(heads))}|", *lines]


def _number(value: xr.DataArray, form: str, missing: str = "–") -> str:
    """Write a number, or a dash where there is none."""
    return f"{value.item():{form}}" if np.isfinite(value) else missing


def table_7(statistics: xr.Dataset, published: xr.Dataset) -> str:
    """Average MSE, mean and standard deviation of the error of every model at its best n.

    `statistics` are those of the published transport, `published` is the printed Table 7; a model that it
    lacks gets dashes.
    """
    reproduced = statistics.sel(level="overall")
    published = published.reindex(model=reproduced["model"])
    heads = ["model", "MSE, published (Pa²)", "MSE, reproduced (Pa²)", "ratio"]
    heads += [f"{symbol}, {source} (Pa)" for symbol in "μσ" for source in ("published", "reproduced")]
    rows: list[list[str]] = []
    for model in reproduced["model"].values:
        a, b = published.sel(model=model), reproduced.sel(model=model)
        cells = [_number(a["mse"], ".2e"), _number(b["mse"], ".2e"), _number(b["mse"] / a["mse"], ".2f")]
        cells += [_number(of[name], ".0f") for name in ("mean_error", "std") for of in (a, b)]
        rows.append([model, *cells])
    left_out = [
        f"\n{name} is left out: its full-order run failed at t = {time:g} s."
        for name, time in statistics["failure_time"].dropna("experiment").to_series().items()
    ]
    return "\n".join([*_table(heads, rows), *left_out]) + "\n"


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
    lines = [
        "Each assumption of `paper/2006/assumptions.yaml` toggled alone, for the whole study.",
        "Changes are against the study as taken, misfits against the print: settling times for Table 5, mean"
        " square errors for Tables 7 and 9.",
        "",
        *_table(heads, rows),
    ]
    return "\n".join(lines) + "\n"


def variants_table(variants: xr.Dataset) -> str:
    """Share of the alternatives in ``results/variants.nc`` for which a refinement pays; then every ratio."""
    levels, pairs = variants["level"].values, variants["pair"].values
    columns = list(itertools.product(pairs, levels))
    shares: list[list[str]] = []
    for case in itertools.product(variants["transport"].values, variants["criterion"].values, pairs):
        one = variants.sel(dict(zip(("transport", "criterion", "pair"), case, strict=True)))
        counted = one["counted"].values.astype(int)
        pays = np.rint(np.nan_to_num(one["share"]) * counted).astype(int)
        shares.append([*case, *(f"{part} of {of}" for part, of in zip(pays, counted, strict=True))])
    ratio = variants["ratio"].sel(transport="exact", criterion="mean")
    ratios = [
        [name, *(_number(ratio.sel(pair=p, level=at, alternative=name), ".2f", "-") for p, at in columns)]
        for name in variants["alternative"].values
    ]
    lines = [
        "Ratio of mean square errors with and without a refinement, each model at its best constant n of the"
        " level; overall, at its best n in each experiment.",
        "",
        "Alternatives under which the refinement pays (ratio below 1), of those that have a ratio:",
        "",
        *_table(["transport", "over experiments", "ratio", *levels], shares, " --- "),
        "",
        "Every ratio, exact transport, mean over experiments:",
        "",
        *_table(["alternative", *(f"{pair} {level}" for pair, level in columns)], ratios, " --- "),
    ]
    return "\n".join(lines) + "\n"


def findings_table(findings: Mapping[str, Any], headlines: bool = True) -> str:
    """Statements of 2006 about models, the main ones or all, with both transports and intervals."""
    rows = [
        [
            *(row[key] for key in ("claim", "published", "exact", "interval")),
            f"**{row['stands']}**" + (f": {row['why']}" if row["why"] else ""),
        ]
        for row in findings["claims"]
        if row["headline"] or not headlines
    ]
    heads = ["statement of 2006", *TRANSPORT_HEADS.values(), "95 % interval", "stands?"]
    return "\n".join([*_table(heads, rows), "", findings["note"]]) + "\n"
