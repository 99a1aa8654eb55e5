"""One item of the verdict, or one cell of the grid, as text for a terminal."""

import re
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pneumo.errors import ResultError, shown
from pneumo.storage.files import read

WIDTH = 100


def item_text(item: Mapping[str, Any], errata: Mapping[str, Any], recorded: str | None) -> str:
    """Return what was claimed, found and concluded.

    Parameters
    ----------
    item : mapping
        From `pneumo.verdict.judging.Judge.judge`.
    errata : mapping
        Errata by name, with ``printed``, ``meant``, ``passes`` and ``evidence``.
    recorded : str or None
        Status recorded for the item.
    """
    tolerance = item["tolerance"]
    sense = {"equal": "", "at_most": ", at most", "at_least": ", at least"}[tolerance["sense"]]
    status = item["status"] + ("" if recorded in (None, item["status"]) else f" (recorded: {recorded})")
    lines = [("where", item["where"]), ("claim", item["statement"])]
    scale = "" if item["scale"] in (1, 0.01) else f" x {item['scale']:g}"
    lines += [
        ("printed", f"{item['printed']}{scale} {item['unit']}".strip()),
        ("reproduced", item["shown"] or "nothing"),
        ("status", status),
        ("reason", item["reason"]),
        ("tolerance", f"class {tolerance['class']}{sense}: {tolerance['limit']:g}, {tolerance['measure']}"),
        ("kind", item["kind"]),
    ]
    for key, label in (("exact", "with exact transport"), ("printed", "on the paper's own tables")):
        stands = item[f"stands_{key}"]
        if stands is not None:
            value = item[f"shown_{key}"]
            lines.append(
                (label, f"{'stands' if stands else 'does not stand'}{': ' + value if value else ''}")
            )
    if item["used_in_identification"]:
        lines.append(("note", "constants that the paper leaves open were found from this table"))
    if item["erratum"]:
        erratum = errata[item["erratum"]]
        proof = "true" if erratum["passes"] else "false"
        lines.append(("erratum", f"{item['erratum']}: {erratum['printed']} -> {erratum['meant']}"))
        lines.append(("proof", f"{proof}: {erratum['evidence']}"))
    if item["assumption"]:
        lines.append(("assumption", item["assumption"]))
    evidence = item["evidence"]
    lines.append(("evidence", f"{evidence['path']}: {evidence['select']} ({evidence['compute']})"))
    return "\n".join([item["id"], *(_line(label, text) for label, text in lines if text)])


def _line(label: str, text: str) -> str:
    indent = " " * 28
    return textwrap.fill(f"  {label:26}{text}", WIDTH, subsequent_indent=indent, break_long_words=False)


def cell_text(results: Path, experiment: str, model: str, n: float) -> str:
    """Return the errors of a model at one n in one experiment, for both transports and chambers.

    Parameters
    ----------
    results : pathlib.Path
        Folder of results.
    experiment, model : str
        Such as E07 and M8.
    n : float
        Polytropic index of the grid.

    Raises
    ------
    ResultError
        If the file is missing, or holds no such model or n.
    """
    if not re.fullmatch(r"[A-Za-z][\w-]{0,39}", experiment):
        raise ResultError(f"experiment = {shown(experiment)}: must be a name, such as E07")
    lines = []
    for transport in ("published", "exact"):
        file = results / transport / "replay" / f"{experiment}.nc"
        grid = read(file, "mean_error", "variance", "mse", "status", "failure_time")
        if model not in grid["model"]:
            there = ", ".join(grid["model"].values)
            raise ResultError(f"{file}: model = {shown(model)}: must be one of {there}")
        if n not in grid["n"]:
            raise ResultError(f"{file}: n = {n:g}: must be one of {', '.join(map(str, grid['n'].values))}")
        for chamber, values in grid.sel(model=model, n=n).groupby("chamber"):
            if values["status"].item():
                meaning = grid["status"].attrs["flag_meanings"].split()[values["status"].item()]
                lines.append(
                    f"{experiment} {model} n = {n:g}  {transport:9}  chamber {chamber}:"
                    f"  failed at t = {values['failure_time'].item():g} s: {meaning.replace('_', ' ')}"
                )
                continue
            lines.append(
                f"{experiment} {model} n = {n:g}  {transport:9}  chamber {chamber}:"
                f"  MSE {values['mse'].item():.4g} Pa^2  mean {values['mean_error'].item():.4g} Pa"
                f"  sigma {values['variance'].item() ** 0.5:.4g} Pa"
            )
        mse = grid["mse"].sel(model=model).mean("chamber", skipna=False)
        if mse.isnull().all():
            continue
        lines.append(
            f"{experiment} {model} best n = {mse.idxmin('n').item():g}  {transport:9}  both chambers:"
            f"  MSE {mse.min().item():.4g} Pa^2, at n = {n:g} {mse.sel(n=n).item():.4g} Pa^2"
        )
    return "\n".join(lines)
