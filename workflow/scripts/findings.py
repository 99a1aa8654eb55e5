"""Judge the statements about models over the ensemble, and say how much seeds change each number."""

import json
from pathlib import Path

from pneumo.evidence.seeds import findings as statements
from pneumo.evidence.seeds.seed_deviations import seed_deviations, seed_deviations_text
from pneumo.evidence.seeds.seed_sets import read_seed_sets
from pneumo.evidence.seeds.statement_sensitivity import dependences
from pneumo.jobs.wrapper import run_job
from pneumo.publish.text.markdown_tables import findings_table
from pneumo.simulation.signals import EXACT, PUBLISHED
from pneumo.storage.files import read_study, write_json, write_text
from pneumo.verdict.claims import read_claims


def main(
    parameters: Path, errors: Path, claims: Path, findings: Path, table: Path, deviations: Path, code: str
) -> None:
    study, entries = read_study(parameters), read_claims(claims.parent)
    ensemble = read_seed_sets(errors)
    sources = statements.over_seeds(study, ensemble)
    turned = dependences(study, ensemble.sel(transport=EXACT).drop_attrs(), entries, print)
    judged = statements.findings(study, sources, entries, findings.parent, turned) | {"code_sha256": code}
    write_json(json.dumps(judged, indent=1, ensure_ascii=False), findings)
    write_text(findings_table(judged), table)
    write_text(seed_deviations_text(seed_deviations(entries, sources[PUBLISHED])), deviations)


run_job(main, globals())
