"""Computations that each paper's claims are compared with: one package for each folder of ``paper/``."""

from pathlib import Path

PAPERS = Path(__file__).resolve().parents[2] / "paper"  # in a source checkout
