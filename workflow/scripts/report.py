"""Write the page to explore the study with."""

import json
from collections.abc import Mapping
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.publish.pages.report_page import page_stride, part, report_page
from pneumo.storage.files import read, read_json, read_study, write_text
from pneumo.storage.kept_evidence import made


def main(
    parameters: Path,
    statistics: list[Path],
    verdict: list[Path],
    findings: Mapping[str, str],
    findings_code: str,
    manuscript: bool,
    page: Path,
) -> None:
    """Write the page; of verdict and findings, which map files to hashes, there is one file or none."""
    study = read_study(parameters)
    folders = {file.parent.name: file.parent for file in statistics}
    best_n = {name: read(path / "statistics.nc", "best_n")["best_n"] for name, path in folders.items()}
    every = page_stride(study)
    parts = []
    for name, experiment in study.experiments.items():
        datum = read(parameters.with_name("datum") / f"{name}.nc", "P", "status", "failure_time")
        replays = {
            transport: read(path / "replay" / f"{name}.nc", "mse", "status", "pressure")
            for transport, path in folders.items()
        }
        best = {transport: of_all.sel(experiment=name) for transport, of_all in best_n.items()}
        parts.append(part(experiment, datum, replays, best, every))
    first = (next(iter(files), None) for files in (verdict, findings))
    judged, stated = (json.loads(read_json(file)) if file else None for file in first)
    if stated:
        stated["note"] += f" {made(Path(next(iter(findings))), findings_code)}."
    write_text(report_page(study, parts, judged, stated, manuscript), page)


run_job(main, globals())
