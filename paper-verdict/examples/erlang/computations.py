"""The statement of eq (5.2), and the proof of its erratum."""

from math import factorial

from paper_verdict import Finding


def as_printed(traffic, lines):
    return sum(traffic**k / factorial(k) for k in range(lines + 1))


def is_a_probability(results):
    value = as_printed(1.0, 5)
    return Finding(holds=0 <= value <= 1, shown=f"{value:.3g} for 5 lines and 1 Erl")


def exceeds_one():
    """As printed it exceeds one; with the numerator, one line loses E/(1 + E)."""
    printed = as_printed(1.0, 1)
    meant = 1.0 / printed
    return printed > 1 and meant == 0.5, f"one line, 1 Erl: {printed:g} as printed, {meant:g} as meant"
