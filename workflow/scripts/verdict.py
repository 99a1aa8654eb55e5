"""Judge every published number and claim."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.storage.files import write_json
from pneumo.verdict.court import verdict


def main(results: Path, paper: Path, output: str) -> None:
    found = verdict(results, paper)
    write_json(json.dumps(found, ensure_ascii=False, indent=1, allow_nan=False) + "\n", output)


if job := globals().get("snakemake"):
    with logged(job):
        main(Path(job.input.parameters).parent, Path(job.input.claims).parent, job.output[0])
