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

from pneumo.physics.models import MODELS
from pneumo.publish.pages import report_page as report
from pneumo.publish.pages.packing import FRACTION, MISSING
from pneumo.publish.pages.page import STATUS_LOOKS
from pneumo.publish.pages.report_page import STANDS, experiment_text, part, report_page, shown_samples

pytestmark = pytest.mark.xdist_group("report page")  # its fixtures take seconds

ROWS = [len(PAPER.n) if model.has_n else 1 for model in MODELS.values() for _ in "AB"]
EVERY = report.page_stride(PAPER)
HOSTILE = "</script><img src=x onerror=alert(1)>"
MANY_VALUES = 60  # waves in a made-up trace
BYTES = 5_000_000  # largest size of the page


def runs(experiment, seed):
    """A full-order run and its replays: waves, with errors that depend on sampling, model, n and chamber."""
    rng = np.random.default_rng(seed)
    stored = experiment.steps // experiment.pressure_stride + 1
    t = np.arange(stored) * experiment.h * experiment.pressure_stride
    frequencies, phases = rng.uniform(10, 2000, MANY_VALUES), rng.uniform(0, 7, MANY_VALUES)
    angle = np.linspace(0, 1, stored)[:, None] * frequencies + phases
    waves = np.sin(angle) @ rng.normal(0, 1, (MANY_VALUES, 4)) / MANY_VALUES**0.5
    full = 5e5 + 8e4 * waves[:, :2].T
    steps = np.arange(experiment.steps + 1)
    P = np.stack([np.interp(steps, steps[:: experiment.pressure_stride], p) for p in full], axis=1)
    datum = xr.Dataset({"P": (("t", "chamber"), P)}, {"chamber": ["A", "B"]})
    datum = datum.assign(status=np.int8(0), failure_time=np.nan)
    replays, best = {}, {}
    coords = {"model": list(MODELS), "n": list(PAPER.n), "chamber": ["A", "B"], "t": t}
    has_n = np.array([[model.has_n] for model in MODELS.values()])
    for transport, factor in {"published": 2.0, "exact": 1.0}.items():
        size = np.resize([10, 4, 6, 50, 3, 2.5, 1.5, 1.2, 1.1, 1.0], (len(MODELS), 1)) * factor * 1e3
        far = np.where(has_n, 1 + 8 * np.abs(np.array(PAPER.n) - 1.3), 1.0)
        error = (size * far)[:, :, None, None] * (waves[:, 2:].T + 0.2)
        pressure = xr.DataArray((full - error).astype(np.float32), coords, list(coords))
        mse = xr.DataArray(np.mean(error**2, axis=-1), pressure.isel(t=0, drop=True).coords)
        status = xr.zeros_like(mse, np.int8)
        replays[transport] = xr.Dataset({"mse": mse, "status": status, "pressure": pressure})
        best[transport] = mse.mean("chamber").idxmin("n")
    return datum, replays, best


@pytest.fixture(scope="module")
def made():
    """Runs of every experiment of the paper."""
    return {name: runs(experiment, seed) for seed, (name, experiment) in enumerate(PAPER.experiments.items())}


@pytest.fixture(scope="module")
def parts(made):
    return [part(PAPER.experiments[name], *run, EVERY) for name, run in made.items()]


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


def errors_of(shown: report.Part, transport: str, stored: int) -> list[np.ndarray]:
    """Errors in Pa by model and chamber, each by (n, t)."""
    groups = unpacked(shown.traces[transport], ROWS, len(shown_samples(stored, EVERY)))
    steps = shown.facts["cells"][transport]["steps"]
    pairs = zip(groups, steps, strict=True)
    return [np.where(group == MISSING, np.nan, group * step) for group, step in pairs]


@pytest.mark.parametrize("transport", ["published", "exact"])
def test_traces_are_those_of_the_results_to_half_a_step(made, parts, transport):
    shown, (datum, replays, _) = parts[5], made["E06"]
    chosen = shown_samples(replays[transport].sizes["t"], EVERY)
    full = datum["P"].values[:: PAPER.experiments["E06"].pressure_stride]
    kept = np.concatenate(unpacked(shown.traces["full"], [1, 1], len(chosen)))
    step = shown.facts["step"]
    assert np.abs(kept.T * step - full[chosen]).max() <= step / 2 + 1e-6
    steps = iter(shown.facts["cells"][transport]["steps"])
    groups = iter(errors_of(shown, transport, len(full)))
    for name, model in MODELS.items():
        for c, chamber in enumerate("AB"):
            cells = replays[transport].sel(model=name, chamber=chamber)
            error = (full[:, c] - cells["pressure"].values.astype(float))[:, chosen]
            step = next(steps)
            assert np.abs(next(groups) - (error if model.has_n else error[:1])).max() <= step / 2 + 1e-6
            assert step <= np.sqrt(cells["mse"].min().item()) / FRACTION * (1 + 1e-9)


