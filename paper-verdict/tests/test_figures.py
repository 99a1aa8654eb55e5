"""Digitised figures: points with the accuracy of their reading, and curves over the reproduced ones."""

import math
import re

import pytest
from test_slips import spoil

from paper_verdict import Judge, PaperError, load_paper, page

RULE = """
tables:
  - figure: 2
    class: reading
    values: {file: points.csv, variable: height, select: {model: "{row}", place: "{place}"}}
"""
CURVES = """
curves:
  - figure: 3
    file: figure3
    x: t
    x_unit: s
    panels:
      wave: {file: wave.csv, variable: y, against: time, minus: 1.0, factor: 2.0}

tables:
"""


@pytest.fixture
def figures(toy):
    """The small paper with two digitised figures."""
    spoil(
        toy,
        "claims.yaml",
        "\ntables:",
        "\n  reading: {limit: 3, measure: sigma, reading: true}\n" + RULE.rstrip(),
    )
    spoil(toy, "claims.yaml", "\ntables:\n", CURVES)
    spoil(
        toy,
        "facts.yaml",
        "text:",
        'points: {says: Points of Fig. 2, basis: prediction, items: ["F2.*"]}\ntext:',
    )
    spoil(
        toy, "claims.yaml", "    values: {file: points", "    id: F2.{row}.{place}\n    values: {file: points"
    )
    points = [("M1", "top", 2.0), ("M2", "top", 3.0), ("M1", "side", 4.0), ("M2", "side", 5.0)]
    rows = [f"{model},height,{y},0.1,{place}" for model, place, y in points]
    (toy / "published/figure2.csv").write_text("\n".join(["row,column,printed,sigma,place", *rows, ""]))
    ours = [f"{model},{place},{y + 0.1}" for model, place, y in points]
    (toy / "reproduced/points.csv").write_text("\n".join(["model,place,height", *ours, ""]))
    wave = [f"wave,{k / 10},{math.sin(k / 10) - 0.01},{math.sin(k / 10) + 0.01}" for k in range(50)]
    (toy / "published/figure3.csv").write_text("\n".join(["row,t,low,high", *wave, ""]))
    ours = [f"{1 + k / 1000},{math.sin(k / 1000) / 2}" for k in range(-500, 6000)]
    (toy / "reproduced/wave.csv").write_text("\n".join(["time,y", *ours, ""]))
    return toy


def test_points_are_judged_by_the_accuracy_of_their_reading(figures):
    items = {item["id"]: item for item in Judge(load_paper(figures)).verdict()["items"]}
    assert items["F2.M1.top"]["agreement"] == "exact"  # within two sigma
    spoil(figures, "reproduced/points.csv", "M2,side,5.1", "M2,side,5.25")
    assert Judge(load_paper(figures)).explain("F2.M2.side")["agreement"] == "close"
    spoil(figures, "reproduced/points.csv", "M2,side,5.25", "M2,side,5.35")
    assert Judge(load_paper(figures)).explain("F2.M2.side")["status"] == "differs, unexplained"


def test_the_page_draws_both(figures):
    judged = Judge(load_paper(figures)).verdict()
    (curve,) = judged["curves"]
    assert len(curve["print"]) == 50 and 300 < len(curve["reproduced"]) < 1300
    for x, y in curve["reproduced"]:
        assert 0 <= x <= 4.9 and y == pytest.approx(math.sin(x), abs=1e-5)
    text = page(judged)
    assert text.count('class="curve"') == text.count('class="band"') == 1
    assert len(re.findall(r'<circle class="open"', text)) == 4


def test_a_curve_without_results_says_so(figures):
    (figures / "reproduced/wave.csv").unlink()
    judged = Judge(load_paper(figures)).verdict()
    assert "wave.csv: no such file" in judged["curves"][0]["missing"] and "Not reproduced" in page(judged)
    spoil(figures, "claims.yaml", "      wave:", "      waves:")
    with pytest.raises(PaperError, match="did you mean 'wave'"):
        Judge(load_paper(figures)).verdict()
