"""The page to explore: what it holds is what the results hold, and how it behaves in a headless Chromium."""

import html
import json
import re
from pathlib import Path
from urllib.parse import parse_qsl, urlencode

import numpy as np
import pytest
import xarray as xr
from brief import in_brief
from browser import Tab
from packed_traces import unpacked
from page_checks import FRAMES, assert_accessible, assert_quiet, assert_readable, in_chromium, stands_alone
from paper_study import STUDY as PAPER
from paper_study import lasting

from pneumo.physics.models import MODELS
from pneumo.publish.model_looks import DARK, MODEL_LOOKS, luminance, on_dark
from pneumo.publish.pages import report_page as report
from pneumo.publish.pages.packing import FRACTION, MISSING
from pneumo.publish.pages.page import STATUS_LOOKS
from pneumo.publish.pages.report_page import STANDS, answer, experiment_text, part, report_page
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import study_sampling
from pneumo.storage.layout import datum_dataset
from pneumo.storage.trace_layout import (
    COMMON_N,
    interval_edges,
    n_shown,
    shown_steps,
    traced,
)

pytestmark = pytest.mark.xdist_group("report page")  # its fixtures take seconds

HOSTILE = "</script><img src=x onerror=alert(1)>"
MANY_VALUES = 60  # waves in a made-up trace
BYTES = 8_000_000  # largest size of the page


def runs(experiment, seed):
    """A full-order run, mean square errors, traces and best n: waves that depend on sampling, model and n."""
    rng = np.random.default_rng(seed)
    shown, edges = shown_steps(experiment), interval_edges(experiment)
    frequencies, phases = rng.uniform(10, 2000, MANY_VALUES), rng.uniform(0, 7, MANY_VALUES)
    angle = (shown / experiment.steps)[:, None] * frequencies + phases
    waves = np.sin(angle) @ rng.normal(0, 1, (MANY_VALUES, 4)) / MANY_VALUES**0.5
    steps = np.arange(experiment.steps + 1)
    P = np.stack([np.interp(steps, shown, p) for p in (5e5 + 8e4 * waves[:, :2]).T], axis=1)
    u = 5 * np.sign(np.sin(steps * experiment.h * 30.0))
    datum = xr.Dataset({"P": (("t", "chamber"), P), "u": ("t", u), "x": ("t", 0.04 * np.sin(steps * 1e-3))})
    datum = datum.assign_coords(chamber=["A", "B"]).assign(status=np.int8(0), failure_time=np.nan)
    mse, traces, best = {}, {}, {}
    has_n = np.array([[model.has_n] for model in MODELS.values()])
    for transport, factor in {"published": 2.0, "exact": 1.0}.items():
        size = np.resize([10, 4, 6, 50, 3, 2.5, 1.5, 1.2, 1.1, 1.0], (len(MODELS), 1)) * factor * 1e3
        far = np.where(has_n, 1 + 8 * np.abs(np.array(PAPER.n) - rng.choice(PAPER.n, (len(MODELS), 1))), 1.0)
        grid = {"model": list(MODELS), "n": list(PAPER.n), "chamber": ["A", "B"]}
        square = (size * far)[:, :, None] ** 2 * np.mean((waves[:, 2:] + 0.2) ** 2, axis=0)
        mse[transport] = xr.DataArray(square, grid, list(grid))
        best[transport] = mse[transport].mean("chamber").idxmin("n")
        places = n_shown(PAPER.n, best[transport].values)
        scale = (size * far)[np.arange(len(MODELS)), places][:, :, None, None]
        error = (scale * (waves[:, 2:].T + 0.2)).astype(np.float32)
        spread = rng.lognormal(0, 0.5, (1, 1, 2, len(edges) - 1))
        dims = ("choice", "model", "chamber")
        traces[transport] = xr.Dataset(
            {
                "error": ((*dims, "t"), error),
                "mean_square": ((*dims, "edge"), (scale * spread) ** 2),
                "lowest": ((*dims, "edge"), -2 * scale * spread),
                "highest": ((*dims, "edge"), 3 * scale * spread),
                "n_shown": (dims[:2], np.array(PAPER.n)[places]),
            },
            {"model": list(MODELS), "chamber": ["A", "B"]},
        )
    return datum, mse, traces, best


