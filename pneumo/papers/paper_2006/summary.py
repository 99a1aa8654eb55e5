"""Head of the verdict: how closely the tables are met, and the two findings.

The findings are the row that the text of section 4 takes for M7's, and what exact transport of the recorded
signals does to the ranking of the good models.
"""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import xarray as xr

from pneumo.papers.paper_2006.table1 import PAPER_MODELS
from pneumo.verdict.judging import Item, Sources, six_digits

EXPERIMENTS = [f"E{number:02d}" for number in range(1, 17)]
LEVELS = ("adiabatic", "typical", "isothermal")
ORIGINS = ("printed", "published", "exact")
QUOTIENTS = (("M6", "M5"), ("M8", "M7"), ("M10", "M8"))


def highlights(sources: Sources, items: Sequence[Item]) -> dict[str, Any]:
    """Summarise the verdict from its sources and the judged items.

    Returns
    -------
    dict
        ``scores``; ``wrong_row``, the numbers of M7 and M8 at the typical level; ``transport``, quotients
        of mean square errors by level and transport; ``by_experiment``, the same by experiment. The
        last three are None for a study that is not the paper's, or in which an experiment failed.
    """
    summary: dict[str, Any] = {"scores": scores(items)}
    published = sources["published"]
    whole = list(published.study.experiments) == EXPERIMENTS and not published.failures("datum")
    for part in (wrong_row, transport, by_experiment):
        summary[part.__name__] = part(sources) if whole else None
    return summary


def scores(items: Sequence[Item]) -> dict[str, Any]:
    """How closely Tables 5, 7, 8 and 9 are met: number of cells, deviations, how many are exact or close."""
    readable = [item for item in items if item["status"] != "unreadable"]
    cells = [item for item in readable if isinstance(item["reproduced"], float)]
    result: dict[str, Any] = {}
    for table in (7, 9):
        of_mse = [item for item in cells if (item["table"], item["column"]) == (table, "mse")]
        logs = [math.log1p(item["deviation"]) for item in of_mse if item["deviation"] > -1]
        if logs:
            result[f"table_{table}_mse"] = {
                "cells": len(logs),
                "rms_of_ln_ratio": six_digits(math.sqrt(sum(log**2 for log in logs) / len(logs))),
                "lowest_ratio": six_digits(math.exp(min(logs))),
                "highest_ratio": six_digits(math.exp(max(logs))),
            }
    for table in (8, 5):
        statuses = [item["status"] for item in cells if item["table"] == table]
        exact, close = statuses.count("exact"), statuses.count("close")
        result[f"table_{table}"] = {"cells": len(statuses), "exact": exact, "exact_or_close": exact + close}
    missed = sum(item["status"] == "missed" for item in readable)
    return result | {"missed_of_readable": six_digits(missed / len(readable))}


def wrong_row(sources: Sources) -> list[dict[str, Any]]:
    """M7 and M8 at the typical level in Table 9 and in both transports, by quantity."""
    rows: list[dict[str, Any]] = []
    for name, model in itertools.product(ORIGINS, ("M7", "M8")):
        level = sources[name].statistics.sel(level="typical")
        M6, classical = level["mse"].sel(model="M6"), level["mse"].sel(model=["M1", "M2", "M3"]).min()
        row = level.sel(model=model)
        numbers = {"of_M6": row["mse"] / M6, "of_classical": row["mse"] / classical}
        numbers |= {"mu": row["mean_error"], "sigma": row["std"]}
        rounded = {key: six_digits(float(number)) for key, number in numbers.items()}
        rows.append({"model": model, "source": name} | rounded)
    return rows


def transport(sources: Sources) -> list[dict[str, Any]]:
    """Mean square errors of M5 to M10 by level, and quotients of pairs, for each transport."""
    rows: list[dict[str, Any]] = []
    for level, name in itertools.product(LEVELS, ORIGINS):
        mse = sources[name].statistics["mse"].sel(level=level)
        values = {model: float(mse.sel(model=model)) for model in list(PAPER_MODELS)[4:]}
        rounded = {model: six_digits(value) for model, value in values.items()}
        quotients = {f"{a}/{b}": six_digits(values[a] / values[b]) for a, b in QUOTIENTS}
        rows.append({"level": level, "source": name, "mse": rounded, "quotients": quotients})
    return rows


def by_experiment(sources: Sources) -> dict[str, Any]:
    """M8 over M7 in every experiment, each at its own best n, for both transports, and the geometric mean."""
    quotients: dict[str, Any] = {"experiments": EXPERIMENTS}
    for name in ("published", "exact"):
        best: xr.DataArray = sources[name].cells["mse"].min("n").sel(experiment=EXPERIMENTS)
        ratio = (best.sel(model="M8") / best.sel(model="M7")).values
        quotients[name] = [six_digits(float(value)) for value in ratio]
        mean = math.exp(sum(math.log(value) for value in ratio) / len(ratio))
        quotients[f"{name}_geometric_mean"] = six_digits(mean)
    return quotients