def test_numbers_are_those_of_the_results(made, parts):
    facts = parts[6].facts
    _, replays, best = made["E07"]
    for transport in replays:
        cells = facts["cells"][transport]
        assert cells["mse"] == pytest.approx(replays[transport]["mse"].values, rel=1e-4)  # five digits
        assert [PAPER.n[i] for i in cells["best"]] == best[transport].values.tolist()
    assert facts["name"] == "E07" and facts["text"] == experiment_text(PAPER.experiments["E07"])


def test_a_cell_that_failed_has_no_trace_and_no_number(made):
    datum, replays, best = made["E06"]
    spoilt = replays["exact"].copy(deep=True)
    spoilt["status"].loc[{"model": "M8", "n": 1.2}] = 1
    spoilt["mse"].loc[{"model": "M8", "n": 1.2}] = np.nan
    spoilt["pressure"].loc[{"model": "M8", "n": 1.2}] = 1e30
    never = best["exact"].copy()
    never.loc[{"model": "M1"}] = np.nan
    shown = part(PAPER.experiments["E06"], datum, {"exact": spoilt}, {"exact": never}, EVERY)
    cells = shown.facts["cells"]["exact"]
    place = PAPER.n.index(1.2)
    assert cells["mse"][7][place] == [None, None] and None not in cells["mse"][7][place + 1]
    assert cells["best"][0] is None and cells["best"][7] is not None
    m8 = errors_of(shown, "exact", spoilt.sizes["t"])[14]
    assert np.isnan(m8[place]).all() and np.isfinite(np.delete(m8, place, axis=0)).all()


def test_a_run_that_failed_says_so(made, verdict):
    datum, replays, best = made["E06"]
    failed = datum.copy(deep=True)
    meanings = {"flag_meanings": "ran left_the_finite_numbers", "last_state": np.ones(6)}
    failed["status"] = ((), np.int8(1), meanings)
    failed["failure_time"] = 1.5
    failed["P"][1500:] = np.nan
    nan = np.nan
    lost = {name: c.assign(status=c["status"] + 2, mse=c["mse"] * nan) for name, c in replays.items()}
    none = {name: xr.full_like(values, np.nan) for name, values in best.items()}
    shown = part(PAPER.experiments["E06"], failed, lost, none, EVERY)
    assert shown.facts["failed"].startswith("full-order run failed at t = 1.5 s: left the finite numbers")
    text = report_page(PAPER, [shown], verdict, None, False)
    assert "<strong>E06 is left out of every average:</strong> full-order run failed" in text


