"""Write the checked study in SI units."""

from pathlib import Path

from pneumo.configuration.experiment import Study
from pneumo.configuration.study_json import to_json
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import write_json


def main(study: Study, parameters: Path) -> None:
    write_json(to_json(study), parameters)


run_job(main, globals())
