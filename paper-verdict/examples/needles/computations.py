"""Estimates from the printed counts, and proofs of errata from the same counts."""

from pathlib import Path

from paper_verdict import Finding, half_unit, read_cells

CELLS = {(c["row"], c["column"]): c["printed"] for c in read_cells("table1", Path(__file__).parent)}


def _printed(who, *columns):
    return [float(CELLS[who, column]) for column in columns]


def _estimate(ratio, throws, crossings):
    return 2 * ratio * throws / crossings


def estimate(results, who):
    """2 l n / (d c), with the printed numbers."""
    return Finding(_estimate(*_printed(who, "ratio", "throws", "crossings")))


def five_sixths():
    ratio, throws, crossings, given = _printed("Lazzarini", "ratio", "throws", "crossings", "estimate")
    printed = _estimate(ratio, throws, crossings)
    meant = _estimate(5 / 6, throws, crossings)
    half = half_unit(CELLS["Lazzarini", "estimate"])
    rounds = abs(5 / 6 - ratio) <= half_unit(CELLS["Lazzarini", "ratio"])
    passes = abs(printed - given) > half >= abs(meant - given) and rounds
    return passes, f"{printed:.7f} with 0.83, {meant:.7f} with 5/6"


def cut_off():
    ratio, throws, crossings, given = _printed("Smith", "ratio", "throws", "crossings", "estimate")
    exact = _estimate(ratio, throws, crossings)
    half = half_unit(CELLS["Smith", "estimate"])
    return given < exact < given + 2 * half and exact - given > half, f"{exact:.6f}"


def reina():
    ratio, throws, crossings, given = _printed("Reina", "ratio", "throws", "crossings", "estimate")
    printed = _estimate(ratio, throws, crossings)
    meant = _estimate(ratio, throws, crossings - 10)
    half = half_unit(CELLS["Reina", "estimate"])
    return abs(printed - given) > half >= abs(meant - given), f"{printed:.4f} with 869, {meant:.4f} with 859"
