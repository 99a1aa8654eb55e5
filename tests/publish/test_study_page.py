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
from pneumo.physics.models import MODELS
from pneumo.publish.figures import study_figures
from pneumo.publish.pages.page import with_indices
from pneumo.publish.pages.study_page import MARK, study_page
from pneumo.publish.text import terminal_tables
from pneumo.publish.text.terminal_tables import (
    STUDY_HEADS,
    budget_cells,
    budget_heads,
    gain_text,
    ranking_cells,
)
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.statistics.intervals import Interval
from pneumo.statistics.ranking import rank_models

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
    assert page.count("<img") == 5
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


def test_cells_of_a_line_and_gains_with_and_without_interval():
    row = rank_models(made(noise=1e-9), "mine").row("M8")
    texts = dict(zip(STUDY_HEADS, ranking_cells(row), strict=True))
    assert (texts["rank"], texts["model"], texts["n"]) == ("3", "M8", "1.3")
    assert texts["MSE (kPa²)"] == "3.00 ± 0.00" and texts["RMS (kPa)"] == "1.73"
    assert texts["MSE / best"] == "1.25 (1.25 to 1.25)"
    cells = made()
    cells["mse"].loc[{"model": "M8"}] = np.nan
    assert "failed in 4 runs" in ranking_cells(rank_models(cells, "mine").row("M8"))
    assert gain_text(Interval(12.3, 10.1, 14.6)) == "12 % (10 to 15)"
    assert gain_text(Interval(-3.0, np.nan, np.nan)) == "-3 %"
    assert gain_text(Interval(np.nan, np.nan, np.nan)) == "–"


def test_pictures_of_places_and_gains():
    ranking = rank_models(made(), "mine")
    ax = study_figures.ranking_figure(ranking).axes[0]
    assert ax.get_yticklabels()[0].get_text() == "$M_{10}$"
    for y, row in enumerate(ranking.rows):
        bar, point = ax.lines[2 * y : 2 * y + 2]
        assert point.get_xdata()[0] == pytest.approx(row.mse.value**0.5 / 1e3)
        assert bar.get_xdata() == pytest.approx(np.array([row.mse.low, row.mse.high]) ** 0.5 / 1e3)
        assert set(bar.get_ydata()) == set(point.get_ydata()) == {y}
    ranking = rank_models(made(), "mine")
    lines = study_figures.gain_figure(ranking).axes[0].lines
    points = [line for line in lines if line.get_marker() == "o"]
    assert [point.get_xdata()[0] for point in points] == [gain.percent.value for gain in ranking.gains]


def test_pictures_over_n_and_of_the_traces():
    cells = made()
    cells["run_status"][0, 1] = 1
    ranking = rank_models(cells, "mine")
    ax = study_figures.error_over_n(cells, ranking).axes[0]
    curve = next(line for line in ax.lines if line.get_label() == "$M_{8}$")
    kept = cells["mse"].sel(model="M8").isel(run=[0, 2, 3])
    assert curve.get_ydata() == pytest.approx(kept.mean(("experiment", "run", "chamber")).values ** 0.5 / 1e3)
    marks = [line for line in ax.lines if len(line.get_xdata()) == 1]
    assert len(marks) == sum(model.has_n for model in MODELS.values())
    assert {line.get_xdata()[0] for line in marks} == {1.3}
    cells = with_traces(made())
    _, pressure, error = study_figures.first_run(cells, answered(cells), "X").axes
    experiment = cells.sel(experiment="X")
    full = experiment["trace_P"].sel(chamber="A").values / 1e3
    assert pressure.lines[0].get_ydata() == pytest.approx(full)
    best = experiment["trace_pressure"].sel(model="M10", n=1.3, chamber="A").values / 1e3
    assert error.lines[0].get_label() == "$M_{10}$"
    assert error.lines[0].get_ydata() == pytest.approx(full - best)
    assert len(error.lines) == 2 * 3 + 1  # three models in both chambers, and zero
    assert [line.get_label() for line in error.lines[1:3]] == ["$M_{9}$", "$M_{8}$"]


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
