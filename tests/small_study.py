"""A study of a second for the examples: every file of `make reproduce` that they open, in a few seconds."""

import os
import runpy
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from pneumo.configuration.parameters import load, study
from pneumo.simulation.signals import STUDY_SAMPLINGS

ROOT = Path(__file__).parents[1]
EXPERIMENTS = ("E06", "E12")


def script(name: str) -> Any:
    """Work of a script of the workflow as a function."""
    return runpy.run_path(str(ROOT / "workflow/scripts" / f"{name}.py"))["main"]


def small_study(results: Path, override: Path) -> None:
    """Fill a folder of results.

    Parameters
    ----------
    results : pathlib.Path
    override : pathlib.Path
        Where to write the configuration that shortens the paper's.
    """
    names = ", ".join(EXPERIMENTS)
    override.write_text(f"name: small\nrun: {{experiments: [{names}], duration_limit_s: 1.0}}\n")
    parameters = results / "parameters.json"
    small = study(load(ROOT / "config/paper.yaml", override))

    def each(folder: str) -> list[Path]:
        return [results / folder / f"{name}.nc" for name in EXPERIMENTS]

    with Path(os.devnull).open("w") as nowhere, redirect_stdout(nowhere):
        script("settling")(small, each("settling"), results / "settling.nc")
        script("datum")(small, parameters, each("datum"), 1)
        replays = [file for sampling in STUDY_SAMPLINGS for file in each(f"{sampling}/replay")]
        script("replay")(parameters, each("datum"), replays, 2)
        statistics = [results / sampling / "statistics.nc" for sampling in STUDY_SAMPLINGS]
        script("statistics")(parameters, statistics)
        script("simulated_example")(results / "2007/example.nc")
        verdict = results / "verdict.json"
        script("verdict")("2006", ROOT / "paper/2006/claims.yaml", {}, verdict, verdict.with_suffix(".html"))
