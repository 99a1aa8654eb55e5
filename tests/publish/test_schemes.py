"""The schematic figures and the common style: readable, unclipped, the same bytes on every run."""

import itertools
import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

from pneumo.publish import drawing
from pneumo.publish.model_looks import MODEL_LOOKS
from pneumo.publish.schemes import SCHEMES
from pneumo.publish.style import (
    DOUBLE_MM,
    MM_PER_INCH,
    SINGLE_MM,
    SOURCE_BAR,
    SOURCE_MARKER,
    axis_label,
    new_figure,
    paper_style,
    save,
)

MARGIN_PX = 2.0  # a quarter of a millimetre at 200 dpi: ink of a slanted glyph may leave its box by that much


@pytest.fixture(params=sorted(SCHEMES))
def scheme(request: pytest.FixtureRequest) -> str:
    return request.param


def draw(name: str) -> Figure:
    fig = SCHEMES[name]()
    with paper_style():
        fig.canvas.draw()
    return fig


def label_boxes(fig: Figure) -> dict[str, list]:
    """Pixel boxes of all visible labels, by their text."""
    boxes: dict[str, list] = {}
    with paper_style():
        for text in fig.findobj(Text):
            if text.get_visible() and text.get_text().strip():
                boxes.setdefault(text.get_text(), []).append(text.get_window_extent())
    return boxes


def test_scheme_has_a_column_width(scheme):
    width_mm = draw(scheme).get_size_inches()[0] * MM_PER_INCH
    assert np.isclose(width_mm, [SINGLE_MM, DOUBLE_MM]).any()


def test_scheme_labels_lie_within_the_canvas(scheme):
    fig = draw(scheme)
    for text, boxes in label_boxes(fig).items():
        for box in boxes:
            inside = (
                box.x0 >= MARGIN_PX
                and box.y0 >= MARGIN_PX
                and box.x1 <= fig.bbox.x1 - MARGIN_PX
                and box.y1 <= fig.bbox.y1 - MARGIN_PX
            )
            assert inside, f"{scheme}: {text!r} is clipped"


def test_scheme_labels_do_not_overlap(scheme):
    labels = [(text, box) for text, boxes in label_boxes(draw(scheme)).items() for box in boxes]
    assert len(labels) > 3
    for (one, box), (other, another) in itertools.combinations(labels, 2):
        assert not box.overlaps(another), f"{scheme}: {one!r} overlaps {other!r}"


def test_scheme_files_are_identical_on_two_renders(scheme, tmp_path):
    first = save(draw(scheme), tmp_path / "first" / scheme)
    second = save(draw(scheme), tmp_path / "second" / scheme)
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()
    assert sorted(p.name for p in (tmp_path / "first").iterdir()) == [f"{scheme}.png", f"{scheme}.svg"]


def test_scheme_svg_is_well_formed_and_small(scheme, tmp_path):
    svg, _ = save(draw(scheme), tmp_path / scheme)
    assert ET.parse(svg).getroot().tag == "{http://www.w3.org/2000/svg}svg"
    assert svg.stat().st_size < 100_000


@pytest.mark.parametrize(
    ("name", "symbols"),
    [
        ("fig01", ["P_s", r"P_{\mathrm{atm}}", "x_v", "1", "2", "3", "4"]),
        ("fig02", ["P_u", "T_u", "P_d", "A_t", r"\dot{m}"]),
        ("fig03", ["P_A", "T_B", "V_A", "A_A", "A_B", "V_d", "k_f", "M", "l/2", "x"]),
        ("fig04", [r"0.96\,l/2", "10 V", "u", "x"]),
        ("fig05", ["k_p", "10 V", "-", "u", "x"]),
        ("fig06", ["M_i(n)", "datum $P_A", "datum $P_B", r"\dot{x}", "u"]),
        ("fig12", ["P_s", r"P_{\mathrm{atm}}", "A_1", "A_2", r"\dot{m}_1", r"\dot{m}_2"]),
    ],
)
def test_scheme_shows_the_symbols_of_the_paper(name, symbols):
    labels = list(label_boxes(draw(name)))
    assert [s for s in symbols if not any(s in text for text in labels)] == []


def test_drawing_places_sides_and_arrow_heads():
    assert drawing.box(10.0, 20.0, 4.0, 6.0) == (10.0, 20.0, 8.0, 12.0, 17.0, 23.0)
    _, ax = drawing.canvas(80.0, 40.0)
    base = drawing.head(ax, (10.0, 5.0), (0.0, 5.0))
    assert base == (10.0 - drawing.HEAD_LENGTH, 5.0)  # behind the tip
    assert drawing.gain(ax, 30.0, 20.0, "gain", "k").x == 30.5


def test_style_does_not_depend_on_the_readers_settings(tmp_path):
    name = "fig02"
    plain, _ = save(draw(name), tmp_path / "plain")
    with mpl.rc_context(
        {"font.size": 20, "svg.fonttype": "none", "svg.hashsalt": None, "lines.linewidth": 9}
    ):
        other, _ = save(draw(name), tmp_path / "other")
    assert plain.read_bytes() == other.read_bytes()


def test_style_leaves_no_trace():
    before = dict(mpl.rcParams)
    with paper_style():
        pass
    assert dict(mpl.rcParams) == before


def test_save_leaves_no_part_file_when_drawing_fails(tmp_path):
    with paper_style():
        fig = new_figure()
        fig.text(0.5, 0.5, r"$\nosuchsymbol$")
    with pytest.raises(ValueError, match="nosuchsymbol"):
        save(fig, tmp_path / "broken")
    assert list(tmp_path.iterdir()) == []


def test_save_keeps_dots_in_the_name(tmp_path):
    with paper_style():
        fig = new_figure(layout=None)
    assert [p.name for p in save(fig, tmp_path / "n1.35")] == ["n1.35.svg", "n1.35.png"]


def test_axis_label_has_its_unit_in_brackets():
    assert axis_label("$P_A$", "Pa") == "$P_A$ (Pa)"
    assert axis_label("$n$") == "$n$"


# Machado, Oliveira and Fernandes (2009), doi:10.1109/TVCG.2009.113, severity 1, on linear RGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "grey": np.tile([0.2126, 0.7152, 0.0722], (3, 1)),
}


def lab(color: str, vision: str) -> np.ndarray:
    """CIE L*a*b* (D65) of a colour as that eye, or a grey printer, gives it."""
    rgb = np.array(to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.asarray(VISION[vision]) @ linear, 0, 1)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    ratio = to_xyz @ seen / to_xyz.sum(axis=1)
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", VISION)
def test_models_can_be_told_apart(vision):
    assert list(MODEL_LOOKS) == [f"M{i}" for i in range(1, 11)]
    for (one, look), (other, another) in itertools.combinations(MODEL_LOOKS.items(), 2):
        assert look.marker != another.marker
        # 12 in CIE76 is some five times the just noticeable 2.3; a pair below it must differ in dashes.
        close = np.linalg.norm(lab(look.color, vision) - lab(another.color, vision)) < 12
        assert not (close and look.linestyle == another.linestyle), f"{one} and {other}, {vision}"


def test_published_and_reproduced_differ_without_colour():
    assert SOURCE_BAR["published"]["facecolor"] == "white" and SOURCE_BAR["published"]["hatch"]
    assert lab(SOURCE_BAR["reproduced"]["facecolor"], "grey")[0] < 50
    assert SOURCE_MARKER["published"]["marker"] != SOURCE_MARKER["reproduced"]["marker"]
    assert SOURCE_MARKER["published"]["markerfacecolor"] == "none"
