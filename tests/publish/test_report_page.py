"""The report's page holds what the results hold; its answer, its links, and what is escaped."""

import html
import re

import numpy as np
import pytest
import xarray as xr
from invented_report import BYTES, hostile, made, page, parts, unpacked_groups, verdict
from markupsafe import escape
from packed_traces import unpacked
from page_checks import stands_alone
from paper_study import STUDY as PAPER

from paper.study.pages.packing import FRACTION
from paper.study.pages.report_page import experiment_text, overview, report_page
from paper.study.trace_layout import interval_edges, shown_steps
from paper_verdict.page import LOOKS
from pneumo.physics.models import MODELS

pytestmark = pytest.mark.xdist_group("report page")  # the page takes seconds to make


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
        assert cells["mse"][: len(MODELS)] == pytest.approx(of_models.values, rel=1e-4)  # five digits
        assert [PAPER.n[i] for i in cells["best"][: len(MODELS)]] == best[transport].values.tolist()
    assert facts["name"] == "E07" and facts["text"] == experiment_text(PAPER.experiments["E07"])


def test_the_first_lines_and_figure_are_those_of_the_results():
    mse = xr.concat([of_run["exact"].mean("chamber") for _, of_run, *_ in made().values()], "run")
    rms = (mse.min("n").mean("run") ** 0.5 / 1e3).to_series().sort_values()
    at_one_n = (mse.mean("run").min("n") ** 0.5 / 1e3).to_series().sort_values()
    found = overview(PAPER, parts())
    shown = {model["name"]: float(kpa) for model, kpa, _ in found.rows if model["name"] in MODELS}
    assert list(shown) == list(rms.index) and shown == pytest.approx(rms.to_dict(), rel=0.05)  # two digits
    variance = [of_run.P.var("t").mean().item() for of_run, *_ in made().values()]
    percent = 100 * 1e3 * at_one_n.iloc[0] / np.mean(variance) ** 0.5
    assert f"take the full order. Of the reduced models, {at_one_n.index[0]}" in found.headline
    assert f"off by {at_one_n.iloc[0]:#.2g} kPa RMS with one n for all runs" in found.headline
    assert f"{percent:.2g} % of the pressures" in found.text
    assert f"{rms[at_one_n.index[0]]:#.2g} kPa with the best n for each" in found.headline


def test_one_file_that_loads_nothing_is_the_same_twice_and_leads_to_the_verdict():
    links = {"https://doi.org/10.1243/09596518JSCE203", "https://github.com/leeoniya/uPlot"}
    assert set(stands_alone(page()).links) == {"#explore", "verdict.html", "figures/fig07.svg", *links}
    assert report_page(PAPER, parts(), verdict(), None, False) == page()
    for status, (look, symbol, _) in LOOKS.items():
        badge = rf'class="badge {look}" href="verdict.html"[^>]*>.*?{re.escape(html.escape(symbol))}</span>'
        counted = f"{verdict()['headline']['statuses'][status]} {escape(status)}"
        assert re.search(rf"{badge} {counted}</a>", page())
    assert "75 of the facts" in page()


def test_markup_in_names_is_text():
    text = hostile()
    assert "<img" not in text and "<b>&" not in text and "<script>alert" not in text
    assert "&lt;script&gt;alert(2)" in text


@pytest.mark.results
def test_the_papers_page_stays_below_its_bound(results):
    assert BYTES / 2 < (results / "report.html").stat().st_size < 0.97 * BYTES  # with room for findings
