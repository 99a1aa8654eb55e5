"""The report's page in a browser: what it draws, ranks and says; keyboard, address, contrast."""

from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest
import xarray as xr
from brief import in_brief
from browser import Tab
from invented_report import BYTES, HOSTILE, hostile, made, page, parts, unpacked_groups
from packed_traces import unpacked
from page_checks import FRAMES, assert_accessible, assert_quiet, assert_readable, in_chromium
from paper_study import STUDY as PAPER
from paper_study import lasting

from paper.study.pages.report_page import part, report_page
from paper.study.samplings import study_sampling
from paper.study.trace_layout import COMMON_N, interval_edges, replay_and_errors, shown_steps, traced
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.storage.layout import datum_dataset

pytestmark = pytest.mark.xdist_group("report page")  # the page takes seconds to make

DRAWN = """new Promise((done) => {
  const drawn = () => location.hash && document.body.dataset.drawn === location.hash;
  const look = () => (drawn() ? done() : setTimeout(look, 10));
  setTimeout(look, 0);
})"""
ROWS_SHOWN = """[...document.querySelectorAll("#ranking tr")].map((row) =>
  [row.cells[0].textContent, row.cells[1].textContent, row.cells[3].textContent, row.className])"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("html") / "report.html"
    path.write_text(page(), encoding="utf-8")
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

    def test_traces_are_the_packed_ones(self, view):
        browser = view("#e=E07&t=published&c=B")
        e, cells = PAPER.experiments["E07"], made()["E07"][2]["published"]
        steps = shown_steps(e)
        groups = unpacked_groups(parts()[6], "published-errors", cells, len(steps))
        ends = unpacked_groups(parts()[6], "published-limits", cells, len(interval_edges(e)) - 1, 2)
        for m in (0, 3, 4, 9):
            row = len(groups[2 * m + 1]) - 1
            drawn = browser.run(f"Array.from(traces.errors[{m}][1][{row}])")
            assert drawn == groups[2 * m + 1][row].tolist()
            drawn = browser.run(f"traces.limits[{m}][1][{row}].map((ends) => Array.from(ends))")
            assert drawn == ends[2 * m + 1][2 * row :].tolist()
        signals = unpacked(parts()[6].traces["signals"], [1] * 4, len(steps))
        for place, (signal, step) in enumerate(zip(signals, parts()[6].facts["steps"], strict=True)):
            drawn = browser.run(f"Array.from(traces.signals[{place}])")
            np.testing.assert_allclose(drawn, signal[0] * step, rtol=1e-6)
        np.testing.assert_allclose(browser.run("traces.t"), steps * e.h, rtol=1e-12)

    def test_a_brush_zooms_all_panels_and_ranks_anew(self, view):
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
            made()["E06"][2]["exact"].isel(choice=1, chamber=0),
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
    def test_texts_of_the_user_are_texts(self, view, tmp_path):
        other = tmp_path / "hostile.html"
        other.write_text(hostile(), encoding="utf-8")
        browser = view("", other)
        assert browser.console == []
        assert browser.run("document.querySelectorAll('img, header b, main b').length") == 0
        assert HOSTILE in browser.run("element('about').textContent")

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
            gathered = replay_and_errors(e, lanes, recording, study_sampling(transport, e))
            traces[transport] = traced(e, PAPER.n, index, *gathered)
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
