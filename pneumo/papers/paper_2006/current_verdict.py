"""The verdict that `pneumo paper verdict` shows."""

from pathlib import Path
from typing import Any

from pneumo.verdict import PAPER_FOLDER
from pneumo.verdict.stored_verdict import stored_verdict


def current_verdict(results: Path, paper: Path = PAPER_FOLDER) -> dict[str, Any]:
    """Verdict on the paper: what ``verdict.json`` holds if up to date, else judged anew (not written)."""
    stored = stored_verdict(results, paper, "pneumo.papers.paper_2006.paper")
    if stored is not None:
        return stored
    from pneumo.papers.paper_2006.paper import PAPER_2006  # here: it imports slow packages
    from pneumo.verdict.judging import verdict

    return verdict(results, PAPER_2006._replace(folder=paper))
