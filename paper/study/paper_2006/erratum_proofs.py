"""Proofs of the errata of 2006: whether the printed form fails and the meant one holds, with the numbers.

They use the paper's own numbers and formulas only. ``paper/2006/errata.yaml`` names them.
"""

import math
import sys

import numpy as np

from paper.study import functions_returning
from paper.study.paper_2006 import equation_checks as equations
from paper.study.paper_2006.equation_checks import GAMMA, P_0, P_ATM, P_S, SONIC, T_AMB, R
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import read_table, table7, table9
from paper.study.paper_2006.setup_checks import WITH_N
from paper_verdict.errata import Proof
from paper_verdict.files import half_unit
from pneumo.physics.valve import Conditions, Valve, chamber_flows, exact_gas, sonic_coefficient


def wall_heat_sign() -> tuple[bool, str]:
    """Wall heat warms air 20 K above ambient as printed and cools it as meant."""
    hot = T_AMB + 20
    printed, meant = (equations.wall_heat_rates(hot, sign) for sign in (-1.0, 1.0))
    words = f"air at {hot:g} K: {printed['K/s']:+.3g} K/s as printed, {meant['K/s']:+.3g} K/s as meant"
    return all(printed[unit] > 0 > meant[unit] for unit in printed), words


def eq5_factor_T() -> tuple[bool, str]:
    """Mass and energy balance give eq (5) with the factor T in its last term, not without."""
    printed, meant = equations.temperature_equation_fits(False), equations.temperature_equation_fits(True)
    return meant and not printed, "20 states: mass and energy balance are met with the factor T, not without"


def n_step() -> tuple[bool, str]:
    """Nine values from 1 to 1.4, and every n of Table 8, fit a step of 0.05, not of 0.5."""
    values = [float(cell["printed"]) for cell in read_table(8)]
    printed, meant = (
        all(abs((n - 1) / step - round((n - 1) / step)) < 1e-9 for n in values) for step in (0.5, 0.05)
    )
    count = round(0.4 / 0.05) + 1
    return count == 9 and meant and not printed, f"{count} values; all 96 n of Table 8 lie on it"


def number_of_runs() -> tuple[bool, str]:
    """Seven models of section 3 have an n; the printed 912 runs count only six."""
    with_n = len(WITH_N)
    printed, meant = 16 * (6 * 9 + 3), 16 * (with_n * 9 + len(PAPER_MODELS) - with_n)
    words = f"{with_n} models have an n: 16 (6 x 9 + 3) = {printed}, 16 ({with_n} x 9 + 3) = {meant}"
    return with_n == 7 and printed == 912 and meant == 1056, words


def eq17_sonic() -> tuple[bool, str]:
    """The printed factor is not the 0.0404 of eq (1), the meant one is."""
    printed, meant = equations.sonic_factor_as_printed(), sonic_coefficient(R, GAMMA)
    words = f"{printed:.4f} as printed, {meant:.5f} as meant, 0.0404 in eq (1)"
    return abs(printed - SONIC) > half_unit("0.0404") >= abs(meant - SONIC), words


def P_0_ratio() -> tuple[bool, str]:
    """P_0 / P_s is 0.8075 by the exact law, for any R, and 0.8076 with 0.0404 and R = 287; not 0.8077."""
    half = half_unit("0.8077")
    ratios = {air: equations.half_bridge_ratios(air) for air in (286.9, 287.0, 287.1)}
    exact = [exact for exact, _ in ratios.values()]
    same = max(exact) - min(exact) < 1e-8
    misses = all(abs(ratio - 0.8077) > half for ratio in ratios[287.0])
    words = ", ".join(f"{printed:.5f} at R = {air:g}" for air, (_, printed) in ratios.items())
    return same and misses, f"exact law {exact[0]:.6f}; with 0.0404: {words}"


def eq2_areas() -> tuple[bool, str]:
    """With |u| in eq (2) a negative command empties chamber A; with u, as printed, its area is negative."""
    valve, gas = Valve(1e-7, 10.0), exact_gas(R, GAMMA)
    conditions = Conditions(P_S, P_ATM, T_AMB, T_AMB, P_0, T_AMB)
    m_in, m_out = chamber_flows(-1.0, P_0, T_AMB, valve, gas, conditions)
    area = valve.k_xu * -1.0
    words = f"at u = -1 V: {area:g} m^2 as printed; {m_out:.3g} kg/s leave chamber A as meant"
    return area < 0 and m_in == 0 and m_out > 0, words


def valve_flow() -> tuple[bool, str]:
    """Check that eq (1) gives 82 (D) and 823 (E) standard litres per minute at 10 V, not 100 and 1000."""
    D, E = (equations.standard_flow(gain, 10) for gain in (1e-7, 1e-6))
    return abs(D - 82) <= 0.5 and abs(E - 823) <= 0.5, f"{D:.1f} and {E:.1f} slpm"


