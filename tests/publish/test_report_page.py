"""The report's page holds what the results hold; its answer, its links, and what is escaped."""

import html
import json
import re

import numpy as np
import pytest
import xarray as xr
from invented_report import BYTES, HOSTILE, hostile, made, page, parts, unpacked_groups, verdict
from markupsafe import escape
from packed_traces import unpacked
from page_checks import stands_alone
from paper_study import STUDY as PAPER

from paper.study.pages import STATUS_LOOKS
from paper.study.pages import report_page as report
from paper.study.pages.packing import FRACTION
from paper.study.pages.report_page import STANDS, answer, experiment_text, part, report_page
from pneumo.physics.models import MODELS
from pneumo.publish.model_looks import DARK, MODEL_LOOKS, luminance, on_dark
from pneumo.storage.trace_layout import interval_edges, shown_steps

pytestmark = pytest.mark.xdist_group("report page")  # the page takes seconds to make


def findings():
    claims = [
        {"id": f"c{i}", "claim": f"claim {i}", "source": "p. 9", "published": "0.97", "exact": f"{i} <&>"}
        | {"interval": "0.1 to 0.2", "stands": stands, "why": HOSTILE, "headline": i < 2}
        for i, stands in enumerate(STANDS)
    ]
    return {"claims": claims, "note": "a note <&>"}


@pytest.mark.parametrize("transport", ["published", "exact"])
def test_traces_are_those_of_the_results_to_half_a_step(transport):
    shown, (datum, mse, traces, _), e = parts()[5], made()["E06"], PAPER.experiments["E06"]
    steps, edges, cells = shown_steps(e), interval_edges(e), traces[transport]
    signals = [datum["u"], datum["x"], *datum["P"].T]
    kept = unpacked(shown.traces["signals"], [1] * 4, len(steps))
    limits = unpacked(shown.traces["signal-limits"], [2] * 4, len(edges) - 1)
    for signal, step, samples, ends in zip(signals, shown.facts["steps"], kept, limits, strict=True):
        assert np.abs(samples[0] * step - signal.values[steps]).max() <= step * 0.5000001
        parts_of_run = np.split(signal.values, edges[1:-1])
        assert np.abs(ends[0] * step - [part.min() for part in parts_of_run]).max() <= step * 0.5000001
        assert np.abs(ends[1] * step - [part.max() for part in parts_of_run]).max() <= step * 0.5000001
        assert step <= 2e-4 * np.abs(signal.values).max()
    errors = unpacked_groups(shown, f"{transport}-errors", cells, len(steps))
    ends = unpacked_groups(shown, f"{transport}-limits", cells, len(edges) - 1, 2)
    squares = unpacked_groups(shown, f"{transport}-squares", cells, len(edges) - 1)
    for m, name in enumerate(MODELS):
        for c in range(2):
            group, step = 2 * m + c, shown.facts["cells"][transport]["steps"][2 * m + c]
            cell, count = cells.isel(chamber=c).sel(model=name), len(errors[2 * m + c])
            assert np.abs(errors[group] - cell["error"].values[:count]).max() <= step * 0.5000001
            for row in range(count):
                assert np.abs(ends[group][2 * row] - cell["lowest"].values[row]).max() <= step * 0.5000001
                assert (
                    np.abs(ends[group][2 * row + 1] - cell["highest"].values[row]).max() <= step * 0.5000001
                )
            # Half a step of a logarithm: 2**(0.5 / 512) is 0.07 % off.
            np.testing.assert_allclose(squares[group], cell["mean_square"].values[:count], rtol=7e-4)
            least = np.sqrt(mse[transport].sel(model=name)[:, c].min().item())
            largest = np.abs(cell[["lowest", "highest"]].to_array()).max().item()
            assert step <= max(least / FRACTION, 2.5 * largest / 32_000) * (1 + 1e-9)


def test_numbers_are_those_of_the_results():
    facts = parts()[6].facts
    _, mse, _, best = made()["E07"]
    for transport, of_models in mse.items():
        cells = facts["cells"][transport]
        assert cells["mse"] == pytest.approx(of_models.values, rel=1e-4)  # five digits
        assert [PAPER.n[i] for i in cells["best"]] == best[transport].values.tolist()
    assert facts["name"] == "E07" and facts["text"] == experiment_text(PAPER.experiments["E07"])


def test_a_model_that_failed_has_no_trace_and_no_number():
    datum, mse, traces, best = made()["E06"]
    lost, never, gone = mse["exact"].copy(deep=True), best["exact"].copy(), traces["exact"].copy(deep=True)
    lost.loc[{"model": "M8"}] = np.nan
    never.loc[{"model": "M8"}] = np.nan
    for values in gone.values():
        values[{"choice": 0, "model": 7}] = np.nan
    shown = part(PAPER.experiments["E06"], datum, {"exact": lost}, {"exact": gone}, {"exact": never})
    cells = shown.facts["cells"]["exact"]
    assert cells["mse"][7][3] == [None, None] and None not in cells["mse"][6][3]
    assert cells["best"][7] is None and cells["best"][6] is not None
    m8 = unpacked_groups(shown, "exact-errors", gone, len(shown_steps(PAPER.experiments["E06"])))[14]
    assert np.isnan(m8[0]).all() and np.isfinite(m8[1]).all()


