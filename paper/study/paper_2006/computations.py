"""The computations that ``paper/2006/claims.yaml`` names under ``compute``."""

from paper.study import functions_returning
from paper.study.paper_2006 import (
    equation_checks,
    model_statements,
    run_statements,
    setup_checks,
    table_cells,
)
from paper_verdict.findings import Computation, Finding

COMPUTATIONS: dict[str, Computation] = functions_returning(
    Finding, table_cells, equation_checks, setup_checks, model_statements, run_statements
) | {**equation_checks.CONSTANTS, **setup_checks.COUNTS}
