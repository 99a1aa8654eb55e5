"""Results that the claims of 2007 are compared with: the simulated example, and ranges of printed inputs."""

import itertools
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import minimize

from paper.study.paper_2007.printed_tables import PrintedNumber, table1, tables_2_to_5
from paper.study.paper_2007.seven_steps import mean_pressure, seven_steps
from paper.study.paper_2007.simulated_example import P_0, T_0, R
from pneumo.storage.files import read

INPUTS = ("P_i", "S_i", "S_f", "P_f", "delta_P", "tau", "T_av")  # of Tables 2 to 4
C_V = (717.0, 718.0)  # J/(kg K): R / (gamma - 1) and textbooks; not printed
MET = 1e-6  # of a half unit: what the search leaves; A2 is nearest to the limit, 5e-4 below
MOST_DROPPED = 1  # cells that `left_over` tries to leave out
CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=len(INPUTS) + 1)))
QUANTITIES = ("m", "A_q", "V_d", "k_av", "P_av", "lambda_av", "lambda_0", "k_0", "V_f", "V_f_over_A_q")


class Results:
    """The simulated example in a folder of results, and the printed tables in the paper's folder."""

    def __init__(self, folder: Path, paper: Path) -> None:
        self.folder, self.paper = folder, paper

    @cached_property
    def example(self) -> xr.Dataset:
        """Response and steps of the simulated example."""
        return read(self.folder / "example.nc")

    @cached_property
    def printed(self) -> dict[tuple[str, str], PrintedNumber]:
        """Numbers of Tables 2 to 5 by column and quantity."""
        return tables_2_to_5(self.paper)

    @cached_property
    def table_1(self) -> dict[tuple[str, str], str]:
        """Table 1 by cylinder and quantity, as printed."""
        return table1(self.paper)

    def step(self, name: str) -> float:
        """One number of the simulated example in the reading that is taken."""
        return float(self.example[name][self.example.attrs["taken"]])

    def follows(self, column: str, moved: np.ndarray) -> dict[str, Any]:
        """Tables 4 and 5, SI units, computed from one column of Tables 2 and 3 with changed inputs.

        `moved`, shape (input, ...), is the change of each input in half units of its last printed digit;
        its last row is c_v, where -1 and 1 are the ends of `C_V`. Results have the shape (...); among them
        is ``T_amb``, K, the room temperature that follows from the printed T_av.
        """
        given = [self.printed[column, name] for name in INPUTS]
        values = [number.value + number.half * u for number, u in zip(given, moved, strict=False)]
        P_i, S_i, S_f, P_f, delta_P, tau, T_av = values
        bore = self.printed[column, "phi_1"].value
        piston = np.pi / 4 * bore**2
        T_amb = T_av * P_f / mean_pressure(P_f, delta_P)
        c_v = np.mean(C_V) + np.ptp(C_V) / 2 * moved[-1]
        gas = {"T_amb": T_amb, "c_v": c_v, "R": R, "P_0": P_0, "T_0": T_0}
        steps = seven_steps(P_i, piston * S_i, piston * S_f, (P_f, delta_P, tau), bore=bore, **gas)
        return steps._asdict() | {"V_f_over_A_q": steps.V_f / steps.A_q, "T_amb": T_amb}

    def allowed(self, column: str) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of each quantity of `follows` that the digits of the inputs allow.

        Found at the corners of the inputs: every quantity is monotonic in each input, as a test checks.
        """
        corners = self.follows(column, CORNERS.T)
        return {name: (float(np.min(values)), float(np.max(values))) for name, values in corners.items()}

    def left_over(self, column: str) -> tuple[str, ...]:
        """Names of the fewest cells to leave out so that one set of inputs gives the rest of a column.

        All cells if more than `MOST_DROPPED` would be left out.
        """
        cells = [name for row, name in self.printed if row == column and name in QUANTITIES]

        def off(moved: np.ndarray, names: list[str]) -> np.ndarray:
            """Distances from the printed values, in half units."""
            values = self.follows(column, moved)
            printed = [self.printed[column, name] for name in names]
            return np.array([(values[n] - p.value) / p.half for n, p in zip(names, printed, strict=True)])

        def farthest(names: list[str]) -> float:
            """Smallest possible distance of the cell that is farthest from its printed value."""
            within = {
                "type": "ineq",
                "fun": lambda z: np.outer((1, -1), off(z[:-1], names)).ravel() + z[-1],
            }
            start = np.zeros(len(INPUTS) + 1)
            return minimize(
                lambda z: z[-1],
                [*start, np.abs(off(start, names)).max()],
                method="SLSQP",
                bounds=[(-1, 1)] * len(start) + [(0, None)],
                constraints=within,
                options={"maxiter": 500, "ftol": 1e-12},
            ).fun

        for number in range(MOST_DROPPED + 1):
            for dropped in itertools.combinations(cells, number):
                kept = [name for name in cells if name not in dropped]
                if farthest(kept) < 1 + MET:
                    return dropped
        return tuple(cells)
