"""Head of the verdict: the readings of the simulated example, and the room temperatures of the tables."""

import itertools
from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np

from paper.study.paper_2007.printed_tables import COLUMNS, PAPER_FOLDER
from paper.study.paper_2007.results import Results
from paper.study.paper_2007.simulated_example import AREAS, LAMBDA_0, P_0, STEPS, T_0, TAKEN, WALL_AREA
from paper_verdict.files import half_unit, read_cells
from paper_verdict.judging import Item, Sources, six_digits
from pneumo.catalogue import coefficient_times_length
from pneumo.physics.cylinder import wetted_area


def highlights(sources: Sources, items: Sequence[Item]) -> dict[str, Any]:
    """Agreement of the simulated example's readings with its printed numbers, and room temperatures.

    `readings`: by area and final pressure, the most printed numbers, of `numbers`, that one push and window
    reproduces, and the range of tau, s; `taken`: the reading `TAKEN`, and the relative errors of its area,
    k_0 and lambda_0; `rooms`: the lowest and highest room temperature that each column's T_av allows, K.
    """
    results: Results = sources["results"]
    names = [name for name in STEPS if name not in ("T_av", "lambda_0")]  # which no reading gives
    printed = {item["id"][3:]: item for item in items if item["id"] in [f"S3.{name}" for name in names]}
    example = results.example
    met = np.zeros(example.sizes["reading"], int)
    for name, item in printed.items():
        off = example[name].values / item["scale"] - float(item["printed"])
        met += np.abs(off) <= half_unit(item["printed"])
    readings: list[dict[str, Any]] = []
    for area, final in itertools.product(AREAS, ("free", "fixed")):
        chosen = ((example["area"] == area) & (example["final"] == final)).values
        tau = example["tau"][chosen]
        ends = [six_digits(float(end)) for end in (tau.min(), tau.max())]
        readings.append({"area": area, "final": final, "met": int(met[chosen].max()), "tau": ends})
    k_0 = LAMBDA_0 * WALL_AREA
    off = {"A_q": results.step("A_q") / WALL_AREA, "k_0": results.step("k_0") / k_0}
    off["lambda_0"] = results.step("lambda_0") / LAMBDA_0
    taken = {name: six_digits(value - 1) for name, value in off.items()}
    rooms = {column: list(map(six_digits, results.allowed(column)["T_amb"])) for column in COLUMNS}
    summary = {"readings": readings, "numbers": len(printed), "taken": TAKEN._asdict() | taken}
    return summary | {"rooms": rooms, "quoted": quoted_coefficient()}


def quoted_coefficient() -> dict[str, float]:
    """Coefficient that the paper quotes for another cylinder, and the one predicted from its size.

    ``lambda_0``, W/(m^2 K), is the quoted one, converted to P_0 and T_0: it grows with the root of P T.
    ``predicted`` and ``highest``, W/(m^2 K), come from `pneumo.catalogue`, from the product of lambda_0 and
    ``length``: V / A_q, m, with the piston at the end.
    """
    det = {c["column"]: float(c["printed"]) * float(c["scale"]) for c in read_cells("quoted", PAPER_FOLDER)}
    V = pi / 4 * det["bore"] ** 2 * det["stroke"]
    length = V / wetted_area(V, det["bore"])
    at_rest = det["lambda_av"] * (P_0 * T_0 / (det["P"] * det["T"])) ** 0.5
    product, factor = coefficient_times_length()
    numbers = {"length": length, "lambda_0": at_rest, "predicted": product / length}
    numbers["highest"] = product * factor / length
    return {name: float(f"{value:.6g}") for name, value in numbers.items()}