def test_the_answer_names_the_nearest_and_says_where_it_is_not():
    def run(failed=None, **squares):
        mse = [[[squares.get(name, 9e8)] * 2] * len(PAPER.n) for name in MODELS]
        return report.Part(
            {"failed": failed, "cells": {"exact": {"mse": mse, "best": [0] * len(MODELS)}}}, {}
        )

    near, other = run(M8=1e6, M9=4e6, M6=9e6, M1=2.5e7), run(M8=4e6, M9=1e6, M6=9e6, M1=2.5e7)
    assert answer([near, near]) == (
        "With its best n in each run, M8 is nearest to the full order: 1.0 kPa RMS over all 2 runs,"
        " then M9 (2.0), M6 (3.0), M1 (5.0); a constant temperature leaves 5.0 or more."
        " It is so in every run."
    )
    assert answer([near, near, other]).endswith("No model is nearest in every run: M8 in 2, M9 in 1.")
    assert "in the only run" in answer([near, run("failed", M1=1.0)])
    assert answer([run("failed")]) == "No model ran through every experiment."


def test_colours_of_the_dark_form_are_seen_on_it():
    for look in MODEL_LOOKS.values():
        assert (luminance(on_dark(look.color)) + 0.05) / (luminance(DARK) + 0.05) >= 4.5
    assert on_dark("#f0922f") == "#f0922f" and on_dark("#04194a") != "#04194a"


def test_a_run_that_failed_says_so():
    datum, mse, traces, best = made()["E06"]
    failed = datum.copy(deep=True)
    meanings = {"flag_meanings": "ran left_the_finite_numbers", "last_state": np.ones(6)}
    failed["status"] = ((), np.int8(1), meanings)
    failed["failure_time"] = 1.5
    failed["P"][1500:] = np.nan
    nan = np.nan
    lost = {name: values * nan for name, values in mse.items()}
    gone = {name: values * nan for name, values in traces.items()}
    none = {name: xr.full_like(values, np.nan) for name, values in best.items()}
    shown = part(PAPER.experiments["E06"], failed, lost, gone, none)
    assert shown.facts["failed"].startswith("full-order run failed at t = 1.5 s: left the finite numbers")
    text = report_page(PAPER, [shown], verdict(), None, False)
    assert "<strong>E06 is left out of every average:</strong> full-order run failed" in text


def test_one_file_that_loads_nothing_is_the_same_twice_and_leads_to_the_verdict():
    links = {"https://doi.org/10.1243/09596518JSCE203", "https://github.com/leeoniya/uPlot"}
    assert set(stands_alone(page()).links) == {"#explore", "verdict.html", *links}
    assert report_page(PAPER, parts(), verdict(), None, False) == page()
    for status, (look, symbol, _) in STATUS_LOOKS.items():
        badge = rf'class="badge {look}" href="verdict.html"[^>]*>.*?{re.escape(html.escape(symbol))}</span>'
        counted = f"{verdict()['headline']['statuses'][status]} {escape(status)}"
        assert re.search(rf"{badge} {counted}</a>", page())
    assert "75 facts" in page()


@pytest.mark.results
def test_the_papers_page_stays_below_its_bound(results):
    assert BYTES / 2 < (results / "report.html").stat().st_size < 0.97 * BYTES  # with room for findings


def test_claims():
    assert "was computed for the configuration of the paper only" in page()
    text = report_page(PAPER, parts()[:1], verdict(), findings(), False)
    assert "not computed: <code>" not in text
    rows = re.findall(r'<tr data-id="c(\d)">(.*?)</tr>', text, re.DOTALL)
    assert [int(number) for number, _ in rows] == [0, 1, *range(len(STANDS))]  # headlines, then all
    for number, row in rows:
        symbol, badge = STANDS[list(STANDS)[int(number)]]
        assert f'"badge {badge}"' in row and f">{symbol}</span>" in row
        cells = re.findall(r'<td data-head="[^"]+: ">(.*?)</td>', row)
        assert cells == ["0.97", f"{number} &lt;&amp;&gt;", "0.1 to 0.2"]
    assert "Of 2 main claims" in text
    assert "a note &lt;&amp;&gt;" in text and HOSTILE not in text


def test_links_to_what_is_there_and_text_is_escaped():
    for present in (False, True):
        assert ('href="paper.pdf"' in report_page(PAPER, parts()[:1], verdict(), None, present)) == present
    mine = report_page(PAPER._replace(name="mine"), parts()[:1], None, None, False)
    assert "verdict.html" not in mine and "2006" not in mine and "pneumo · report · mine" in mine
    text = hostile()
    assert HOSTILE not in text and "<b>&" not in text and "<script>alert" not in text
    assert "&lt;script&gt;alert(2)" in text
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert data["experiments"][0]["name"] == HOSTILE
