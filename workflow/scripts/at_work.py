"""Models at work: all plants in one file, with correlations, losses and answers."""

from pathlib import Path

from pneumo.evidence.at_work.at_work_statistics import at_work_statistics, joined
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read, read_study, write

DIGITS = 4


def main(parameters: Path, blocks: list[Path], cells: Path, code: str) -> None:
    study, parts = read_study(parameters), [read(block) for block in blocks]
    plants = joined(parts)
    about = attributes(
        "Models at work in observers and position controllers",
        "Errors of use and of replay by model, their rank correlation, the cheapest that will do",
        study.config_sha256,
        code,
        template_sha256=parts[0].attrs["template_sha256"],
        blocks_code_sha256=parts[0].attrs["code_sha256"],
    )
    write(plants.merge(at_work_statistics(plants)), cells, about, digits=DIGITS)


run_job(main, globals())
