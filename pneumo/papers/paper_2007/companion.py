"""The paper of 2007: what `pneumo.verdict.judging` needs of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumo.papers.known_papers import KNOWN
from pneumo.papers.paper_2007.cylinder_statements import COMPUTATIONS
from pneumo.papers.paper_2007.measured_columns import COLUMNS, FOLDER, Results
from pneumo.papers.paper_2007.misprints import PROOFS
from pneumo.papers.paper_2007.simulated_example import AREAS, LAMBDA_0, STEPS, TAKEN, WALL_AREA
from pneumo.papers.paper_2007.trend import quoted_coefficient
from pneumo.verdict.judging import Item, Paper, Sources, six_digits
from pneumo.verdict.published import half_unit


def sources(results: Path, folder: Path) -> dict[str, Results]:
    """The simulated example and the printed tables, as one source."""
    return {"results": Results(results, folder)}


def about(_: Sources) -> dict[str, Any]:
    """Nothing is cut and nothing can fail."""
    return {"study": "paper", "failures": {}, "settling_failures": {}}


def highlights(sources: Sources, items: Sequence[Item]) -> dict[str, Any]:
    """What each reading of the simulated example meets of its printed numbers, and each column's room.

    `readings` has, by area and final pressure, the most of `numbers` that any push and window meets, and the
    range of tau; `taken` the reading that is taken, and by what fraction its area, k_0 and lambda_0 are off;
    `rooms` the lowest and highest room temperature that a column's T_av allows, K; `quoted` see there.
    """
    results: Results = sources["results"]
    names = [name for name in STEPS if name not in ("T_av", "lambda_0")]  # which no reading gives
    printed = {item["id"][3:]: item for item in items if item["id"] in [f"S3.{name}" for name in names]}
    example = results.example
    met = np.zeros(example.sizes["reading"], int)
    for name, one in printed.items():
        off = example[name].values / one["scale"] - float(one["printed"])
        met += np.abs(off) <= half_unit(one["printed"])
    readings: list[dict[str, Any]] = []
    for area in AREAS:
        for final in ("free", "fixed"):
            of = ((example["area"] == area) & (example["final"] == final)).values
            tau = [six_digits(float(end)) for end in (example["tau"][of].min(), example["tau"][of].max())]
            readings.append({"area": area, "final": final, "met": int(met[of].max()), "tau": tau})
    k_0 = LAMBDA_0 * WALL_AREA
    off = {"A_q": results.step("A_q") / WALL_AREA, "k_0": results.step("k_0") / k_0}
    off["lambda_0"] = results.step("lambda_0") / LAMBDA_0
    taken = {name: six_digits(value - 1) for name, value in off.items()}
    rooms = {column: list(map(six_digits, results.allowed(column)["T_amb"])) for column in COLUMNS}
    return {
        "readings": readings,
        "numbers": len(printed),
        "taken": TAKEN._asdict() | taken,
        "rooms": rooms,
        "quoted": quoted_coefficient(),
    }


PAPER_2007 = Paper(
    FOLDER,
    COMPUTATIONS,
    PROOFS,
    sources,
    about,
    highlights,
    module=__name__,
    reads=KNOWN["2007"].reads,
    command="pneumo paper explain --paper 2007",
)
