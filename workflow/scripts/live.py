"""Write the page of a cylinder that moves in the browser."""

from pathlib import Path

from pneumo.export.live import live_page
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import read_study, write_text


def main(parameters: Path, sources: list[Path], n: float, page: Path) -> None:
    """Write the page of the first experiment's plant."""
    plant = next(iter(read_study(parameters).experiments.values())).plant
    write_text(live_page(plant, n, sources[0].parent), page)


run_job(main, globals())
