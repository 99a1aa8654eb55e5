"""Tables with their spread over sets of seeds, and which model beats which."""

from pathlib import Path

from pneumo.evidence.seeds.ensemble import ensemble_statistics
from pneumo.evidence.seeds.seed_sets import read_seed_sets
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, errors: Path, tables: Path, code: str) -> None:
    study = read_study(parameters)
    ensemble = read_seed_sets(errors)
    about = attributes(
        "Ensemble of the study over sets of seeds",
        "Tables 7 to 9 with their spread over sets of seeds; models compared",
        study.config_sha256,
        code,
        seed_sets=ensemble.sizes["seeds"],
    )
    write(ensemble_statistics(ensemble, study.experiments_by_level), tables, about, digits=6)


run_job(main, globals())
