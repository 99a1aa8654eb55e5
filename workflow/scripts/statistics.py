"""Average the cells over experiments, for each signal sampling."""

from pathlib import Path

from paper.study.averages import statistics
from paper.study.stored_runs import read_study
from pneumo.storage.files import attributes, open_grid, write
from workflow.jobs.wrapper import run_job


def main(parameters: Path, tables: list[Path]) -> None:
    study = read_study(parameters)
    for table in tables:
        transport = table.parent.name
        about = attributes(
            f"Performance of the reduced models, {transport} signals",
            "Tables 7 (level overall), 8 (best_n) and 9 (other levels); eqs (14) to (16)",
            study.config_sha256,
            transport=transport,
        )
        grid = open_grid(table.parent).sel(experiment=list(study.experiments))
        averages = statistics(grid, study.experiments_by_level, percentile_rule=study.percentile_rule)
        write(averages, table, about)


run_job(main, globals())
