"""Judge the statements about models over the ensemble: findings.json and the table that the README shows."""

import json
from pathlib import Path

import xarray as xr

from pneumo.evidence.findings import findings as judged_statements
from pneumo.jobs.wrapper import run_job
from pneumo.publish.text.markdown_tables import findings_table
from pneumo.storage.files import read, read_study, write_json, write_text
from pneumo.verdict.claims import read_claims


def main(parameters: Path, blocks: list[Path], claims: Path, findings: Path, table: Path) -> None:
    study = read_study(parameters)
    ensemble = xr.concat([read(block, "mean_error", "mse", "failure_time") for block in blocks], "seeds")
    judged = judged_statements(study, ensemble, read_claims(claims.parent), findings.parent)
    write_json(json.dumps(judged, indent=1, ensure_ascii=False), findings)
    write_text(findings_table(judged), table)


run_job(main, globals())
