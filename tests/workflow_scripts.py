"""Scripts of the workflow, called from tests without Snakemake."""

import runpy
from collections.abc import Callable
from pathlib import Path

SCRIPTS = Path(__file__).parents[1] / "workflow/scripts"


def script(name: str) -> Callable[..., None]:
    """Return the main function of a script of the workflow."""
    return runpy.run_path(str(SCRIPTS / f"{name}.py"))["main"]
