"""The common look of all figures: fonts, widths, byte-identical files."""

import base64
import io
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
from matplotlib import rc_params_from_file
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from pneumo.storage.files import atomic

SINGLE_MM = 84.0  # width of one column
DOUBLE_MM = 174.0  # width of the page
SCREEN_MM = 120.0  # readable on a phone, where a figure is as wide as the screen
MM_PER_INCH = 25.4
CSS_DPI = 96  # pixels of a page per inch

INK = "#1a1a1a"
GREY = "#7f7f7f"
PALE = "#e6e6e6"
ACCENT = "#1f5fa8"  # L* = 40, so it prints as a dark grey; the schemes have it too

LOOK = rc_params_from_file(Path(__file__).parent / "figures.mplstyle")  # over matplotlib's defaults
# No date, and no version of the plotting library, inside the files.
METADATA: dict[str, dict[str, None]] = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}


@contextmanager
def paper_style() -> Generator[None]:
    """Apply the common style, whatever the reader's own matplotlibrc says.

    Draw the figure inside this context; `save` enters it by itself.
    """
    if "STIXGeneral" not in fontManager.get_font_names():  # an old font cache
        for file in Path(mpl.get_data_path(), "fonts", "ttf").glob("STIX*.ttf"):
            fontManager.addfont(file)
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(LOOK)
        yield


class ShownFigure(Figure):
    """Figure that notebooks show, although pyplot does not know it."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        width, height = self.get_size_inches()
        return _png(self), {"width": round(CSS_DPI * width), "height": round(CSS_DPI * height)}


def new_figure(width_mm: float = SINGLE_MM, height_mm: float = 60.0) -> Figure:
    """Return an empty figure of a printed size, outside pyplot's global list."""
    fig = ShownFigure(figsize=(width_mm / MM_PER_INCH, height_mm / MM_PER_INCH), layout="constrained")
    FigureCanvasAgg(fig)
    return fig


def axis_label(quantity: str, unit: str = "") -> str:
    """Write an axis label as the paper does, quantity and unit in brackets.

    Examples
    --------
    >>> axis_label("$P_A$", "Pa"), axis_label("$n$")
    ('$P_A$ (Pa)', '$n$')
    """
    return f"{quantity} ({unit})" if unit else quantity


def symbol(name: str) -> str:
    """Return a model's or an experiment's name as the paper sets it: M10 becomes M with a subscript.

    Examples
    --------
    >>> symbol("M10"), symbol("E06")
    ('$M_{10}$', '$E_{6}$')
    """
    return f"${name[0]}_{{{int(name[1:])}}}$" if name[1:].isdigit() else name


def save(fig: Figure, stem: str | Path) -> tuple[Path, Path]:
    """Write `stem.svg` and `stem.png`, whole or not at all, with the same bytes on every run.

    The printed size is kept, and the layout is fixed from here on; missing folders are made.
    """
    stem = Path(stem)
    svg, png = (stem.with_name(f"{stem.name}.{kind}") for kind in METADATA)
    with paper_style():
        for path, (kind, metadata) in zip((svg, png), METADATA.items(), strict=True):
            with atomic(path) as part:
                fig.savefig(part, format=kind, metadata=metadata)
            # The second file has the layout of the first, and takes half the time.
            fig.set_layout_engine(None)
    return svg, png


def image_address(fig: Figure) -> str:
    """Return a figure as the data URI of a PNG image, for its `src` in a page."""
    return f"data:image/png;base64,{base64.b64encode(_png(fig)).decode()}"


def _png(fig: Figure) -> bytes:
    """Return a figure as a PNG image."""
    buffer = io.BytesIO()
    with paper_style():
        fig.savefig(buffer, format="png", metadata=METADATA["png"])
    return buffer.getvalue()
