"""What stands at the head of the verdict: how near the tables are met, and the two findings.

The findings are the row that the text of section 4 takes for M7's, and what exact transport of the recorded
signals does to the ranking of the good models.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import xarray as xr

from pneumo.physics.models import MODELS
from pneumo.verdict.published import read_table
from pneumo.verdict.sources import Results

LEVELS = ("adiabatic", "typical", "isothermal")
PAIRS = (("M6", "M5"), ("M8", "M7"), ("M10", "M8"))


def _six(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def highlights(sources: Mapping[str, Results], items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Summarise the verdict.

    Parameters
    ----------
    sources : mapping of str to Results
        ``published``, ``exact`` and ``printed``.
    items : sequence of mapping
        The judged items.

    Returns
    -------
    dict
        ``scores``; ``wrong_row``, the numbers of M7 and M8 at the typical level; ``transport``, quotients
        of mean square errors by level and transport; ``by_experiment``, the same by experiment. The
        last three are None for a study that is not the paper's, or in which an experiment failed.
    """
    found: dict[str, Any] = {"scores": scores(items)}
    published = sources["published"]
    whole = list(published.study.experiments) == _experiments() and not published.failures
    for summary in (wrong_row, transport, by_experiment):
        found[summary.__name__] = summary(sources) if whole else None
    return found


def _experiments() -> list[str]:
    """Names of the paper's sixteen experiments."""
    return list(dict.fromkeys(read_table(6)["row"]))


def scores(items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How near Tables 5, 7, 8 and 9 are met."""

    def cells(table: int, column: str | None = None) -> list[Mapping[str, Any]]:
        return [
            item
            for item in items
            if item["table"] == table
            and column in (None, item["column"])
            and item["status"] != "unreadable"
            and isinstance(item["reproduced"], float)
        ]

    result: dict[str, Any] = {}
    for table in (7, 9):
        logs = [math.log1p(item["deviation"]) for item in cells(table, "mse") if item["deviation"] > -1]
        if logs:
            result[f"table_{table}_mse"] = {
                "cells": len(logs),
                "rms_of_ln_ratio": _six(math.sqrt(sum(log**2 for log in logs) / len(logs))),
                "lowest_ratio": _six(math.exp(min(logs))),
                "highest_ratio": _six(math.exp(max(logs))),
            }
    for table, name in ((8, "table_8"), (5, "table_5")):
        found = cells(table)
        within = [item for item in found if item["status"] in ("exact", "close")]
        exact = sum(item["status"] == "exact" for item in found)
        result[name] = {"cells": len(found), "exact": exact, "exact_or_close": len(within)}
    readable = [item for item in items if item["status"] != "unreadable"]
    result["missed_of_readable"] = _six(sum(item["status"] == "missed" for item in readable) / len(readable))
    return result


def wrong_row(sources: Mapping[str, Results]) -> list[dict[str, Any]]:
    """M7 and M8 at the typical level in Table 9 and in both transports, by quantity."""

    def row(source: Results, model: str) -> dict[str, float | None]:
        level = source.statistics.sel(level="typical")
        mse = level["mse"]
        own = float(mse.sel(model=model))
        return {
            "of_M6": _six(own / float(mse.sel(model="M6"))),
            "of_classical": _six(own / float(mse.sel(model=["M1", "M2", "M3"]).min())),
            "mu": _six(float(level["mean_error"].sel(model=model))),
            "sigma": _six(float(level["std"].sel(model=model))),
        }

    return [
        {"model": model, "source": name} | row(sources[name], model)
        for name in ("printed", "published", "exact")
        for model in ("M7", "M8")
    ]


def transport(sources: Mapping[str, Results]) -> list[dict[str, Any]]:
    """Mean square errors of M5 to M10 by level, and quotients of pairs, for each transport."""
    rows = []
    for level in LEVELS:
        for name in ("printed", "published", "exact"):
            mse = sources[name].statistics["mse"].sel(level=level)
            values = {model: float(mse.sel(model=model)) for model in list(MODELS)[4:]}
            quotients = {f"{a}/{b}": _six(values[a] / values[b]) for a, b in PAIRS}
            rows.append(
                {"level": level, "source": name, "mse": {m: _six(v) for m, v in values.items()}}
                | {"quotients": quotients}
            )
    return rows


def by_experiment(sources: Mapping[str, Results]) -> dict[str, Any]:
    """M8 over M7 in every experiment, each at its own best n, for both transports, and the geometric mean."""
    experiments = _experiments()
    found: dict[str, Any] = {"experiments": experiments}
    for name in ("published", "exact"):
        best: xr.DataArray = sources[name].cells["mse"].min("n").sel(experiment=experiments)
        ratio = (best.sel(model="M8") / best.sel(model="M7")).values
        found[name] = [_six(float(value)) for value in ratio]
        found[f"{name}_geometric_mean"] = _six(math.exp(sum(math.log(value) for value in ratio) / len(ratio)))
    return found
