"""Section 4's set-up: counts and ranges that follow from the paper's own numbers."""

from collections.abc import Callable

import numpy as np

from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import read_table, table7, table9
from paper.study.paper_2006.results import StudyResults
from paper_verdict.findings import Finding

WITH_N = [name for name, model in PAPER_MODELS.items() if model.has_n]
WITHOUT_N = [name for name in PAPER_MODELS if name not in WITH_N]
NAMES = ("mean_error", "std", "mse")


def number_of_runs(results: StudyResults) -> Finding:
    """Experiments times (models with n times values of n, plus models without)."""
    experiments, values = len(read_table(6)), len(results.study.n)
    with_n, others = len(WITH_N), len(WITHOUT_N)
    runs = experiments * (with_n * values + others)
    return Finding(runs, shown=f"{experiments} ({with_n} x {values} + {others})")


def rows_within(divisor_is_N: bool) -> tuple[int, int]:
    """Number of rows of Tables 7 and 9 that agree with eq (16), and number of all rows.

    mu^2 + sigma^2 = MSE + s^2/N with the sample variance s^2 of the N means, which lies between 0 and
    sigma^2; with N as divisor of the variance, mu^2 + sigma^2 = MSE.
    """
    overall, levels = table7(), table9()
    tables = [(overall, 16), *((levels.sel(level=level), 8) for level in levels["level"].values)]
    rows = [(table.sel(model=model), N) for table, N in tables for model in PAPER_MODELS]
    fits = 0
    for row, N in rows:
        mu, sigma, mse = (float(row[name]) for name in NAMES)
        d_mu, d_sigma, d_mse = (float(row[f"{name}_half_unit"]) for name in NAMES)
        low = max(abs(mu) - d_mu, 0) ** 2 + (sigma - d_sigma) ** 2 - (mse + d_mse)
        high = (abs(mu) + d_mu) ** 2 + (sigma + d_sigma) ** 2 - (mse - d_mse)
        fits += low <= (0 if divisor_is_N else (sigma + d_sigma) ** 2 / N) and high >= 0
    return fits, len(rows)


def rows_fit_eq_16(_: StudyResults) -> Finding:
    """Whether every row of Tables 7 and 9 agrees with eq (16)."""
    fits, rows = rows_within(divisor_is_N=False)
    other = rows_within(divisor_is_N=True)[0]
    return Finding(holds=fits == rows, shown=f"{fits} of {rows} rows fit with N - 1, {other} with N")


# Computations of one line: the grid of n, and the models with and without n.
COUNTS: dict[str, Callable[[StudyResults], Finding]] = {
    "step_of_n": lambda results: Finding(float(np.round(np.diff(results.study.n).mean(), 9))),
    "models_with_n": lambda _: Finding(len(WITH_N), shown=", ".join(WITH_N)),
}
