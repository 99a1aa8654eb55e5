"""One cell of the grid as text for a terminal."""

import re
from pathlib import Path

from pneumo.errors import ResultError, shown
from pneumo.storage.files import read


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
