"""Judging a paper: claims, published tables, errata, assumptions, comparison with what was reproduced."""

from pathlib import Path

PAPER_FOLDER = Path(__file__).resolve().parents[2] / "paper" / "2006"  # read where no other is named