@pytest.fixture(scope="module")
def made():
    """Runs of every experiment of the paper."""
    return {name: runs(experiment, seed) for seed, (name, experiment) in enumerate(PAPER.experiments.items())}


@pytest.fixture(scope="module")
def parts(made):
    return [part(PAPER.experiments[name], *run) for name, run in made.items()]


@pytest.fixture(scope="module")
def verdict():
    return {"counts": {"items": 432} | {status: 10 + i for i, status in enumerate(STATUS_LOOKS)}}


def findings():
    claims = [
        {"id": f"c{i}", "claim": f"claim {i}", "source": "p. 9", "published": "0.97", "exact": f"{i} <&>"}
        | {"interval": "0.1 to 0.2", "stands": stands, "why": HOSTILE, "headline": i < 2}
        for i, stands in enumerate(STANDS)
    ]
    return {"claims": claims, "note": "a note <&>"}


@pytest.fixture(scope="module")
def page(parts, verdict):
    return report_page(PAPER, parts, verdict, None, False)


def rows_of(traces: xr.Dataset) -> list[int]:
    """Rows of each group on the page, by model and chamber."""
    n = traces["n_shown"].values
    return [
        2 if model.has_n and n[0, m] != n[1, m] else 1
        for m, model in enumerate(MODELS.values())
        for _ in "AB"
    ]


def unpacked_groups(
    shown: report.Part, name: str, traces: xr.Dataset, samples: int, rows: int = 1
) -> list[np.ndarray]:
    """Groups of a pack of errors in Pa, by model and chamber, each by (row, t); squares in Pa^2."""
    transport, _, kind = name.partition("-")
    groups = unpacked(shown.traces[name], [rows * count for count in rows_of(traces)], samples)
    steps = shown.facts["cells"][transport]["steps"]
    if kind == "squares":
        return [2.0 ** (group / report.PER_OCTAVE) for group in groups]
    return [
        np.where(group == MISSING, np.nan, group * step) for group, step in zip(groups, steps, strict=True)
    ]


@pytest.mark.parametrize("transport", ["published", "exact"])
def test_traces_are_those_of_the_results_to_half_a_step(made, parts, transport):
    shown, (datum, mse, traces, _), e = parts[5], made["E06"], PAPER.experiments["E06"]
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


def test_numbers_are_those_of_the_results(made, parts):
    facts = parts[6].facts
    _, mse, _, best = made["E07"]
    for transport, of_models in mse.items():
        cells = facts["cells"][transport]
        assert cells["mse"] == pytest.approx(of_models.values, rel=1e-4)  # five digits
        assert [PAPER.n[i] for i in cells["best"]] == best[transport].values.tolist()
    assert facts["name"] == "E07" and facts["text"] == experiment_text(PAPER.experiments["E07"])


def test_a_model_that_failed_has_no_trace_and_no_number(made):
    datum, mse, traces, best = made["E06"]
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


def test_a_run_that_failed_says_so(made, verdict):
    datum, mse, traces, best = made["E06"]
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
    text = report_page(PAPER, [shown], verdict, None, False)
    assert "<strong>E06 is left out of every average:</strong> full-order run failed" in text


def test_one_file_that_loads_nothing_is_the_same_twice_and_leads_to_the_verdict(parts, verdict, page):
    links = {"https://doi.org/10.1243/09596518JSCE203", "https://github.com/leeoniya/uPlot"}
    assert set(stands_alone(page).links) == {"#explore", "verdict.html", *links}
    assert report_page(PAPER, parts, verdict, None, False) == page
    for status, (symbol, _) in STATUS_LOOKS.items():
        badge = rf'class="badge {status}" href="verdict.html"[^>]*>.*?{re.escape(html.escape(symbol))}</span>'
        assert re.search(rf"{badge} {verdict['counts'][status]} {status}</a>", page)
    assert "432 printed numbers" in page


