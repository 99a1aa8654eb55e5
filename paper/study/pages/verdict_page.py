"""Page of a verdict: that of `paper_verdict`, with findings from ``findings.html.j2`` of the paper."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from paper.study.labels import ORIGINS
from paper_verdict.page import page
from pneumo.publish.pages.page import page_text

SIMULATORS = "simulators.json"  # of a paper: verdicts on other runs, from `python -m benchmarks.simulators`
FINDINGS = "findings.html.j2"


def verdict_page(verdict: Mapping[str, Any], folder: Path, evidence: Sequence[str] = ()) -> str:
    """Write the page of `paper_verdict.verdict`; the same verdict gives the same text.

    `folder` is the paper's. `evidence` has a text for each further file behind the verdict.
    """
    simulators = folder / SIMULATORS
    findings = page_text(
        FINDINGS,
        folder,
        verdict=verdict,
        simulators=json.loads(simulators.read_text(encoding="utf-8")) if simulators.is_file() else [],
        origins=ORIGINS,
        ordinal=lambda number: {1: "", 2: "second", 3: "third"}.get(number, f"{number}th"),
        on_log_axis=axis_fraction,
    )
    return page(verdict, findings=findings, evidence=evidence)


def axis_fraction(value: float, lowest: float, highest: float) -> float:
    """Position of a value on a logarithmic axis, from 0 at `lowest` to 1 at `highest`, limited to these."""
    return min(max(math.log(value / lowest) / math.log(highest / lowest), 0.0), 1.0)
