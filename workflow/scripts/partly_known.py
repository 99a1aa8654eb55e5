"""Models at work on plants that are known in part: all plants in one file, with ratios."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.at_work.partly_known_statistics import partly_known_statistics
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read, read_study, write

DIGITS = 4


def main(parameters: Path, blocks: list[Path], cells: Path, code: str) -> None:
    study, parts = read_study(parameters), [read(block) for block in blocks]
    plain = [part.drop_attrs(deep=False) for part in parts]
    plants: xr.Dataset = xr.concat(plain, xr.Variable("plant", [block.stem for block in blocks]))
    about = attributes(
        "Models at work in observers and controllers on plants that are known in part",
        "Errors of the full order and of k_0 as a state against the reduced models",
        study.config_sha256,
        code,
        template_sha256=parts[0].attrs["template_sha256"],
        blocks_code_sha256=parts[0].attrs["code_sha256"],
    )
    write(plants.merge(partly_known_statistics(plants)), cells, about, digits=DIGITS)


run_job(main, globals())
