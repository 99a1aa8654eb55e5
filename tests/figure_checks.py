"""Checks of figures: files are not empty, nothing is cut off at the edges."""

from pathlib import Path

from matplotlib.figure import Figure

from pneumo.publish.style import paper_style, save


def saved_whole(fig: Figure, file: Path) -> Path:
    """Save a figure and check both files and its edges; return the SVG."""
    svg, png = save(fig, file)
    assert svg.stat().st_size > 10_000 and png.stat().st_size > 10_000
    with paper_style():
        ink, page = fig.get_tightbbox(), fig.get_size_inches()
    assert ink.x0 >= 0 and ink.y0 >= 0 and ink.x1 <= page[0] and ink.y1 <= page[1], f"{file.name} is clipped"
    return svg