def test_close_up_has_every_stored_sample_and_any_study_has_room():
    chosen = shown_samples(6001, 7)
    first, last = report.close_up(6001)
    assert (first, last) == (2000, 2750)
    assert np.isin(np.arange(first, last + 1), chosen).all()
    outside = chosen[(chosen < first) | (chosen > last)]
    assert (outside % 7 == 0).all() and len(outside) > 740
    assert shown_samples(1, 3).tolist() == [0]

    def values(one, every):
        stored = [e.steps // e.pressure_stride + 1 for e in one.experiments.values()]
        return 2 * sum(ROWS) * sum(len(shown_samples(count, every)) for count in stored)

    assert EVERY > 1 and values(PAPER, EVERY) <= report.MOST_VALUES < values(PAPER, EVERY - 1)
    few = PAPER._replace(experiments={"E06": PAPER.experiments["E06"]})
    assert report.page_stride(few) == 1


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
    assert BYTES / 2 < (results / "report.html").stat().st_size < 0.92 * BYTES  # with room for findings


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
    for there in (False, True):
        assert ('href="paper.pdf"' in report_page(PAPER, parts[:1], verdict, None, there)) == there
    page = report_page(PAPER._replace(name="mine"), parts[:1], None, None, False)
    assert "verdict.html" not in page and "2006" not in page and "mine: reduced models" in page
    text = hostile(made)
    assert HOSTILE not in text and "<b>&" not in text and "<script>alert" not in text
    assert "&lt;script&gt;alert(2)" in text
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    assert data["experiments"][0]["name"] == HOSTILE


def hostile(made):
    experiment = PAPER.experiments["E06"]._replace(name=HOSTILE, cylinder="<b>&")
    mine = PAPER._replace(name="<script>alert(2)</script>", experiments={HOSTILE: experiment})
    return report_page(mine, [part(experiment, *made["E06"], EVERY)], None, None, False)


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
        assert file.stat().st_size > 0.8 * BYTES  # as much to load as the study has
        assert_quiet(view(), file)

    def test_traces_are_the_packed_ones(self, view, parts, made):
        browser = view("#e=E07&t=published&c=B")
        stored = made["E07"][1]["exact"].sizes["t"]
        groups = errors_of(parts[6], "published", stored)
        for m, row in [(0, 0), (3, 0), (4, 3), (9, 8)]:
            drawn = browser.run(f"Array.from(traces.errors[{m}][1][{row}])")
            assert drawn == groups[2 * m + 1][row].tolist()
        full = unpacked(parts[6].traces["full"], [1, 1], len(shown_samples(stored, EVERY)))[1]
        assert browser.run("Array.from(traces.full[1])") == (full[0] * parts[6].facts["step"]).tolist()

    def test_choosing_an_experiment_changes_traces_and_numbers(self, view, made):
        browser = view("#e=E06&t=exact&c=A&n=best")
        before = browser.run("plots.error.data[6]"), browser.run(ROWS_SHOWN)
        change = "list.value = 9; list.dispatchEvent(new Event('change'))"
        browser.run(f"{{const list = element('experiment'); {change}}}")
        assert self.address(browser)["e"] == "E10"
        after = browser.run("plots.error.data[6]"), browser.run(ROWS_SHOWN)
        assert after[0] != before[0] and after[1] != before[1]
        assert experiment_text(PAPER.experiments["E10"]) in browser.run("element('about').textContent")
        _, replays, best = made["E10"]
        for name, n, value, _ in after[1]:
            best_n = best["exact"].sel(model=name).item()
            mse = replays["exact"]["mse"].sel(model=name, chamber="A", n=best_n).item()
            assert float(value) == pytest.approx(np.sqrt(mse) / 1e3, abs=0.0051)  # two decimals
            assert n == (f"{best_n:.2f}" if MODELS[name].has_n else "–")
        values = [float(value) for _, _, value, _ in after[1]]
        assert values == sorted(values)

    def test_a_brush_zooms_both_panels_and_ranks_anew(self, view, made, parts):
        browser = view("#e=E06&t=exact&c=A&n=1.35&m=M5 M7")
        whole = browser.run(ROWS_SHOWN)
        browser.run("element('error').scrollIntoView({behavior: 'instant'})")
        browser.run(FRAMES)
        box = "(({x, y, width, height}) => [x, y, width, height])(plots.error.over.getBoundingClientRect())"
        x, y, width, height = browser.run(box)
        drag(browser, *((x + fraction * width, y + height / 2) for fraction in (0.40, 0.42, 0.45)))
        start, end = map(float, self.address(browser)["w"].split())
        assert [start, end] == pytest.approx([24, 27], abs=0.2)  # of 60 s; two pixels
        for plot in ("pressure", "error"):
            scale = browser.run(f"[plots['{plot}'].scales.x.min, plots['{plot}'].scales.x.max]")
            assert scale == pytest.approx([start, end], abs=1e-3)
        rows = browser.run(ROWS_SHOWN)
        assert rows != whole
        stored = made["E06"][1]["exact"].sizes["t"]
        t = shown_samples(stored, EVERY) * 0.01
        inside = (t >= start - 1e-3) & (t <= end + 1e-3)  # in the close-up: every stored sample
        groups = errors_of(parts[5], "exact", stored)
        expected = {
            name: groups[2 * m][PAPER.n.index(1.35) if model.has_n else 0][inside]
            for m, (name, model) in enumerate(MODELS.items())
        }
        for name, _, value, _ in rows:
            rms = np.sqrt(np.mean(expected[name] ** 2)) / 1e3
            assert float(value) == pytest.approx(round(rms, 2), abs=0.011)
        assert f"From the {inside.sum()} samples" in browser.run("element('sampling').textContent")
        browser.run("element('whole').click()")
        assert "w" not in self.address(browser)
        assert browser.run(ROWS_SHOWN) == whole

    def test_outside_the_close_up_samples_are_equally_far_apart(self, view):
        browser = view("#e=E06&w=10 30")
        gaps = set(np.round(np.diff(browser.run("plots.error.data[0]")), 6))
        assert gaps == {round(EVERY * 0.01, 6)}

    def test_keyboard(self, view):
        browser = view("#e=E16&t=exact&c=A&n=best&m=M5 M7")

        def press(key: str) -> dict[str, str]:
            browser.press(key)
            return self.address(browser)

        for key, field, chosen in (
            *(("ArrowRight", "e", "E01"), ("ArrowLeft", "e", "E16")),
            *(("ArrowUp", "n", "1"), ("ArrowUp", "n", "1.05"), ("ArrowDown", "n", "1")),
            *(("0", "m", "M5 M7 M10"), ("5", "m", "M7 M10"), ("t", "t", "published"), ("c", "c", "B")),
            *(("z", "w", "20 27.5"), ("+", "w", "21.875 25.625"), (".", "w", "23.75 27.5")),
            *((",", "w", "21.875 25.625"), ("-", "w", "20 27.5"), ("Escape", "w", None)),
        ):
            assert press(key).get(field) == chosen, key
        press("?")
        assert browser.run("element('help').open")
        assert press("ArrowRight")["e"] == "E16"  # under the dialog nothing moves
        browser.run("element('help').close()")
        browser.run("element('from').focus()")
        assert press("3")["m"] == "M7 M10"  # a digit in a field is a digit
        assert browser.console == []

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

    def test_a_click_over_n_chooses_it(self, view):
        browser = view("#e=E06&n=best")
        browser.run("element('over-n').scrollIntoView()")
        at = "({x, y, height}) => [x + plots['over-n'].valToPos(1.2, 'x') + 2, y + height / 2]"
        drag(browser, browser.run(f"({at})(plots['over-n'].over.getBoundingClientRect())"))
        assert self.address(browser)["n"] == "1.2"
        assert {n for _, n, _, _ in browser.run(ROWS_SHOWN)} == {"1.20", "–"}

    def test_the_address_holds_the_view(self, view):
        choice = {"e": "E03", "t": "published", "c": "B", "n": "1.15", "m": "M2 M10", "w": "700 720"}
        browser = view("#" + urlencode(choice))
        assert self.address(browser) == choice
        pressed = "[...document.querySelectorAll('.model[aria-pressed=true]')].map((one) => +one.value)"
        assert browser.run(pressed) == [1, 9]
        drawn = browser.run("plots.error.data.slice(2).map((curve) => curve.some((y) => y !== null))")
        assert [name for name, some in zip(MODELS, drawn, strict=True) if some] == ["M2", "M10"]
        browser.run("location.hash = '#explore'")
        browser.run(FRAMES)
        assert browser.run("state.window") == [700, 720]  # a place on the page changes nothing
        nonsense = view("#e=E99&t=x&c=C&n=7&m=M99&w=9 z")
        assert self.address(nonsense) == {"e": "E01", "t": "exact", "c": "A", "n": "best"}
        assert nonsense.console == []

    def test_texts_of_the_user_are_texts(self, view, made, tmp_path):
        other = tmp_path / "hostile.html"
        other.write_text(hostile(made), encoding="utf-8")
        browser = view("", other)
        assert browser.console == []
        assert browser.run("document.querySelectorAll('img, header b, main b').length") == 0
        assert HOSTILE in browser.run("element('about').textContent")

    def test_contrast_is_at_least_4_5(self, view):
        assert_readable(view(), 100)

    @pytest.mark.parametrize("width", in_brief([400, 1200], [400]))
    def test_fits_a_narrow_window(self, view, width):
        browser = view(width=width)
        browser.wait(f"plots.error.width === element('error').clientWidth && innerWidth === {width}")
        assert browser.run("document.documentElement.scrollWidth") == width
        assert browser.run("plots.error.width") <= width

    @pytest.mark.slow
    def test_axe_finds_nothing(self, visit, file):
        assert_accessible(visit, file)
