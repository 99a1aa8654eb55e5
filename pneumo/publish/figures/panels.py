"""Common parts of figures: names, logarithmic axes, legends, named rows."""

from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, NullFormatter


def symbol(name: str) -> str:
    """Return a model's or an experiment's name as the paper sets it: M10 becomes M with a subscript.

    Examples
    --------
    >>> symbol("M10"), symbol("E06")
    ('$M_{10}$', '$E_{6}$')
    """
    return f"${name[0]}_{{{int(name[1:])}}}$" if name[1:].isdigit() else name


def one_two_five(axis: Axis) -> None:
    """Label 1, 2 and 5 of every decade."""
    axis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0), numticks=20))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
