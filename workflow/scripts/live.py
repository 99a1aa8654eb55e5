"""Write the page of a cylinder that moves in the browser."""

from pathlib import Path

from pneumo.configuration.experiment import Study
from pneumo.export.live import live_page, typical_plants
from pneumo.jobs.wrapper import run_job
from pneumo.publish.model_looks import colours
from pneumo.storage.files import write_text


def main(study: Study, sources: list[Path], n: float, page: Path) -> None:
    write_text(live_page(typical_plants(study), n, sources[0].parent, colours()), page)


run_job(main, globals())