@pytest.mark.results
def test_the_papers_page_stays_below_its_bound(results):
    assert BYTES / 2 < (results / "report.html").stat().st_size < 0.97 * BYTES  # with room for findings


def test_claims(parts, verdict, page):
    assert "was not computed: <code>snakemake -j2 ensemble</code>" in page
    text = report_page(PAPER, parts[:1], verdict, findings(), False)
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


def test_links_to_what_is_there_and_text_is_escaped(parts, verdict, made):
    for present in (False, True):
        assert ('href="paper.pdf"' in report_page(PAPER, parts[:1], verdict, None, present)) == present
    page = report_page(PAPER._replace(name="mine"), parts[:1], None, None, False)
    assert "verdict.html" not in page and "2006" not in page and "pneumo · report · mine" in page
    text = hostile(made)
    assert HOSTILE not in text and "<b>&" not in text and "<script>alert" not in text
    assert "&lt;script&gt;alert(2)" in text
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert data["experiments"][0]["name"] == HOSTILE


def hostile(made):
    experiment = PAPER.experiments["E06"]._replace(name=HOSTILE, cylinder="<b>&")
    mine = PAPER._replace(name="<script>alert(2)</script>", experiments={HOSTILE: experiment})
    return report_page(mine, [part(experiment, *made["E06"])], None, None, False)


DRAWN = """new Promise((done) => {
  const drawn = () => location.hash && document.body.dataset.drawn === location.hash;
  const look = () => (drawn() ? done() : setTimeout(look, 10));
  setTimeout(look, 0);
})"""
ROWS_SHOWN = """[...document.querySelectorAll("#ranking tr")].map((row) =>
  [row.cells[0].textContent, row.cells[1].textContent, row.cells[3].textContent, row.className])"""

FOCUSED = """(() => {
  const { activeElement: one } = document;
  const drawn = one.type === "radio" ? one.nextElementSibling : one;
  return [one.id || one.name || one.textContent, getComputedStyle(drawn).outlineStyle];
})()"""


@pytest.fixture(scope="module")
def file(page, tmp_path_factory):
    path = tmp_path_factory.mktemp("html") / "report.html"
    path.write_text(page, encoding="utf-8")
    return path


@pytest.fixture
def view(visit, file):
    """Load the page anew at a choice, and wait until it is drawn."""

    def drawn(choice: str = "", other: Path | None = None, width: int = 1280) -> Tab:
        browser = visit(other or file, choice, width=width)
        browser.run(DRAWN)
        return browser

    return drawn


def drag(browser, *places: tuple[float, float]) -> None:
    """Press the mouse at the first of these places, move it along and release it at the last."""
    mouse = browser.page.mouse
    mouse.move(*places[0])
    mouse.down()
    for place in places[1:]:
        mouse.move(*place)
    mouse.up()


