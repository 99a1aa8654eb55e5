"""Proofs of the errata of 2007: whether the printed form fails and the meant one holds, with the numbers.

They use the paper's own numbers and formulas. ``paper/2007/errata.yaml`` names them.
"""

from pathlib import Path

from paper.study.paper_2006 import equation_checks as equations
from paper.study.paper_2006 import erratum_proofs as of_2006
from paper.study.paper_2007 import simulated_example as example
from paper.study.paper_2007.computations import sonic_factor
from paper.study.paper_2007.printed_tables import COLUMNS, PAPER_FOLDER
from paper.study.paper_2007.results import Results
from paper_verdict.errata import Proof
from paper_verdict.files import half_unit

PRINTED = {"lambda_av": 16.07, "P_av": 2.023e5, "T_av": 310.42, "lambda_0": 26.16}  # simulated example


def eq29_gamma() -> tuple[bool, str]:
    """The printed factor is not the 0.0404 of the valve's equation, that with gamma + 1 is."""
    printed, meant = sonic_factor(-1), sonic_factor(1)
    words = f"{printed:.4f} as printed, {meant:.4f} with γ+1"
    return abs(printed - equations.SONIC) > half_unit("0.0404") >= abs(meant - equations.SONIC), words


def room_temperature() -> tuple[bool, str]:
    """Every column implies a room temperature above 293.5 K, and no single one lies in all ranges."""
    results = Results(Path(), PAPER_FOLDER)
    rooms = {column: results.allowed(column)["T_amb"] for column in COLUMNS}
    above = all(low > 293.5 for low, _ in rooms.values())
    no_single_one = max(low for low, _ in rooms.values()) > min(high for _, high in rooms.values())
    return above and no_single_one, ", ".join(
        f"{c} {low:.1f} to {high:.1f} K" for c, (low, high) in rooms.items()
    )


def lambda_0_example() -> tuple[bool, str]:
    """Whether step 7 of the method misses the printed lambda_0, for all values that round to its inputs."""

    def coefficient(sign: int) -> float:
        means = [PRINTED["P_av"] - sign * 50.0, PRINTED["T_av"] - sign * 0.005]
        return (PRINTED["lambda_av"] + sign * 0.005) * (
            example.P_0 * example.T_0 / (means[0] * means[1])
        ) ** 0.5

    low, high = coefficient(-1), coefficient(1)
    printed = PRINTED["lambda_0"]
    words = (
        f"{low:.2f} to {high:.2f} from the printed means, {1 - high / 26.5:.1%} to {1 - low / 26.5:.1%} off"
    )
    return high < printed - half_unit("26.16"), words


def errors_cancel() -> tuple[bool, str]:
    """The printed k_0 is 7 % above the simulated one, and the printed A_q 8 %."""
    simulated = example.LAMBDA_0 * example.WALL_AREA
    area = 4.08e-3 / example.WALL_AREA - 1
    k_0 = 0.107 / simulated - 1
    words = f"k_0 0.107 against {simulated:.4f} W/K: {k_0:+.1%}; A_q 4.08e-3 against"
    words += f" {example.WALL_AREA:.3e} m²: {area:+.1%}"
    return k_0 > 0.06 and area > 0.08, words


PROOFS: dict[str, Proof] = {
    function.__name__: function
    for function in (eq29_gamma, of_2006.P_0_ratio, room_temperature, lambda_0_example, errors_cancel)
}
