"""The report's page in a browser: what it draws, ranks and says; keyboard, address, contrast."""

from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest
from brief import in_brief
from browser import Tab
from invented_report import BYTES, made, page
from page_checks import FRAMES, assert_accessible, assert_quiet, in_chromium
from paper_study import STUDY as PAPER

from paper.study.trace_layout import interval_edges

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
        assert file.stat().st_size > 0.65 * BYTES  # about as much to load as the study has
        assert_quiet(view(), file)

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
            squares = (
                cells["mean_square"].sel(model=name.replace("\u00a0", " ").replace("₀", "_0")).values[inside]
            )
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

    @pytest.mark.parametrize("width", in_brief([400, 1200], [400]))
    def test_fits_a_narrow_window(self, view, width):
        browser = view(width=width)
        browser.wait(f"plots.error.width === element('error').clientWidth && innerWidth === {width}")
        assert browser.run("document.documentElement.scrollWidth") == width
        assert browser.run("plots.error.width") <= width

    @pytest.mark.slow
    def test_axe_finds_nothing(self, visit, file):
        assert_accessible(visit, file)