@in_chromium
class TestInBrowser:
    def address(self, browser) -> dict[str, str]:
        browser.run(DRAWN)
        return dict(parse_qsl(browser.run("location.hash").removeprefix("#")))

    def test_loads_without_network_and_without_complaint(self, view, file):
        assert file.stat().st_size > 0.7 * BYTES  # as much to load as the study has
        assert_quiet(view(), file)

    def test_traces_are_the_packed_ones(self, view, parts, made):
        browser = view("#e=E07&t=published&c=B")
        e, cells = PAPER.experiments["E07"], made["E07"][2]["published"]
        steps = shown_steps(e)
        groups = unpacked_groups(parts[6], "published-errors", cells, len(steps))
        ends = unpacked_groups(parts[6], "published-limits", cells, len(interval_edges(e)) - 1, 2)
        for m in (0, 3, 4, 9):
            row = len(groups[2 * m + 1]) - 1
            drawn = browser.run(f"Array.from(traces.errors[{m}][1][{row}])")
            assert drawn == groups[2 * m + 1][row].tolist()
            drawn = browser.run(f"traces.limits[{m}][1][{row}].map((ends) => Array.from(ends))")
            assert drawn == ends[2 * m + 1][2 * row :].tolist()
        signals = unpacked(parts[6].traces["signals"], [1] * 4, len(steps))
        for place, (signal, step) in enumerate(zip(signals, parts[6].facts["steps"], strict=True)):
            drawn = browser.run(f"Array.from(traces.signals[{place}])")
            np.testing.assert_allclose(drawn, signal[0] * step, rtol=1e-6)
        np.testing.assert_allclose(browser.run("traces.t"), steps * e.h, rtol=1e-12)

    @pytest.mark.slow
    def test_choosing_an_experiment_changes_traces_and_numbers(self, view, made):
        browser = view("#e=E06&t=exact&c=A&n=best&w=all&m=M5 M6")
        before = browser.run("plots.error.data[6]"), browser.run(ROWS_SHOWN)
        change = "list.value = 9; list.dispatchEvent(new Event('change'))"
        browser.run(f"{{const list = element('experiment'); {change}}}")
        assert self.address(browser)["e"] == "E10"
        after = browser.run("plots.error.data[6]"), browser.run(ROWS_SHOWN)
        assert after[0] != before[0] and after[1] != before[1]
        assert experiment_text(PAPER.experiments["E10"]) in browser.run("element('about').textContent")
        _, of_models, _, best = made["E10"]
        for name, n, value, _ in after[1]:
            best_n = best["exact"].sel(model=name).item()
            mse = of_models["exact"].sel(model=name, chamber="A", n=best_n).item()
            assert float(value) == pytest.approx(np.sqrt(mse) / 1e3, abs=0.0051)  # two decimals
            assert n == (f"{best_n:.2f}" if MODELS[name].has_n else "–")
        values = [float(value) for _, _, value, _ in after[1]]
        assert values == sorted(values)

    @pytest.mark.slow
    def test_a_run_opens_at_two_seconds_of_it(self, view):
        browser = view()
        assert self.address(browser) == {
            "e": "E12",
            "t": "exact",
            "c": "A",
            "n": "best",
            "m": "M6 M7 M8",
            "w": "40 42",
        }
        drawn = browser.run(
            "['u', 'x', 'pressure', 'error'].map((id) => plots[id].data)"
            ".map(([t, first]) => [t.length, first.some((y) => y !== null)])"
        )
        assert drawn == [[len(shown_steps(PAPER.experiments["E12"])), True]] * 4
        assert "Drawn: 401 samples, 5 ms apart" in browser.run("element('sampling').textContent")
        assert browser.run("document.querySelector('.lead').textContent").startswith(
            "With its best n in each run, M"
        )

    def test_a_brush_zooms_all_panels_and_ranks_anew(self, view, made):
        browser = view("#e=E06&t=exact&c=A&n=1.35&m=M5 M7&w=all")
        whole = browser.run(ROWS_SHOWN)
        browser.run("element('error').scrollIntoView({behavior: 'instant'})")
        browser.run(FRAMES)
        box = "(({x, y, width, height}) => [x, y, width, height])(plots.error.over.getBoundingClientRect())"
        x, y, width, height = browser.run(box)
        drag(browser, *((x + fraction * width, y + height / 2) for fraction in (0.40, 0.42, 0.45)))
        start, end = map(float, self.address(browser)["w"].split())
        assert [start, end] == [24, 27]  # of 60 s; edges of intervals
        for plot in ("u", "x", "pressure", "error"):
            scale = browser.run(f"[plots['{plot}'].scales.x.min, plots['{plot}'].scales.x.max]")
            assert scale == pytest.approx([start, end], abs=1e-3)
        rows = browser.run(ROWS_SHOWN)
        assert rows != whole
        edges, cells = (
            interval_edges(PAPER.experiments["E06"]),
            made["E06"][2]["exact"].isel(choice=1, chamber=0),
        )
        inside = (edges[:-1] >= 24_000) & (edges[:-1] < 27_000)
        for name, _, value, _ in rows:
            squares = cells["mean_square"].sel(model=name).values[inside]
            rms = np.sqrt(np.average(squares, weights=np.diff(edges)[inside])) / 1e3
            assert float(value) == pytest.approx(rms, rel=7e-4, abs=0.0051)
        browser.run("element('whole').click()")
        assert self.address(browser)["w"] == "all"
        assert browser.run(ROWS_SHOWN) == whole

    @pytest.mark.slow
    def test_far_away_limits_of_every_step_are_drawn_and_near_samples(self, view, made):
        browser = view("#e=E03&t=exact&c=B&n=best&m=M7&w=all")
        e, cells = PAPER.experiments["E03"], made["E03"][2]["exact"].isel(choice=0, chamber=1).sel(model="M7")
        drawn = np.array(browser.run("plots.error.data[8]"))
        step = browser.run("cells().steps[13]")
        expected = np.ravel([cells["lowest"], cells["highest"]], order="F")
        assert np.abs(1e3 * drawn - expected).max() <= step
        ends = browser.run("plots.u.data[1]")
        assert {-5, 5} == {round(value, 2) for value in ends}
        browser.run("choose({window: [700, 760]})")
        browser.run(DRAWN)
        assert browser.run("plots.error.data[0].length") == len(shown_steps(e))
        assert "300 ms apart" in browser.run("element('sampling').textContent")

    @pytest.mark.slow
    def test_keyboard(self, view):
        browser = view("#e=E16&t=exact&c=A&n=best&m=M5 M7&w=all")

        def press(key: str) -> dict[str, str]:
            browser.press(key)
            return self.address(browser)

        for key, field, chosen in (
            *(("ArrowRight", "e", "E01"), ("ArrowLeft", "e", "E16")),
            *(("n", "n", "1.35"), ("n", "n", "best")),
            *(("0", "m", "M5 M7 M10"), ("5", "m", "M7 M10"), ("t", "t", "published"), ("c", "c", "B")),
            *(("z", "w", "20 22"), ("+", "w", "20.5 21.5"), (".", "w", "21 22")),
            *((",", "w", "20.5 21.5"), ("-", "w", "20 22"), ("Escape", "w", "all")),
        ):
            assert press(key).get(field) == chosen, key
        press("?")
        assert browser.run("element('help').open")
        assert press("ArrowRight")["e"] == "E16"  # under the dialog nothing moves
        browser.run("element('help').close()")
        browser.run("element('from').focus()")
        assert press("3")["m"] == "M7 M10"  # a digit in a field is a digit
        assert browser.console == []

    @pytest.mark.slow
    def test_everything_is_reached_by_tab_and_seen(self, view):
        browser = view()
        seen = []
        for _ in range(40):
            browser.press("Tab")
            name, outline = browser.run(FOCUSED)
            seen.append(name)
            if name == "whole":
                break
            assert outline == "solid", name
        controls = {"experiment", "transport", "chamber", "n", "keys", "from", "to", "close-up", "whole"}
        assert controls <= set(seen)
        assert len([text for text in seen if re.fullmatch(r"\d*M\d+", text)]) == len(MODELS)

    @pytest.mark.slow
    def test_the_address_holds_the_view(self, view):
        choice = {"e": "E03", "t": "published", "c": "B", "n": "1.35", "m": "M2 M10", "w": "697.5 720"}
        browser = view("#" + urlencode(choice))
        assert self.address(browser) == choice
        pressed = "[...document.querySelectorAll('.model[aria-pressed=true]')].map((one) => +one.value)"
        assert browser.run(pressed) == [1, 9]
        drawn = browser.run("plots.error.data.slice(2).map((curve) => curve.some((y) => y !== null))")
        assert [name for name, some in zip(MODELS, drawn, strict=True) if some] == ["M2", "M10"]
        browser.run("location.hash = '#explore'")
        browser.run(FRAMES)
        assert browser.run("state.window") == [697.5, 720]  # a place on the page changes nothing
        nonsense = view("#e=E99&t=x&c=C&n=7&m=M99&w=9 z")
        assert self.address(nonsense) == {"e": "E12", "t": "exact", "c": "A", "n": "best", "w": "40 42"}
        assert nonsense.console == []

    @pytest.mark.slow
    def test_texts_of_the_user_are_texts(self, view, made, tmp_path):
        other = tmp_path / "hostile.html"
        other.write_text(hostile(made), encoding="utf-8")
        browser = view("", other)
        assert browser.console == []
        assert browser.run("document.querySelectorAll('img, header b, main b').length") == 0
        assert HOSTILE in browser.run("element('about').textContent")

    @pytest.mark.slow
    def test_contrast_is_at_least_4_5(self, view):
        assert_readable(view(), 100)

    @pytest.mark.slow
    def test_contrast_of_the_dark_form(self, visit, file):
        browser = visit(file, color_scheme="dark")
        browser.run(DRAWN)
        assert_readable(browser, 100)
        assert browser.run("getComputedStyle(document.body).backgroundColor") == "rgb(22, 22, 22)"

    @pytest.mark.parametrize("width", in_brief([400, 1200], [400]))
    def test_fits_a_narrow_window(self, view, width):
        browser = view(width=width)
        browser.wait(f"plots.error.width === element('error').clientWidth && innerWidth === {width}")
        assert browser.run("document.documentElement.scrollWidth") == width
        assert browser.run("plots.error.width") <= width

    def test_errors_of_a_window_are_those_of_every_step(self, view, tmp_path):
        """A run of six seconds, replayed; the page's errors against those of each millisecond."""
        e = lasting("E06", 6.0)
        recording = record(e)
        lanes, index = grid_lanes(PAPER.n, e.plant.gas.gamma)
        mse, traces, best, every = {}, {}, {}, {}
        for transport in ("published", "exact"):
            replayed = replay(recording, lanes, study_sampling(transport, e))
            grid = {"model": list(MODELS), "n": list(PAPER.n), "chamber": ["A", "B"]}
            mse[transport] = xr.DataArray(replayed.mse[index], grid, list(grid))
            best[transport] = mse[transport].mean("chamber").idxmin("n")
            traces[transport] = traced(e, PAPER, recording, transport, best[transport].values)
            every[transport] = recording.states[:, [2, 4]].T - replayed.pressure
        page = tmp_path / "report.html"
        shown = part(e, datum_dataset(e, recording), mse, traces, best)
        study = PAPER._replace(name="mine", experiments={"E06": e})
        page.write_text(report_page(study, [shown], None, None, False), encoding="utf-8")
        browser = view("#e=E06&n=best&w=all", page)
        for transport, choice, (start, stop) in (
            ("exact", "best", (2.0, 4.0)),
            ("exact", "common", (2.25, 2.5)),
            ("published", "best", (0.0, 0.6)),
            ("published", "common", (5.1, 6.0)),
        ):
            browser.run(f"choose({{t: '{transport}', n: '{choice}', window: [{start}, {stop}]}})")
            browser.run(DRAWN)
            assert browser.run("state.window") == pytest.approx([start, stop])
            steps = slice(
                round(start / e.h), round(stop / e.h) + (stop == e.duration)
            )  # its end at the run's only
            for m, (name, model) in enumerate(MODELS.items()):
                n = best[transport].sel(model=name).item() if choice == "best" else COMMON_N
                lane = index[m, PAPER.n.index(n) if model.has_n else 0]
                squares = np.mean(every[transport][lane][:, steps] ** 2, axis=1)
                on_page = browser.run(f"chambers.map((_, c) => meanSquare({m}, c))")
                np.testing.assert_allclose(on_page, squares, rtol=7e-4)  # half a step of its logarithm
                assert browser.run(f"bothChambers({m})") == pytest.approx(np.sqrt(squares.mean()), rel=4e-4)

    @pytest.mark.slow
    def test_axe_finds_nothing(self, visit, file):
        assert_accessible(visit, file)
