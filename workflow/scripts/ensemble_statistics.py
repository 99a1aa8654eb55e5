"""Tables with their spread over sets of seeds, and which model beats which."""

import xarray as xr

from pneumo.configuration.exchange import from_json
from pneumo.evidence.ensemble import analysed
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import read, read_json, write


def main(parameters: str, blocks: list[str], output: str, code: str) -> None:
    study = from_json(read_json(parameters))
    parts: list[xr.Dataset] = [read(block) for block in blocks]
    ensemble: xr.Dataset = xr.concat(parts, "seeds")
    attributes = {
        "title": "Ensemble of the study over sets of seeds",
        "summary": "Tables 7 to 9 with their spread over sets of seeds; models compared",
        "seed_sets": ensemble.sizes["seeds"],
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    write(analysed(ensemble, study.experiments_by_level), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.parameters, list(job.input.blocks), job.output[0], job.params.code)
