"""Every model on measured air with flow."""

from functools import partial
from pathlib import Path

from paper.study.measured_air import measured_air
from pneumo.storage.files import attributes, write
from workflow.jobs.wrapper import run_job


def main(records: list[Path], cells: Path) -> None:
    about = attributes(
        "Models on measured air with flow",
        "Each model fitted to a valve-driven cylinder and to vessels, and judged on points left out",
        "none: records are in data/",
        license="MIT; the records it was made from: MIT, jefersonjlima/wbident and"
        " andr1976/HydDown; Apache-2.0, osrf/mbari_wec_gz",
    )
    write(measured_air(records[0].parents[1], partial(print, flush=True)), cells, about, digits=4)


run_job(main, globals())