def lambda_E() -> tuple[bool, str]:
    """0.02 W/K over cylinder E's area rounds to 1.30; the other seven cells of Table 4 round as printed."""
    sizes = {(cell["row"], cell["column"]): float(cell["printed"]) * 1e-3 for cell in read_table(2)}
    wrong: list[str] = []
    for cell in read_table(4):
        bore, stroke = sizes[cell["row"], "bore"], sizes[cell["row"], "stroke"]
        meant = float(cell["k_0"]) / (math.pi * (bore**2 + bore * stroke) / 2)
        if abs(meant - float(cell["printed"])) > half_unit(cell["printed"]):
            wrong.append(f"{cell['row']} at {cell['k_0']} W/K is {meant:.4f} W/(m^2 K)")
    return wrong == ["E at 0.02 W/K is 1.2961 W/(m^2 K)"], f"only cell off: {'; '.join(wrong)}"


def valve_units() -> tuple[bool, str]:
    """Proof by units: x_v = k_u u and A = k_x x_v make k_u a length per volt and k_x a length."""
    area, x_v, u = np.array([2, 0]), np.array([1, 0]), np.array([0, 1])  # exponents of length and voltage
    k_u, k_x = (x_v - u).tolist(), (area - x_v).tolist()
    words = "x_v = k_u u makes k_u a length per volt; A = k_x x_v makes k_x a length, not a length per volt"
    return k_u == [1, -1] and k_x == [1, 0] and np.add(k_u, k_x).tolist() == [2, -1], words


def E04_P_B() -> tuple[bool, str]:
    """E04's P_B alone in Table 5 has not three decimals; its row alone does not fall as k_0 grows."""
    cells = read_table(5)
    odd = [f"{c['row']} {c['column']}" for c in cells if len(c["printed"].split(".")[1]) != 3]
    growing: dict[str, list[str]] = {}
    for shift in (1.0, 100.0):
        times: dict[str, list[float]] = {}
        for c in cells:  # by rising k_0
            factor = shift if f"{c['row']} {c['column']}" in odd else 1.0
            row = times.setdefault(f"{c['column']} of {c['cylinder']}, {c['type']} loop", [])
            row.append(factor * float(c["printed"]))
        growing[f"{shift:g}"] = [name for name, row in times.items() if row != sorted(row, reverse=True)]
    passes = odd == ["E04 P_B"] and growing == {"1": ["P_B of E, closed loop"], "100": []}
    words = f"not three decimals: {', '.join(odd)}; rows that do not fall as k_0 grows: "
    return passes, words + f"{', '.join(growing['1'])} as printed, {len(growing['100'])} as meant"


def variance_D() -> tuple[bool, str]:
    """Table 3 gives cylinder D the same variance in V^2 and in m^2, and cylinder E two different ones."""
    variance = {(c["row"], c["type"]): c["printed"] for c in read_table(3) if c["column"] == "variance"}
    D, E = ([variance[cylinder, loop] for loop in ("open", "closed")] for cylinder in "DE")
    areas = f"valve areas of {float(D[0]) ** 0.5 * 1e-7:.1g} and {float(E[0]) ** 0.5 * 1e-6:.1g} m²"
    return D[0] == D[1] and E[0] != E[1], f"D: {D[0]} V² and {D[1]} m²; E: {E[0]} V² and {E[1]} m²; {areas}"


def M7_is_M8() -> tuple[bool, str]:
    """The text's four numbers for M7 at the typical level are in M8's row of Table 9, none in M7's."""
    row, overall = table9().sel(level="typical"), table7()["mse"]
    M6, classical = float(row["mse"].sel(model="M6")), float(row["mse"].sel(model=["M1", "M2", "M3"]).min())
    quantities = row["mse"] / M6, row["mse"] / classical, row["mean_error"], row["std"]
    M7, M8 = ([round(float(q.sel(model=model)), 2) for q in quantities] for model in ("M7", "M8"))
    in_text = [0.40, 0.10, 140, 2400]
    none_of_M7 = all(number != text for number, text in zip(M7, in_text, strict=True))
    over_M6 = table9()["mse"] / table9()["mse"].sel(model="M6", drop=True)
    at_most = {model: float(over_M6.sel(model=model).max()) for model in ("M7", "M8", "M9", "M10")}
    only_M7 = [model for model, ratio in at_most.items() if ratio > 0.725] == ["M7"]
    holds_63 = float(overall.sel(model="M7") / overall.sel(model="M6")) < 0.635
    words = f"M7's row: {M7[0]:.0%} of M6, {M7[1]:.0%} of M2, {M7[2]:.0f} Pa, {M7[3]:.0f} Pa; at most, at any"
    words += " level, of M6: " + ", ".join(f"{model} {ratio:.0%}" for model, ratio in at_most.items())
    return in_text == M8 and none_of_M7 and only_M7 and holds_63, words


# In the order of ``errata.yaml``.
PROOFS: dict[str, Proof] = functions_returning(tuple[bool, str], sys.modules[__name__])
