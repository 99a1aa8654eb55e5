"""Index page of a fleet: its numbers, its size, and the table in a browser."""

import numpy as np
import pytest
import xarray as xr
from page_checks import assert_fit_for_a_phone, assert_quiet, assert_readable, in_chromium
from ranked_cells import answered, made

from pneumo.selection.answer import Answer
from pneumo.selection.error_budget import FULL_ORDER
from pneumo.selection.ranking import Ranking
from workflow.jobs.fleet import answer_dataset, together
from workflow.jobs.fleet_page import HEADS, fleet_page, fleet_rows

FIRST = {"full": 1e3}  # the full order's error is too large for it to be chosen
SECOND = {"scale": 1e8}
LARGEST = 5_000_000  # bytes, of ten thousand cylinders


@pytest.fixture(scope="module")
def index():
    """Three cylinders: the second has the largest error and a k_0 that matters, the third failed."""
    of_three = answered(made(**FIRST)), answered(made(**SECOND)), Answer(Ranking("c10", (), 0, ()))
    parts = [answer_dataset(answer).drop_vars("advice") for answer in of_three]
    for i, other_k_0 in enumerate((0.3, 0.3, 0.4)):
        parts[i] = parts[i].assign_coords(k_0=("experiment", [0.3, other_k_0]))
    sizes = zip(parts, (0.025, 0.0123456, 0.1), strict=True)
    parts = [part.assign(bore=bore, stroke=10 * bore, failed_runs=np.int32(0)) for part, bore in sizes]
    parts[2]["failed_runs"] += 4
    return together(parts, ["c1", "c2", "c10"]).assign_attrs(config_sha256="0123456789abcdef" * 4)


def test_rows_hold_the_recommendation_in_mm_and_kPa(index):
    first, second, failed = fleet_rows(index)
    row = dict(zip(HEADS, first, strict=True))
    inputs = {"cylinder": "c1", "bore (mm)": 25.0, "stroke (mm)": 250.0, "k₀ (W/K)": 0.3}
    assert inputs.items() <= row.items()
    answer = answered(made(**FIRST))
    chosen, best = answer.budget.row(answer.chosen), answer.rows[0]
    assert chosen != best and chosen.model != FULL_ORDER
    assert (row["recommended"], row["n"], row["runs"]) == (chosen.model, chosen.n, 4)
    assert (row["best reduced"], row["as good"]) == (best.model, ", ".join(answer.as_good))
    assert row["expected RMS (kPa)"] == pytest.approx(chosen.rms / 1e3, rel=1e-3)
    assert row["its expected RMS (kPa)"] == pytest.approx(best.rms / 1e3, rel=1e-3)
    assert second[1] == 12.35
    assert failed == ("c10", 100.0, 1000.0, None, "", None, None, "", "", None, 0, 4)


def test_the_full_order_is_recommended_where_it_is_best(index):
    row = dict(zip(HEADS, fleet_rows(index)[1], strict=True))
    rows = answered(made(**SECOND)).rows
    assert (row["recommended"], row["n"], row["best reduced"]) == (FULL_ORDER, None, rows[1].model)
    assert row["expected RMS (kPa)"] == pytest.approx(rows[0].rms / 1e3, rel=1e-3)
    assert row["its expected RMS (kPa)"] == pytest.approx(rows[1].rms / 1e3, rel=1e-3)


def test_ten_thousand_cylinders_make_a_page_of_at_most_5_MB(index):
    names = [f"cylinder-with-a-long-name-{i:05}" for i in range(10_000)]
    many: xr.Dataset = index.isel(cylinder=[0, 1] * 5000).assign_coords(cylinder=names)
    assert 500_000 < len(fleet_page("plant", many).encode()) < LARGEST


NAMES = "[...document.querySelectorAll('#fleet tbody td:first-child')].map(e => e.textContent).join(' ')"
CLICK = "[...document.querySelectorAll('#fleet thead button')].find(b => b.textContent === '{}').click()"
SET = "(() => {{ const e = element('{}'); e.value = '{}'; e.dispatchEvent(new Event('input')); }})()"


@in_chromium
@pytest.mark.xdist_group("chromium")
def test_the_table_sorts_and_filters(index, visit, tmp_path):
    file = tmp_path / "fleet.html"
    file.write_text(fleet_page("plant", index), encoding="utf-8")
    browser = visit(file)
    assert browser.run(NAMES) == "c1 c2 c10"  # numbers in names count as numbers
    browser.run(CLICK.format("expected RMS (kPa)"))
    assert browser.run(NAMES) == "c1 c2 c10"
    browser.run(CLICK.format("expected RMS (kPa)"))
    assert browser.run(NAMES) == "c2 c1 c10"  # what has no number stays last
    assert browser.run("document.querySelector('th[aria-sort]').ariaSort") == "descending"
    browser.run(SET.format("search", "C1"))
    assert browser.run(NAMES) == "c1 c10"
    assert browser.run("element('shown').textContent") == "2 of 3 cylinders"
    browser.run("element('reset').click()")
    browser.run(SET.format("column", "bore (mm)") + ";" + SET.format("low", "20"))
    assert browser.run(NAMES) == "c1 c10"
    browser.run(SET.format("high", "50"))
    assert browser.run(NAMES) == "c1"
    browser.run("element('reset').click()")
    browser.run(SET.format("recommended", fleet_rows(index)[0][4]))
    assert browser.run(NAMES) == "c1"
    assert_readable(browser, least=20)
    assert_quiet(browser, file)


@pytest.mark.slow
@in_chromium
@pytest.mark.xdist_group("chromium")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, index, visit, tmp_path):
    assert_fit_for_a_phone(visit, fleet_page("plant", index), tmp_path / "fleet.html", scheme, least=40)
