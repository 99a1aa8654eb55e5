"""The verdict stored in a folder of results, if it is newer than the files that it was made from.

Imports nothing slow: showing a stored verdict takes less time than the imports for judging.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from paper.study.kept_evidence import KEPT

OF_PAPER = ("*.yaml", "published/*.csv", "seed_deviations.csv")  # what a verdict reads
OF_EVIDENCE = ("seed_sets.nc",)


def stored_verdict(results: Path, paper: Path, reads: Sequence[str]) -> dict[str, Any] | None:
    """Content of ``verdict.json``; None if it is missing, cut short, or older than a file behind it.

    Behind it are the paper's files and the results that match one of the patterns `reads`.
    """
    file = results / "verdict.json"
    behind = [
        each
        for folder, patterns in ((paper, OF_PAPER), (results, reads), (KEPT, OF_EVIDENCE))
        for pattern in patterns
        for each in folder.glob(pattern)
    ]
    try:
        written = file.stat().st_mtime_ns
        if any(each.stat().st_mtime_ns > written for each in behind):
            return None
        return json.loads(file.read_bytes())
    except (OSError, ValueError):
        return None
