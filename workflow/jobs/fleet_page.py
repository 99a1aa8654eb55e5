"""Index page of a fleet: one self-contained HTML file with a table of its cylinders to sort and filter."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from markupsafe import Markup

from paper.study.model_looks import colours
from pneumo.physics.models import MODELS
from pneumo.publish.pages.page import page_text
from pneumo.publish.text.formatting import KILO, no_exponent, percent_text
from pneumo.selection.error_budget import FULL_ORDER
from pneumo.selection.ranking import MATERIAL
from workflow.jobs.fleet import DRAWS

TEMPLATES = Path(__file__).parent / "templates"
DIGITS = 4  # of numbers in the table
HEADS = ("cylinder", "bore (mm)", "stroke (mm)", "k₀ (W/K)", "recommended", "n", "expected RMS (kPa)")
HEADS += ("as good", "best reduced", "its expected RMS (kPa)", "runs", "failed runs")
TEXTS = ("cylinder", "recommended", "as good", "best reduced")  # columns without numbers


def fleet_rows(index: xr.Dataset) -> list[tuple[Any, ...]]:
    """Rows of the table, in the order of `HEADS`, from `workflow.jobs.fleet.fleet_index`.

    Lengths in mm, errors in kPa; None where there is no number, as where k_0 differs between experiments.
    """
    models = index["model"].values.tolist()
    columns = {str(name): index[name].values for name in index.variables}
    rows: list[tuple[Any, ...]] = []
    for i, name in enumerate(columns["cylinder"].tolist()):
        lengths = [_number(columns[key][i] * KILO) for key in ("bore", "stroke")]
        k_0, *others = columns["k_0"][i].tolist()
        recommended, results = str(columns["recommended"][i]), ["", None, None, "", "", None]
        if recommended:
            n = dict(zip(models, columns["expected_n"][i], strict=True)) | {FULL_ORDER: np.nan}
            worst = dict(zip(models, columns["expected_rms"][i], strict=True))
            best = min(models, key=lambda model: worst[model])
            worst[FULL_ORDER] = columns["expected_rms_of_full_order"][i]
            chosen = [recommended, _number(n[recommended]), _number(worst[recommended] / KILO)]
            results = [*chosen, str(columns["as_good"][i]), best, _number(worst[best] / KILO)]
        counts = [int(columns[key][i]) for key in ("runs", "failed_runs")]
        one_k_0 = _number(k_0 if all(other == k_0 for other in others) else np.nan)
        rows.append((name, *lengths, one_k_0, *results, *counts))
    return rows


def regrets(index: xr.Dataset) -> list[tuple[str, ...]]:
    """Cost of one model for the whole fleet: on each cylinder, its expected RMS error over the lowest one.

    A row for each model, full order included, that ran on every cylinder: name, median, limit of nine
    cylinders in ten, largest value and its cylinder, and the number of cylinders on which the mean square
    error is within 10 % of the lowest. The lowest limit comes first.
    """
    full_order = index["expected_rms_of_full_order"].expand_dims(model=[FULL_ORDER])
    worst = xr.concat([index["expected_rms"], full_order], "model").transpose("cylinder", "model")
    worst = worst.isel(cylinder=np.isfinite(worst.values).any(axis=1))
    if not worst.sizes["cylinder"]:
        return []
    over: Any = (worst / worst.min("model")).to_pandas().replace(np.inf, np.nan).dropna(axis="columns")
    rows: list[tuple[str, ...]] = []
    for model in over.quantile(0.9).sort_values(kind="stable").index:
        ratio = over[model]
        sizes = (no_exponent(value) for value in (*ratio.quantile([0.5, 0.9]), ratio.max()))
        rows.append((model, *sizes, str(ratio.idxmax()), str((ratio**2 <= 1 + MATERIAL).sum())))
    return rows


def _number(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None


def fleet_page(name: str, index: xr.Dataset) -> str:
    """Write the page of a fleet, style, script and data inside; the same index gives the same text."""
    rows = fleet_rows(index)
    chosen, best = ([row[HEADS.index(head)] for row in rows] for head in ("recommended", "best reduced"))
    counts = [(model, chosen.count(model), best.count(model)) for model in (*MODELS, FULL_ORDER)]
    data = json.dumps(rows, separators=(",", ":"), allow_nan=False, ensure_ascii=False).replace(
        "<", "\\u003c"
    )
    return page_text(
        "fleet.html.j2",
        TEMPLATES,
        name=name,
        heads=HEADS,
        texts=TEXTS,
        counts=[count for count in counts if any(count[1:])],
        without=chosen.count(""),
        full_order=FULL_ORDER,
        draws=DRAWS,
        total=len(rows),
        material=percent_text(MATERIAL),
        regrets=regrets(index),
        colours=Markup(json.dumps(colours())),  # names of models and colours
        data=Markup(data),  # JSON whose "<" are escaped
        config=index.attrs["config_sha256"],
    )
