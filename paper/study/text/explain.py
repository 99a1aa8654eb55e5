"""One item of the verdict, or one cell of the grid, as text for a terminal."""

import re
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from paper.verdict.claims import BASES
from pneumo.errors import ResultError, shown
from pneumo.storage.files import read

TEXT_WIDTH = 100
PROVED = {True: "true", False: "false", None: "open"}


def item_text(item: Mapping[str, Any], errata: Mapping[str, Any]) -> str:
    """Text of an item of `paper.verdict.judging.Judge.judge`: claim, reproduced value, status, reason.

    `errata` are those of ``verdict.json`` by name.
    """
    tolerance = item["tolerance"]
    sense = "" if tolerance["sense"] == "equal" else f", {tolerance['sense'].replace('_', ' ')}"
    seeds = f"; at most {tolerance['seeds']:g} of the deviation over seeds" if tolerance["seeds"] else ""
    scale = "" if item["scale"] in (1, 0.01) else f" x {item['scale']:g}"
    lines = [
        ("where", item["where"]),
        ("claim", item["statement"]),
        ("printed", f"{item['printed']}{scale} {item['unit']}".strip()),
        ("reproduced", item["shown"] or "nothing"),
        ("status", item["status"]),
        ("reason", item["reason"]),
        (
            "tolerance",
            f"class {tolerance['class']}{sense}: {tolerance['limit']:g}, {tolerance['measure']}{seeds}",
        ),
        ("basis", f"{item['basis']}: {BASES[item['basis']]}"),
        ("fact", item["fact"]),
        ("seeds", "" if item["seeds"] is None else f"{item['seeds']:+.2g} standard deviations over seeds"),
    ]
    for key, label in (("exact", "with exact signals"), ("printed", "by the paper's own tables")):
        if (stands := item[f"stands_{key}"]) is not None:
            value = f": {item[f'shown_{key}']}" if item[f"shown_{key}"] else ""
            lines.append((label, ("true" if stands else "not true") + value))
    for name in item["errata"]:
        erratum = errata[name]
        lines.append(("erratum", f"{name}: {erratum['printed']} -> {erratum['meant']}"))
        lines.append(("proof", f"{PROVED[erratum['passes']]}: {erratum['evidence']}"))
    evidence = item["evidence"]
    lines.append(("evidence", f"{evidence['path']}: {evidence['select']} ({evidence['compute']})"))
    wrapped = textwrap.TextWrapper(TEXT_WIDTH, subsequent_indent=" " * 28, break_long_words=False)
    filled = (wrapped.fill(f"  {label:26}{text}") for label, text in lines if text)
    return "\n".join([item["id"], *filled])


def cell_text(results: Path, experiment: str, model: str, n: float) -> str:
    """Errors of a model at one n in one experiment, for both samplings of the signals and both chambers.

    A file that is missing, or lacks the model or the n, raises `ResultError`.
    """
    if not re.fullmatch(r"[A-Za-z][\w-]{0,39}", experiment):
        raise ResultError(f"experiment = {shown(experiment)}: must be a name, such as E07")
    lines = []
    for transport in ("published", "exact"):
        file = results / transport / "replay" / f"{experiment}.nc"
        grid = read(file, "mean_error", "variance", "mse", "status", "failure_time")
        if model not in grid["model"]:
            models = ", ".join(grid["model"].values)
            raise ResultError(f"{file}: model = {shown(model)}: must be one of {models}")
        if n not in grid["n"]:
            raise ResultError(f"{file}: n = {n:g}: must be one of {', '.join(map(str, grid['n'].values))}")
        for chamber, values in grid.sel(model=model, n=n).groupby("chamber"):
            if status := values["status"].item():
                meaning = grid["status"].attrs["flag_meanings"].split()[status].replace("_", " ")
                errors = f"failed at t = {values['failure_time'].item():g} s: {meaning}"
            else:
                mse, mean = values["mse"].item(), values["mean_error"].item()
                sigma = values["variance"].item() ** 0.5
                errors = f"MSE {mse:.4g} Pa^2  mean {mean:.4g} Pa  sigma {sigma:.4g} Pa"
            lines.append(f"{experiment} {model} n = {n:g}  {transport:9}  chamber {chamber}:  {errors}")
        both = grid["mse"].sel(model=model).mean("chamber", skipna=False)
        if not both.isnull().all():
            lines.append(
                f"{experiment} {model} best n = {both.idxmin('n').item():g}  {transport:9}  both chambers:"
                f"  MSE {both.min().item():.4g} Pa^2, at n = {n:g} {both.sel(n=n).item():.4g} Pa^2"
            )
    return "\n".join(lines)
