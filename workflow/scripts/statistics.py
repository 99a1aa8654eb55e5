"""Average the cells over experiments, for each transport."""

from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.jobs.wrapper import logged
from pneumo.statistics.averages import statistics
from pneumo.storage.files import open_grid, read_json, write


def main(parameters: str, outputs: list[str], code: str) -> None:
    study = from_json(read_json(parameters))
    for output in outputs:
        transport = Path(output).parent
        grid = open_grid(transport).sel(experiment=list(study.experiments))
        attributes = {
            "title": f"Performance of the reduced models, {transport.name} transport",
            "summary": "Tables 7 (level overall), 8 (best_n) and 9 (other levels); eqs (14) to (16)",
            "transport": transport.name,
            "config_sha256": study.config_sha256,
            "code_sha256": code,
        }
        write(statistics(grid, study.experiments_by_level), output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.parameters, list(job.output), job.params.code)
