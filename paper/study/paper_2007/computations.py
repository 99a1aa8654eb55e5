"""The computations that ``paper/2007/claims.yaml`` names under ``compute``."""

import sys
from collections.abc import Sequence

import numpy as np

from paper.study import functions_returning
from paper.study.paper_2006 import equation_checks as equations
from paper.study.paper_2007 import simulated_example as example
from paper.study.paper_2007.results import Results
from paper.study.paper_2007.seven_steps import mean_pressure
from paper_verdict.findings import Computation, Finding

WALL = 2e-3  # m, ASSUME: thickness of a cylinder's wall
CONDUCTIVITY = {"stainless steel": 15.0, "steel": 50.0, "aluminium alloy": 160.0}  # W/(m K), textbooks
CYLINDERS = "ABC"


def allowed(results: Results, column: str, quantity: str) -> Finding:
    """Range of a cell of Tables 4 and 5 that the printed inputs allow."""
    low, high = results.allowed(column)[quantity]
    return Finding(low=low, high=high, allowed=True, shown=f"{low:.4g} to {high:.4g}")


def whole_column(results: Results, column: str) -> Finding:
    """Whether one set of inputs within their digits gives all cells of a column of Tables 4 and 5 at once."""
    dropped = results.left_over(column)
    return Finding(holds=not dropped, shown=f"all but {', '.join(dropped)}" if dropped else "all cells")


def error_of_method(results: Results) -> Finding:
    """Relative error of the method's lambda_0 against the simulated one."""
    area = results.step("A_q") / example.WALL_AREA
    of_k_0 = results.step("k_0") / (example.LAMBDA_0 * example.WALL_AREA)
    words = f"k_0 is {of_k_0 - 1:+.1%} off; the area alone {area - 1:+.1%}, the regression {of_k_0 - 1:+.1%}"
    return Finding(abs(results.step("lambda_0") / example.LAMBDA_0 - 1), shown=words)


def coefficient_falls(results: Results) -> Finding:
    """Whether lambda_0 falls from cylinder to cylinder as V_f / A_q grows, in both experiments."""
    by_experiment = [[f"{cylinder}{experiment}" for cylinder in CYLINDERS] for experiment in "12"]
    orders = []
    for columns in by_experiment:
        ordered = sorted(columns, key=lambda c: results.printed[c, "V_f_over_A_q"].value)
        orders.append([results.printed[c, "lambda_0"].value for c in ordered])
    words = "; ".join(" > ".join(f"{value:g}" for value in order) for order in orders)
    return Finding(holds=all(order == sorted(order, reverse=True) for order in orders), shown=words)


def experiments_agree(results: Results, cylinder: str, quantity: str) -> Finding:
    """Ratio of a quantity in a cylinder's second experiment to that in its first."""
    first, second = (results.printed[f"{cylinder}{experiment}", quantity].value for experiment in "12")
    return Finding(second / first, shown=f"{first:g} and {second:g}")


def _conductivities(results: Results) -> dict[str, float]:
    """Conductivity of the walls by cylinder, W/(m K)."""
    return {cylinder: CONDUCTIVITY[results.table_1[cylinder, "material"]] for cylinder in CYLINDERS}


def walls_resist_little(results: Results, at_most: float) -> Finding:
    """Whether each wall's thermal resistance is at most `at_most` of the resistance from air to wall."""
    fractions = {
        cylinder: max(results.printed[f"{cylinder}{e}", "lambda_0"].value for e in "12") * WALL / conductivity
        for cylinder, conductivity in _conductivities(results).items()
    }
    words = ", ".join(f"{cylinder} {fraction:.2%}" for cylinder, fraction in fractions.items())
    return Finding(holds=max(fractions.values()) <= at_most, shown=words)


def opposite_to_conductivity(results: Results) -> Finding:
    """Whether the cylinders' order by lambda_0 is the opposite of that by the conductivity of their walls."""
    conductivity = _conductivities(results)
    coefficient = {
        c: np.mean([results.printed[f"{c}{e}", "lambda_0"].value for e in "12"]) for c in conductivity
    }
    orders = [sorted(values, key=values.__getitem__) for values in (conductivity, coefficient)]
    return Finding(holds=orders[0] == orders[1][::-1], shown=" > ".join(orders[1][::-1]))


def room(results: Results, columns: Sequence[str]) -> Finding:
    """Range of the room temperatures that the printed mean temperatures imply, K."""
    rooms = {column: results.allowed(column)["T_amb"] for column in columns}
    words = ", ".join(f"{column} {low:.1f} to {high:.1f} K" for column, (low, high) in rooms.items())
    ends = np.array(list(rooms.values()))
    return Finding(low=float(ends.min()), high=float(ends.max()), allowed=True, shown=words)


def swept_within_stroke(results: Results, column: str) -> Finding:
    """Whether the piston ends a push nearer to the cover than it began, inside the stroke of Table 1."""
    S_f, S_i = (results.printed[column, name].value for name in ("S_f", "S_i"))
    stroke = 1e-3 * float(results.table_1[column[0], "stroke"])
    return Finding(holds=0 < S_f < S_i <= stroke, shown=f"{S_f:g} < {S_i:g} <= {stroke:g} m")


def sonic_factor(sign: int) -> float:
    """Sonic factor of eq (29), s K^0.5/m, with gamma + 1 (`sign` 1) or gamma - 1 (-1) beside R."""
    g = equations.GAMMA
    return (2 / (g + 1)) ** (1 / (g - 1)) * (2 * g / ((g + sign) * equations.R)) ** 0.5


COMPUTATIONS: dict[str, Computation] = functions_returning(Finding, sys.modules[__name__]) | {
    # A number of the simulated example; its peak pressure over the final one, less 1.
    "step": lambda results, quantity: Finding(results.step(quantity)),
    "peak": lambda results: Finding(float(results.example["P"][0]) / results.step("P_f") - 1),
    # Mean temperature of a regression over its settling time, with the mass and volume simulated, K.
    "true_temperature": lambda _, P_f, delta_P: Finding(mean_pressure(P_f, delta_P) * example.T_OVER_P),
    # Bore that Table 1 prints for the cylinder of a column of Tables 3 to 5, m.
    "bore_tested": lambda results, column: Finding(1e-3 * float(results.table_1[column[0], "bore"])),
    # Equations that both papers print; eq (2) has the factor T; the sonic factor of eq (29).
    "pressure_equation": equations.CONSTANTS["pressure_equation_keeps_energy"],
    "equilibrium_pressure": equations.CONSTANTS["equilibrium_pressure_as_printed"],
    "temperature_equation": lambda _: Finding(
        holds=equations.temperature_equation_fits(True), shown="20 states"
    ),
    "half_bridge_ratio": lambda _: Finding(equations.half_bridge_ratios(equations.R)[0]),
    "eq_29_as_printed": lambda _: Finding(**equations.as_in_eq_1(sonic_factor(-1))),
}
