"""Numbers as text, for tables, pages and the manuscript."""

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


def preformatted(shown: object) -> str:
    """HTML of an object's text, for notebooks."""
    return f"<pre>{escape(repr(shown))}</pre>"
