"""Page and tables of `pneumo study`: the numbers of the ranking, nothing from outside, texts escaped."""

import io
import re

import numpy as np
import pytest
from page_checks import assert_fit_for_a_phone, in_chromium
from paper_study import STUDY
from ranked_cells import SWING, answered, made
from rich.console import Console

from pneumo.configuration.experiment import Study
from pneumo.configuration.parameters import load, study
from pneumo.export.step_cost import step_costs
from pneumo.physics.models import MODELS
from pneumo.publish.figures import study_figures
from pneumo.publish.pages.page import with_indices
from pneumo.publish.pages.study_page import MARK, study_page
from pneumo.publish.text import terminal_tables
from pneumo.publish.text.formatting import no_exponent
from pneumo.publish.text.terminal_tables import (
    STUDY_HEADS,
    contest_cells,
    contest_heads,
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
    assert "Recommended: full order" in page and with_indices(answer.reason) in page
    assert "<code>pneumo export full --config &#39;a&lt;b.yaml&#39;</code>" in page
    for row in ranking.rows:
        line = "".join(f"<td>{text}</td>" for text in ranking_cells(row))
        assert line in page
    assert f"{with_indices('k_0 = 0.15')}</th>" in page
    for contender in answer.contenders:
        line = "".join(f"<td>{text}</td>" for text in contest_cells(contender, answer.swing))
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


def test_picture_of_regret_over_k_0():
    answer = answered(made(ends=(2.0, 4.0)))
    ax = study_figures.regret_figure(answer).axes[0]
    curves = {line.get_label(): line for line in ax.lines}
    assert curves["full order"].get_ydata() == pytest.approx(np.zeros(3), abs=1e-9)
    assert curves["full order"].get_linewidth() > curves["$M_{8}$, $n$ = 1.3"].get_linewidth()
    M8, full = answer.contender("M8").row, answer.contender("full order").row
    expected = (np.array(M8.rms) - full.rms) / 1e3
    assert curves["$M_{8}$, $n$ = 1.3"].get_ydata() == pytest.approx(expected)
    assert curves["$M_{8}$, $n$ = 1.3"].get_xdata() == pytest.approx([0.15, 0.3, 0.6])
    assert not any(label.startswith("$M_{1}$") for label in curves)  # far above


def test_cells_of_the_contest():
    answer = answered(made(ends=(2.0, 4.0), noise=1e-9))
    heads = contest_heads(answer.ranking.unknown_k_0)
    texts = dict(zip(heads, contest_cells(answer.contender("M8"), answer.swing), strict=True))
    worst = (3e6 * 4) ** 0.5
    assert texts["worst"] == no_exponent(worst / 1e3) and texts["k_0 = 0.6"] == texts["worst"]
    assert texts["worst, % of swing"] == no_exponent(100 * worst / SWING)
    assert texts["MSE / chosen"] == "6.00 (6.00 to 6.00)"
    assert texts["ns a step"] == f"{step_costs()['M8'].ns:.0f}"
    full = dict(zip(heads, contest_cells(answer.contender("full order"), np.nan), strict=True))
    assert (full["k_0 = 0.3"], full["n"], full["MSE / chosen"]) == ("", "–", "1.00")
    assert full["worst, % of swing"] == "–"


def test_tables_fit_a_terminal():
    console = Console(width=80, record=True, file=io.StringIO())
    for table in terminal_tables.study_tables(answered(made(ends=(2.0, 4.0)))):
        console.print(table)
    text = console.export_text()
    assert all(f" M{i} " in text for i in range(1, 11))
    assert "…" not in text and "temperature law" in text
    assert "1.25 (1.25 to 1.25)" in text  # on one line
    assert "worst" in text and " full order " in text and "0.15" in text
    assert "mine: X, 4 runs each" in text


@pytest.mark.slow
@in_chromium
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, page, visit, tmp_path):
    assert_fit_for_a_phone(visit, page, tmp_path / "study.html", scheme, least=100)
