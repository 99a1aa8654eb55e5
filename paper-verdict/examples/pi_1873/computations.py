"""Proofs of the errata, from the paper's own formula and its printed digits."""

from pathlib import Path

from compute import arctan_digits, pi_digits

from paper_verdict import read_cells


def wrong_from_528():
    """The first printed digit that Machin's formula does not give is the 528th; no later row is right."""
    true = pi_digits()
    cells = read_cells("table1", Path(__file__).parent)
    printed = "".join(cell["printed"] for cell in cells)
    differs = [401 + k for k, digit in enumerate(printed) if digit != true[400 + k]]
    wrong_rows = len({(place - 1) // 10 for place in differs})
    words = f"first difference at {differs[0]}, in {wrong_rows} of {len(cells)} rows"
    return differs[0] == 528 and wrong_rows == 8, words


def arctan_75():
    digit = arctan_digits()[74]
    return digit == "8", f"the series gives {digit}"
