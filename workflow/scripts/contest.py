"""The full order in the contest: every run, and the tables of the half held out."""

from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.contest_statistics import answer, contest_statistics
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read, write

TWO_DIGITS: dict[str, int] = {"mse_with_k_0": 2, "mse_without_k_0": 2, "mse_simulated": 2}  # most of the file


def main(blocks: list[Path], paper: Path, rule: Path, compared: int, cells: Path, code: str) -> None:
    runs: xr.Dataset = xr.concat([read(block) for block in blocks], "cylinder").sortby("cylinder")
    runs["held_out"] = ("cylinder", (runs["cylinder"].values >= compared).astype(np.int8))
    direct = read(rule)
    below, above = direct["rule_model"].values.tolist()
    statistics = contest_statistics(runs, read(paper), direct["rule_threshold"].item(), (below, above))
    about = attributes(
        "The full order in the contest with the reduced models",
        f"Errors of every row by what it is told beforehand; {answer(statistics)}",
        "none: cylinders are drawn in pneumo.evidence.random_cylinders.random_plants",
        code,
    )
    write(runs.merge(statistics, compat="no_conflicts"), cells, about, digits=3, digits_of=TWO_DIGITS)


run_job(main, globals())
