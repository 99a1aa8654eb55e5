"""Numbers and tables as text, for tables, pages, notebooks and the manuscript."""

from collections.abc import Iterable, Sequence

import numpy as np
from markupsafe import escape

KILO = 1e3


def significant(value: float) -> str:
    """Write three significant digits or, where the first is 1, four.

    Examples
    --------
    >>> significant(1.4987), significant(99.76), significant(0.30057), significant(5.312)
    ('1.499', '99.8', '0.301', '5.31')
    """
    leading = f"{value:e}"[0]
    digits = 4 if leading == "1" else 3
    return f"{value:#.{digits}g}".rstrip(".")


def ends_text(low: float, high: float) -> str:
    """Write an interval to three or four digits; an end at infinity or NaN is no limit, nor is 0 a lone one.

    Examples
    --------
    >>> ends_text(1.4662, 1.511), ends_text(0.0, 1.1514), ends_text(np.nan, np.inf)
    ('1.466 to 1.511', '0 to 1.151', 'not determined')
    """
    if np.isfinite(low) and np.isfinite(high):
        return f"{significant(low) if low else '0'} to {significant(high)}"
    if np.isfinite(low) and low > 0:
        return f"at least {significant(low)}"
    return f"at most {significant(high)}" if np.isfinite(high) and high > 0 else "not determined"


def percent_text(fraction: float, digits: int = 0) -> str:
    """Write a fraction in per cent.

    Examples
    --------
    >>> percent_text(0.0254, 1), percent_text(0.4)
    ('2.5 %', '40 %')
    """
    return f"{100 * fraction:.{digits}f} %"


def no_exponent(value: float) -> str:
    """Write a number with at most two decimals and no exponent.

    Examples
    --------
    >>> no_exponent(1234.5), no_exponent(12.34), no_exponent(0.123)
    ('1234', '12.3', '0.12')
    """
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def table_html(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), caption: str = "") -> str:
    """Table for notebooks; the first cell of a row names it.

    Examples
    --------
    >>> table_html([["M6", "3.6"]], ["model", "kPa"])
    '<table><thead><tr><th>model</th><th>kPa</th></tr></thead><tbody><tr><th>M6</th><td>3.6</td></tr></tbody></table>'
    """
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    lines = (
        f"<tr><th>{escape(name)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, *cells in rows
    )
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    above += f"<thead><tr>{head}</tr></thead>" if heads else ""
    return f"<table>{above}<tbody>{''.join(lines)}</tbody></table>"


def lines_html(shown: object) -> str:
    """Table of an object's text for notebooks: a row for each line, cut at its colon, below the first."""
    first, *lines = repr(shown).splitlines()
    if not lines:
        return table_html([first.split(": ", 1)])
    return table_html((line.split(": ", 1) for line in lines), caption=first)
