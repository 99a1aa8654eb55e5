"""Split every cell's error into the model's, that of signal sampling and the step's."""

from pathlib import Path

from pneumo.evidence.experiments_side_by_side import for_each_experiment, side_by_side
from pneumo.evidence.signal_sampling import error_budget
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, budgets: Path, threads: int, code: str) -> None:
    study = read_study(parameters)
    parts = for_each_experiment(
        study.experiments, lambda e: error_budget.budget(e, study.n), threads, "error budget"
    )
    cells = side_by_side(parts)
    about = attributes(
        "Error budget of the reduced models",
        "Model, signal-sampling and discretisation error of every cell, from t = 0",
        study.config_sha256,
        code,
        slice_s=error_budget.SLICE,
        reference_slice_s=error_budget.REFERENCE_SLICE,
    )
    by_level = error_budget.budget_by_level(cells, study.experiments_by_level)
    write(error_budget.with_budget_attributes(cells.merge(by_level)), budgets, about)


run_job(main, globals())
