"""Table of choose.md: how fast closed chambers drift to P_0."""

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.exported_strokes import N, template_plant
from paper.study.text.markdown_tables import markdown_table as table
from pneumo.equations.system import System, rates, system

RATIOS = 0.5, 0.75, 1.0, 1.2  # P/P_0, beside the atmosphere's
LIMITS = 1e3, 5e3, 20e3  # Pa
LONGEST = 10.0  # s


def tables() -> dict[str, str]:
    """Rates, and times after which the pressure has changed by each limit, for `pneumo init`'s cylinder."""
    plant = template_plant()
    c = plant.conditions
    rows = [[f"{c.P_atm / c.P_0:.2f} (vented)"], *([f"{ratio:g}"] for ratio in RATIOS)]
    for name in ("M7", "M10"):  # closed and in mid-stroke, M8 and M9 are as M7
        closed = system(name, N, plant, valve=False)

        def rate(_t: float, P: np.ndarray, closed: System = closed) -> list[float]:
            return [rates(closed, [P[0]] * 2, [0.0] * 4)[0]]

        for row, ratio in zip(rows, (c.P_atm / c.P_0, *RATIOS), strict=True):
            P = ratio * c.P_0
            run = solve_ivp(rate, (0, LONGEST), [P], rtol=1e-8, atol=1e-3, dense_output=True)
            t = np.geomspace(1e-4, LONGEST, 2000)
            off = np.abs(run.sol(t)[0] - P)
            times = [f"{t[np.argmax(off > limit)]:.2g}" for limit in LIMITS if off[-1] > limit]
            row += [f"{1e-3 * rate(0, np.array([P]))[0]:.0f}", ", ".join(times) or "never"]
    heads = [
        head
        for name in ("M7 to M9", "M10")
        for head in (f"drift of {name} (kPa/s)", "seconds until 1, 5, 20 kPa off")
    ]
    return {"table_rates": table(["P/P_0", *heads], rows)}
