"""Page and tables of `pneumo study`: the numbers of the ranking, nothing from outside, texts escaped."""

import io
import re

import numpy as np
import pytest
from page_checks import assert_fit_for_a_phone, in_chromium
from paper_study import STUDY
from ranked_cells import answered, made
from rich.console import Console

from pneumo.configuration.experiment import Study
from pneumo.configuration.parameters import load, study
from pneumo.configuration.uncertain import GROUPS
from pneumo.publish.figures import study_figures
from pneumo.publish.pages.page import with_indices
from pneumo.publish.pages.study_page import MARK, study_page
from pneumo.publish.text import terminal_tables
from pneumo.publish.text.terminal_tables import (
    budget_cells,
    budget_heads,
    ranking_cells,
)
from pneumo.selection.cylinder_template import TEMPLATE

pytestmark = pytest.mark.xdist_group("chromium")  # a page is made once, too


def with_traces(cells):
    rng = np.random.default_rng(2)
    samples, shape = 50, (cells.sizes["experiment"], 2, 50)
    cells = cells.assign_coords(chamber=["A", "B"])
    cells["trace_t"] = (("experiment", "sample"), np.tile(np.arange(samples) * 0.01, (shape[0], 1)))
    cells["trace_x"] = (("experiment", "sample"), rng.normal(0, 1e-3, (shape[0], samples)))
    cells["trace_P"] = (("experiment", "chamber", "sample"), rng.normal(5e5, 1e4, shape))
    dims = ("experiment", "model", "n", "chamber", "sample")
    size = [cells.sizes[dim] for dim in dims[:4]]
    cells["trace_pressure"] = (dims, rng.normal(5e5, 1e4, (*size, samples)))
    return cells


@pytest.fixture(scope="module")
def page():
    cells = with_traces(made())
    mine = STUDY._replace(name="mine", experiments={"X": STUDY.experiments["E06"]})
    return study_page(mine, cells, [answered(cells)], ["pneumo export full --config 'a<b.yaml'"])


def test_page_holds_every_model_and_the_answer_and_loads_nothing(page):
    answer = answered(made())
    ranking = answer.ranking
    assert "Take the full order" in page and with_indices(answer.reason) in page
    assert "<code>pneumo export full --config &#39;a&lt;b.yaml&#39;</code>" in page
    for row in ranking.rows:
        line = "".join(f"<td>{text}</td>" for text in ranking_cells(row))
        assert line in page
    for contender in answer.contenders:
        line = "".join(f"<td>{text}</td>" for text in budget_cells(contender, answer))
        assert line in page
    assert "k_0" not in re.sub(r"<[^>]*>", "", page.partition("<main>")[2])
    assert page.count("<img") == 3
    assert MARK in page[:1000]
    assert not re.findall(r'(?:src|href)="(?!data:|https://doi\.org/)[^"]*"', page)
    assert "<script" not in page


@pytest.mark.slow
def test_inputs_are_in_the_units_of_a_catalogue(page):
    supply = STUDY.experiments["E06"].plant.conditions.P_s / 1e3
    assert "mm²/V up to" in page and f"P<sub>s</sub> = {supply:g} kPa" in page and "no leak" in page
    cells = made(experiments=("open", "closed"))
    by_catalogue = study_page(study(load(TEMPLATE)), with_traces(cells), [answered(cells)])
    assert "C = 1.5 dm³/(s bar), b = 0.3 up to 10 V" in by_catalogue
    assert "-7.958 N, of it -7.958 N by the atmosphere on the rod" in by_catalogue and "rod" not in page


def test_texts_are_escaped():
    cells = made()
    cells["run_status"][:] = 1
    answer = answered(cells)
    answer = answer._replace(ranking=answer.ranking._replace(left_out=("<b>&", "<b>&")), reason="<i>")
    mine: Study = STUDY._replace(name="<script>", experiments={"X": STUDY.experiments["E06"]})
    page = study_page(mine, cells, [answer])
    assert "<b>&" not in page and page.count("&lt;b&gt;&amp;") == 1 and "&lt;i&gt;" in page
    assert "<script>" not in page and "<img" not in page


def test_the_bar_of_a_model_is_its_expected_error_and_its_line_the_interval():
    answer = answered(made(unknown={"valve": 50.0, "supply": 3.0}, measured={"M6": 5e3}))
    ax = study_figures.budget_figure(answer).axes[0]
    names = [label.get_text() for label in ax.get_yticklabels()]
    for y, contender in enumerate(
        c for c in answer.contenders if c.row.rms < 4 * answer.contenders[0].row.rms
    ):
        bars = [bar.get_width() for group in ax.containers for bar in [group[y]]]
        assert sum(bars) == pytest.approx(contender.row.rms / 1e3) and contender.row.model[1:] in names[y]
        ends = ax.lines[2 * y].get_xdata()
        assert ends == pytest.approx([contender.row.low / 1e3, contender.row.high / 1e3])
    assert len(ax.containers) == 3  # valve, supply, model
    assert [
        line.get_xdata()[0]
        for line in ax.lines
        if line.get_marker() == "D" and np.isfinite(line.get_xdata()[0])
    ] == [5.0]


def test_cells_of_the_budget():
    answer = answered(made(unknown={"valve": 50.0}, measured={"M8": 2e3}, noise=1e-9))
    texts = dict(zip(budget_heads(answer), budget_cells(answer.contender("M8"), answer), strict=True))
    assert texts["all together"] == "7.3" and texts["95 %"] == "7.3 to 7.3" and texts["valve"] == "7.1"
    assert (texts["n"], texts["measured"], texts["model itself"]) == ("1.3", "2", "1.7")
    full = dict(zip(budget_heads(answer), budget_cells(answer.contender("full order"), answer), strict=True))
    assert (full["n"], full["measured"], full["model itself"]) == ("", "–", "0")


def test_tables_fit_a_terminal():
    console = Console(width=80, record=True, file=io.StringIO())
    wide = answered(made(unknown=dict.fromkeys(GROUPS, 9.0), measured={"M6": 9e3}))
    for table in [terminal_tables.budget_table(wide), *terminal_tables.study_tables(wide)]:
        console.print(table)
    text = console.export_text()
    assert all(f" M{i} " in text for i in range(1, 11))
    assert "…" not in text and "temperature law" in text
    assert "1.25 (1.25 to 1.25)" in text  # on one line
    assert "full order " in text and "together" in text and "volumes" in text
    assert "mine: X, 4 runs each" in text


@pytest.mark.slow
@in_chromium
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, page, visit, tmp_path):
    assert_fit_for_a_phone(visit, page, tmp_path / "study.html", scheme, least=100)
