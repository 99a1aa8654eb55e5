"""Write the page to explore the study with."""

import json
from collections.abc import Sequence
from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.jobs.wrapper import logged
from pneumo.publish.pages.report_page import part, render, stride
from pneumo.storage.files import read, read_json, write_text


def main(
    parameters: str,
    statistics: Sequence[str],
    output: str,
    verdict: str | None = None,
    findings: str | None = None,
    manuscript: bool = False,
) -> None:
    study = from_json(read_json(parameters))
    folders = {Path(file).parent.name: Path(file).parent for file in statistics}
    best_n = {name: read(path / "statistics.nc", "best_n")["best_n"] for name, path in folders.items()}
    every = stride(study)
    parts = []
    for name, experiment in study.experiments.items():
        datum = read(Path(parameters).with_name("datum") / f"{name}.nc", "P", "status", "failure_time")
        replays = {
            transport: read(path / "replay" / f"{name}.nc", "mse", "status", "pressure")
            for transport, path in folders.items()
        }
        best = {transport: found.sel(experiment=name) for transport, found in best_n.items()}
        parts.append(part(experiment, datum, replays, best, every))
    judged, found = (json.loads(read_json(file)) if file else None for file in (verdict, findings))
    write_text(render(study, parts, judged, found, manuscript), output)


if job := globals().get("snakemake"):
    with logged(job):
        files, there = job.input, job.params
        verdict = next(iter(files.verdict), None)
        findings = next(iter(there.findings), None)
        main(files.parameters, files.statistics, job.output[0], verdict, findings, there.manuscript)
