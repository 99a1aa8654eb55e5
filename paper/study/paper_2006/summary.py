"""Head of the verdict: agreement with the tables, and two findings.

Finding 1: the text of section 4 quotes M8's row for M7. Finding 2: with exact signals the good models rank
differently.
"""

import itertools
import math
import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from paper.study.paper_2006.numbers_of_tables import TABLES
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.results import StudyResults
from paper.study.samplings import STUDY_SAMPLINGS
from paper_verdict.judging import Item, Sources, six_digits

TABLE_NAMES = {
    "T7": "Table 7",
    "T8": "Table 8",
    "T9": "Table 9",
    "p10": "10 % percentiles of Figs 9 and 11",
    "p90": "90 % percentiles of Figs 9 and 11",
}
EXPERIMENTS = [f"E{number:02d}" for number in range(1, 17)]
LEVELS = ("adiabatic", "typical", "isothermal")
ORIGINS = ("printed", *STUDY_SAMPLINGS)
REFINEMENT_PAIRS = ("M6", "M5"), ("M8", "M7"), ("M10", "M8")


def highlights(sources: Sources, items: Sequence[Item]) -> dict[str, Any]:
    """Summary of the verdict: results of the functions below by name.

    All but scores are None for a study that is not the paper's, or in which an experiment failed.
    """
    published = sources["published"]
    summary: dict[str, Any] = {"scores": scores(items)}
    whole = list(published.study.experiments) == EXPERIMENTS and not published.failures("datum")
    for part in (fit, wrong_row, transport, by_experiment):
        summary[part.__name__] = part(sources) if whole else None
    return summary


def scores(items: Sequence[Item]) -> dict[str, Any]:
    """Agreement with Tables 5, 7, 8 and 9: number of cells, deviations, cells that are exact or close."""
    cells = [item for item in items if isinstance(item["reproduced"], float)]
    result: dict[str, Any] = {}
    for table in (7, 9):
        errors = [item for item in cells if (item["place"], item["column"]) == (f"Table {table}", "mse")]
        logs = [math.log1p(item["relative"]) for item in errors if item["relative"] > -1]
        if logs:
            result[f"table_{table}_mse"] = {
                "cells": len(logs),
                "rms_of_ln_ratio": six_digits(math.sqrt(sum(log**2 for log in logs) / len(logs))),
                "lowest_ratio": six_digits(math.exp(min(logs))),
                "highest_ratio": six_digits(math.exp(max(logs))),
            }
    for table in (8, 5):
        agreements = [item["agreement"] for item in cells if item["place"] == f"Table {table}"]
        exact = agreements.count("exact")
        close = agreements.count("close")
        result[f"table_{table}"] = {"cells": len(agreements), "exact": exact, "exact_or_close": exact + close}
    return result


def fit(sources: Sources) -> dict[str, Any] | None:
    """Agreement of Tables 7, 8, 9, Figs 9, 11 against the spread over seeds; None without other seeds.

    `tables`: chi-square of each, as meant and as printed, with its degrees of freedom; `seeds`: place of the
    paper's seeds among all sets.
    """
    published: StudyResults = sources["published"]
    likelihood = published.likelihood
    if likelihood is None:
        return None
    names = {name: (table,) for table, name in TABLE_NAMES.items()} | {"all": TABLES}
    tables = [
        {"table": name}
        | {
            column: {
                "numbers": likelihood.degrees_of_freedom(tables, column),
                "chi_square": six_digits(float(likelihood.chi_square(published.numbers, tables, column))),
            }
            for column in ("meant", "printed")
        }
        for name, tables in names.items()
    ]
    seeds: dict[str, Any] = {"sets": len(likelihood.over_seeds)}
    for table in ("T7", "T9"):
        rms = likelihood.rms_of_ln_mse(likelihood.over_seeds, table)
        place, others = 1 + int(np.count_nonzero(rms[1:] < rms[0])), float(rms[1:].mean())
        seeds[table] = {"place": place, "rms": six_digits(float(rms[0])), "rms_of_others": six_digits(others)}
    return {"tables": tables, "seeds": seeds}


def wrong_row(sources: Sources) -> list[dict[str, Any]]:
    """Numbers of M7 and M8 at the typical level, printed and computed; the text quotes M8's for M7."""
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
    """Mean square errors of M5 to M10, and quotients of pairs: by level, printed and with each sampling."""
    rows: list[dict[str, Any]] = []
    for level, name in itertools.product(LEVELS, ORIGINS):
        mse = sources[name].statistics["mse"].sel(level=level)
        values = {model: float(mse.sel(model=model)) for model in list(PAPER_MODELS)[4:]}
        rounded = {model: six_digits(value) for model, value in values.items()}
        quotients = {
            f"{model}/{other}": six_digits(values[model] / values[other]) for model, other in REFINEMENT_PAIRS
        }
        rows.append({"level": level, "source": name, "mse": rounded, "quotients": quotients})
    return rows


def by_experiment(sources: Sources) -> dict[str, Any]:
    """MSE of M8 over M7's in each experiment, each at its best n, by sampling; and their geometric mean."""
    quotients: dict[str, Any] = {"experiments": EXPERIMENTS}
    for name in STUDY_SAMPLINGS:
        best: xr.DataArray = sources[name].cells["mse"].min("n").sel(experiment=EXPERIMENTS)
        ratio = (best.sel(model="M8") / best.sel(model="M7")).values.tolist()
        quotients[name] = list(map(six_digits, ratio))
        quotients[f"{name}_geometric_mean"] = six_digits(statistics.geometric_mean(ratio))
    return quotients
