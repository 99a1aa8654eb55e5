"""The schemes kept by hand: SVG that parses, with a title and the paper's symbols."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "paper/schemes"
SYMBOLS = {
    "fig01": ["chamber A", "Ps", "Patm", "xv", "1", "2", "3", "4"],
    "fig02": ["Pu, Tu", "Pd", "At", "ṁ"],
    "fig03": ["PA, TA, VA", "PB, TB, VB", "AA", "AB", "Vd", "kf", "M", "l/2", "x"],
    "fig04": ["at x = ±0.96 l/2", "10 V limit", "u", "x"],
    "fig05": ["kp", "10 V limit", "−", "u", "x"],
    "fig06": ["model Mi(n)", "datum PA", "datum PB", "x, ẋ", "u"],
    "fig12": ["Ps, Ts", "Patm", "A1", "A2", "ṁ1", "ṁ2"],
}


@pytest.mark.parametrize("name", SYMBOLS)
def test_a_scheme_is_readable_svg_with_title_and_symbols(name):
    svg = ET.parse(FOLDER / f"{name}.svg").getroot()
    assert svg.tag == "{http://www.w3.org/2000/svg}svg"
    assert svg.findtext("{*}title", "").startswith(f"Fig. {int(name[3:])}: ")
    labels = ["".join(text.itertext()) for text in svg.iter("{http://www.w3.org/2000/svg}text")]
    assert [symbol for symbol in SYMBOLS[name] if symbol not in labels] == []
