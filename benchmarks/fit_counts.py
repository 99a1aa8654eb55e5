"""Counts of the bench of fits, by the rules of `benchmarks.fit_bench`: wrong, silent, named."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from benchmarks.disturbances import DISTURBANCES

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/static/fit_bench.json"
TOLERANCE = {"k_0": 0.25, "C": 0.05, "V_A": 0.1, "V_B": 0.1}  # of the truth
# What a warning says of causes that `--also` cannot fit.
SAID = {"a zero of x": ("x_zero",), "a stroke": ("stroke", "x_scale")}
VERDICTS = ("right", "tied", "none", "wrong")


def named_causes(warnings: Sequence[str]) -> set[str]:
    """Names of the causes that warnings of a fit give."""
    text = " ".join(warnings)
    names = {*re.findall(r"--also (\w+)", text)}
    return names | {name for words, causes in SAID.items() if words in text for name in causes}


class Outcome(NamedTuple):
    """Result of the fit of one case."""

    disturbance: str
    seed: int
    seconds: float  # of the processor
    refused: str  # message, or empty
    warnings: list[str]
    found: dict[str, list[float]]  # truth, estimate, low, high by judged parameter
    lights: Mapping[str, str] = MappingProxyType({})  # by judged parameter; empty without the full order

    @property
    def outside(self) -> list[str]:
        """Parameters whose interval does not hold the truth."""
        return [name for name, (truth, _, low, high) in self.found.items() if truth < low or truth > high]

    @property
    def wrong(self) -> list[str]:
        """Those of them that are off by more than `TOLERANCE`."""
        return [
            name
            for name in self.outside
            if abs(self.found[name][1] / self.found[name][0] - 1) > TOLERANCE[name]
        ]

    @property
    def named(self) -> str:
        """How warnings name the cause: right, tied, none or wrong."""
        names = named_causes(self.warnings)
        cause = DISTURBANCES[self.disturbance].cause
        if not names:
            return "none"
        return "wrong" if cause not in names else "right" if len(names) == 1 else "tied"

    @property
    def silent(self) -> bool:
        """Whether a parameter is wrong in green, or has no light, and there is no warning."""
        in_green = [name for name in self.wrong if self.lights.get(name, "green") == "green"]
        return bool(in_green) and not self.warned

    @property
    def warned(self) -> bool:
        """Whether the record was refused, or the fit warned of."""
        return bool(self.refused or self.warnings)


def summary(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """Counts by disturbance, and the median of each parameter's estimate over its truth."""
    rows: dict[str, dict[str, Any]] = {}
    by_name: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        by_name.setdefault(outcome.disturbance, []).append(outcome)
    for name, group in by_name.items():
        row: dict[str, Any] = {"records": len(group)}
        for parameter in TOLERANCE:
            ratios = [o.found[parameter][1] / o.found[parameter][0] for o in group if parameter in o.found]
            row[parameter] = float(np.median(ratios)) if ratios else np.nan
        row["refused"] = sum(bool(o.refused) for o in group)
        row["warned"] = sum(bool(o.warnings) for o in group)
        row["outside"] = sum(bool(o.outside) for o in group)
        row["wrong"] = sum(bool(o.wrong) for o in group)
        row["silent"] = sum(o.silent for o in group)
        row |= {f"cause {verdict}": sum(o.named == verdict for o in group) for verdict in VERDICTS}
        rows[name] = row
    return pd.DataFrame.from_dict(rows, orient="index")


def held(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """By parameter: intervals, those that hold the truth, and the median error of the estimate."""
    rows: dict[str, dict[str, float]] = {}
    for parameter in TOLERANCE:
        found = [case.found[parameter] for case in outcomes if parameter in case.found]
        holds = [low <= truth <= high for truth, _, low, high in found]
        errors = [abs(estimate / truth - 1) for truth, estimate, _, _ in found]
        if found:
            rows[parameter] = {"intervals": len(found), "held": sum(holds), "error": float(np.median(errors))}
    return pd.DataFrame.from_dict(rows, orient="index")


def write(outcomes: Sequence[Outcome], folder: Path) -> None:
    """Write every case as JSON."""
    folder.mkdir(exist_ok=True)
    records: list[dict[str, Any]] = []
    for outcome in outcomes:
        ends = {name: [v if np.isfinite(v) else None for v in row] for name, row in outcome.found.items()}
        records.append(
            outcome._asdict() | {"found": ends, "outside": outcome.outside, "wrong": outcome.wrong}
        )
    (folder / "fit_bench.json").write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")


def for_the_page(folder: Path) -> None:
    """Write counts of the cases that `write` left in a folder to docs/static/fit_bench.json, for fit.md."""
    outcomes = kept(folder)
    table = summary(outcomes)
    table = table.astype(object).where(table.notna(), None)
    table.insert(0, "text", [DISTURBANCES[str(name)].text for name in table.index])
    undisturbed = [outcome for outcome in outcomes if outcome.disturbance == "none"]
    content = {
        "table": table.to_dict(orient="index"),
        "undisturbed": held(undisturbed).to_dict(orient="index"),
        "unwarned": held([o for o in outcomes if not o.warned]).to_dict(orient="index"),
        "seconds": float(np.median([o.seconds for o in outcomes if not o.refused])),
    }
    PAGE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def kept(folder: Path) -> list[Outcome]:
    """Outcomes that `write` left in a folder."""
    outcomes: list[Outcome] = []
    for one in json.loads((folder / "fit_bench.json").read_text(encoding="utf-8")):
        ends = (np.nan, np.nan, -np.inf, np.inf)
        found = {
            name: [end if v is None else v for v, end in zip(row, ends, strict=True)]
            for name, row in one["found"].items()
        }
        texts = one["refused"], one["warnings"]
        outcomes.append(
            Outcome(one["disturbance"], one["seed"], one["seconds"], *texts, found, one.get("lights", {}))
        )
    return outcomes
