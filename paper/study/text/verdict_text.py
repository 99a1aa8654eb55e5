"""The verdict as text for a terminal of 80 columns: the headline, then facts, worst first."""

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from paper.verdict.facts import AGREES, NOT_JUDGED, headline_text


def verdict_lines(judged: Mapping[str, Any]) -> Iterator[str]:
    """Lines for `paper.verdict.judging.verdict`: the headline, and facts that do not plainly agree."""
    yield textwrap.fill(headline_text(judged["headline"]), 80)
    for status in dict.fromkeys(fact["status"] for fact in judged["facts"]):
        if status in (AGREES, NOT_JUDGED):
            continue
        yield f"\n{status}"
        for fact in judged["facts"]:
            if fact["status"] == status:
                text = f"{fact['says']} ({size_text(fact)})" if size_text(fact) else fact["says"]
                yield textwrap.fill(text, 80, initial_indent="  ", subsequent_indent="    ")


def size_text(fact: Mapping[str, Any]) -> str:
    """Size of a fact's deviation: agreeing items, chi-square, largest deviation in per cent and in seeds'."""
    parts = [f"{fact['agree']} of {fact['judged']} within tolerance" if fact["judged"] > 1 else ""]
    if fact["judged"] < fact["items"]:
        parts.append(f"{fact['items'] - fact['judged']} not run")
    if fact["chi_square"] is not None:
        parts.append(f"χ² {fact['chi_square']:.0f} for {fact['left']:.0f} degrees of freedom")
    if fact["largest"]:
        parts.append(f"largest deviation {deviation_text(fact['largest'])}")
    if fact["seeds"]:
        parts.append(f"at most {fact['seeds']:.1f} seed deviations")
    return "; ".join(filter(None, parts))


def deviation_text(relative: float | None) -> str:
    """Deviation in per cent; empty without a number."""
    if relative is None:
        return ""
    text = f"{100 * relative:+.2f}" if abs(relative) < 0.1 else f"{100 * relative:+.0f}"
    return f"{'0' if float(text) == 0 else text} %"
