"""The computations that ``paper/2006/claims.yaml`` names under ``compute``."""

from pneumo.papers.paper_2006 import equation_checks as equations
from pneumo.papers.paper_2006 import model_statements as models
from pneumo.papers.paper_2006 import run_statements as runs
from pneumo.papers.paper_2006 import setup_checks as setup
from pneumo.papers.paper_2006 import table_cells as cells
from pneumo.papers.paper_2006.results import StudyResults
from pneumo.verdict.claims import Claim
from pneumo.verdict.sources import Computation, Finding

# fmt: off
COMPUTATIONS: dict[str, Computation] = {function.__name__: function for function in (
    cells.feature, cells.geometry, cells.heat_transfer_coefficient, cells.settling_time,
    cells.ten_settling_times, cells.statistic, cells.percentile, cells.best_index,
    cells.constant_index,
    equations.critical_pressure_ratio, equations.coefficient_of_sonic_flow, equations.branches_meet,
    equations.areas_as_printed, equations.equilibrium_pressure_as_printed, equations.half_bridge_ratio,
    equations.three_ranges_from, equations.root_in_range, equations.eq_17_as_printed, equations.largest_flow,
    equations.units_as_printed, equations.pressure_equation_keeps_energy,
    equations.temperature_equation_as_printed, equations.wall_heat_as_printed,
    equations.gas_law_differentiated, equations.polytropic_pressure_equation, equations.wall_laws_agree,
    equations.same_right_hand_side,
    setup.excitation_bandwidth, setup.conductances_enclose, setup.step_of_n, setup.number_of_n,
    setup.models_with_n, setup.models_without_n, setup.number_of_runs, setup.simplest, setup.rows_fit_eq_16,
    models.quotient, models.gap, models.smallest_gap, models.spread, models.gain, models.best_models,
    models.next_best, models.in_order, models.same_order, models.walls_before_mixing,
    models.simplest_of_the_best, models.best_n_varies, models.no_single_best, models.same_cells,
    runs.swing, runs.number_of_states, runs.air_is_kept, runs.piston_stays_off_the_ends,
    runs.number_of_experiments, runs.release_time, runs.value_after_release, runs.extremum,
)}
# fmt: on


def finding_for(claim: Claim, results: StudyResults) -> Finding:
    """Number, range or answer that the computation of a claim finds in some results."""
    return COMPUTATIONS[claim.compute](results, **claim.arguments)
