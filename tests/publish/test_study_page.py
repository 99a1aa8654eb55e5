"""Page and tables of `pneumo study`: the numbers of the ranking, nothing from outside, texts escaped."""

import io
import re

import numpy as np
import pytest
from page_checks import assert_fit_for_a_phone, in_chromium
from paper_study import STUDY
from ranked_cells import answered, made

from pneumo.configuration.experiment import Study
from pneumo.publish.figures.study_figures import budget_bars, budget_figure, causes
from pneumo.publish.pages.page import with_indices
from pneumo.publish.pages.study_page import MARK, study_page
from pneumo.publish.text import terminal_tables
from pneumo.publish.text.terminal_tables import STUDY_HEADS, budget_cells, budget_heads, ranking_rows
from pneumo.quantities.table import GROUPS

pytestmark = pytest.mark.xdist_group("chromium")  # a page is made once, too


@pytest.fixture(scope="module")
def page():
    mine = STUDY._replace(name="mine", experiments={"X": STUDY.experiments["E06"]})
    answer = answered(made(unknown={"valve": 50.0}))
    return study_page(mine, [answer], ["pneumo export full --config 'a<b.yaml'"])


def test_page_holds_every_model_and_the_answer_and_loads_nothing(page):
    answer = answered(made(unknown={"valve": 50.0}))
    assert "Take the full order" in page and with_indices(answer.reason) in page
    assert "<code>pneumo export full --config &#39;a&lt;b.yaml&#39;</code>" in page
    for row in (*ranking_rows(answer.ranking), *(budget_cells(row, answer) for row in answer.rows)):
        assert "".join(f"<td>{text}</td>" for text in row) in page
    over_best = [row[STUDY_HEADS.index("MSE / best")] for row in ranking_rows(answer.ranking)]
    assert over_best[0] == "1.00" and all(" to " in text for text in over_best[1:])
    assert "k_0" not in re.sub(r"<[^>]*>", "", page.partition("<main>")[2])
    cell = f"<td>{budget_cells(answer.rows[0], answer)[3]}</td>"
    assert page.index("<svg") < page.index(cell)  # bars first
    assert MARK in page[:1000]
    assert not re.findall(r'(?:src|href)="(?!data:|https://doi\.org/)[^"]*"', page)
    assert "<script" not in page


def test_texts_are_escaped():
    cells = made()
    cells["run_status"][:] = 1
    answer = answered(cells)
    answer = answer._replace(ranking=answer.ranking._replace(left_out=("<b>&", "<b>&")), reason="<i>")
    mine: Study = STUDY._replace(name="<script>", experiments={"X": STUDY.experiments["E06"]})
    page = study_page(mine, [answer])
    assert "<b>&" not in page and page.count("&lt;b&gt;&amp;") == 1 and "&lt;i&gt;" in page
    assert "<script>" not in page and "<svg" not in page


def test_the_bar_of_a_model_is_its_expected_error_and_its_line_the_interval():
    answer = answered(made(unknown={"valve": 50.0, "supply": 3.0}, measured={"M6": 5e3}))
    bars = budget_bars(answer)
    assert [*causes(answer)] == ["valve", "supply", "model itself"]
    for bar, row in zip(bars, answer.rows, strict=False):
        assert bar.row is row and (bar.low, bar.high) == (bar.row.low / 1e3, bar.row.high / 1e3)
        assert sum(width for _, width, _ in bar.parts) == pytest.approx(bar.row.rms / 1e3)
    assert [bar.measured for bar in bars if np.isfinite(bar.measured)] == [5.0]
    ax = budget_figure(answer).axes[0]
    assert [len(ax.containers), len(ax.containers[0])] == [3, len(bars)]


def test_cells_of_the_budget():
    answer = answered(made(unknown={"valve": 50.0}, measured={"M8": 2e3}, noise=1e-9))
    texts = dict(zip(budget_heads(answer), budget_cells(answer.budget.row("M8"), answer), strict=True))
    assert texts["all"] == "7.3" and texts["95\N{NO-BREAK SPACE}%"] == "2 to 7.3" and texts["valve"] == "7.1"
    assert (texts["n"], texts["record"], texts["model itself"]) == ("1.3", "2", "1.7")
    full = dict(zip(budget_heads(answer), budget_cells(answer.budget.row("full order"), answer), strict=True))
    assert (full["n"], full["record"], full["model itself"]) == ("", "–", "0.71")  # as if the supply sagged


def test_the_table_fits_a_terminal():
    file = io.StringIO()
    wide = answered(made(unknown=dict.fromkeys(GROUPS, 9.0), measured={"M6": 9e3}))
    terminal_tables.print_table(terminal_tables.budget_table(wide), file=file, color_system=None)
    text = file.getvalue()
    assert all(f"M{i} " in text for i in range(1, 11)) and "…" not in text
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80


@pytest.mark.slow
@in_chromium
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, page, visit, tmp_path):
    assert_fit_for_a_phone(visit, page, tmp_path / "study.html", scheme, least=100)
