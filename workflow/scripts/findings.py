"""Judge the statements about models over the ensemble: findings.json and the table that the README shows."""

import json
from pathlib import Path

import xarray as xr

from pneumo.configuration.exchange import from_json
from pneumo.evidence.findings import findings
from pneumo.jobs.wrapper import logged
from pneumo.publish.text import markdown_tables as tables
from pneumo.storage.files import read, read_json, write_json, write_text
from pneumo.verdict.claims import read_claims


def main(parameters: str, blocks: list[str], paper: Path, output: str, table: str) -> None:
    study = from_json(read_json(parameters))
    ensemble = xr.concat([read(block, "mean_error", "mse", "failure_time") for block in blocks], "seeds")
    found = findings(study, ensemble, read_claims(paper), Path(output).parent)
    write_json(json.dumps(found, indent=1, ensure_ascii=False), output)
    write_text(tables.findings(found), table)


if job := globals().get("snakemake"):
    with logged(job):
        files, made = job.input, job.output
        main(files.parameters, list(files.blocks), Path(files.claims).parent, made.findings, made.table)
