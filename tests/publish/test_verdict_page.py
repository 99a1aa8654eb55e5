"""The verdict's page: its text, and how it behaves in a headless Chromium where there is one."""

import html
import json
import re
import shutil

import pytest
from brief import in_brief
from page_checks import Structure, assert_accessible, assert_quiet, assert_readable, in_chromium, stands_alone

from paper.study.pages import STATUS_LOOKS
from paper.study.pages.verdict_page import SIMULATORS, deviation_text, size_class, verdict_page
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.text.explain import cell_text, item_text
from pneumo.errors import ResultError
from pneumo.storage.files import read_json

pytestmark = pytest.mark.xdist_group("printed")


@pytest.fixture(scope="module")
def judged(judged_once):
    judged = judged_once
    # One of every status, and one item that falls with exact signals.
    items = {item["id"]: item for item in judged["items"]}
    items["T7.M5.mse"] |= {"status": "missed", "reason": "for this test <&>"}
    items["S4.M6_85"]["stands_exact"] = False
    judged["counts"]["missed"] += 1
    judged["counts"]["exact"] -= 1
    return judged


@pytest.fixture(scope="module")
def page(judged):
    return verdict_page(judged, PAPER_FOLDER)


def test_one_file_that_loads_nothing_and_is_the_same_twice(judged, page):
    assert len(page.encode()) < 3_000_000
    stands_alone(page)
    assert verdict_page(judged, PAPER_FOLDER) == page
    assert "Evidence beside the study" not in page
    assert "Evidence beside the study: a &lt;; b.</p>" in verdict_page(judged, PAPER_FOLDER, ["a <", "b"])


def test_every_item_has_an_anchor_every_link_a_target_and_every_cell_stands_once(judged, page):
    structure = Structure(page)
    anchors = {item["id"] for item in judged["items"]} | {
        f"erratum-{erratum['id']}" for erratum in judged["errata"]
    }
    targets = {link[1:] for link in structure.links if link.startswith("#")}
    assert anchors | targets <= set(structure.ids)
    cells = re.findall(r'<td class="[\w-]+" data-status="(\w+)" data-id="([^"]+)">', page)
    expected = [(item["status"], item["id"]) for item in judged["items"] if item["table"]]
    assert sorted(cells) == sorted(expected)


def test_other_simulators_stand_beside_with_their_counts(judged, page, tmp_path):
    part = page.partition('<h2 id="simulators">')[2].partition("</section>")[0]
    rows = re.findall(r'<th scope="row">(.*?)</th>(.*?)</tr>', part)
    stored = json.loads((PAPER_FOLDER / SIMULATORS).read_text(encoding="utf-8"))
    assert [html.unescape(name) for name, _ in rows] == [row["name"] for row in stored]
    for (_, cells), row in zip(rows, stored, strict=True):
        numbers = re.findall(r"<td>([\d.]+)</td>", cells)
        assert numbers[:5] == [str(row["statuses"][status]) for status in STATUS_LOOKS]
        assert numbers[5:] == [f"{row['table_7']:.3f}", f"{row['table_9']:.3f}", str(row["table_8"]["exact"])]
    folder = tmp_path / "paper"
    shutil.copytree(PAPER_FOLDER, folder, ignore=shutil.ignore_patterns(SIMULATORS))
    assert 'id="simulators"' not in verdict_page(judged, folder)


@pytest.mark.results
def test_pneumo_s_row_beside_other_simulators_is_of_todays_study(results):
    """Else the page would compare other simulators with a study that is no more."""
    row, *_ = json.loads((PAPER_FOLDER / SIMULATORS).read_text(encoding="utf-8"))
    scores = json.loads(read_json(results / "verdict.json"))["highlights"]["scores"]
    for table in (7, 9):
        assert row[f"table_{table}"] == scores[f"table_{table}_mse"]["rms_of_ln_ratio"]
    assert row["table_8"]["exact"] == scores["table_8"]["exact"]


def test_counts_by_kind_of_evidence(judged, page):
    for basis, counts in judged["counts_by_basis"].items():
        row = re.search(rf'<tr data-basis="{basis}">(.*?)</tr>', page, re.DOTALL)[1]
        assert re.findall(r"<td>(\d+)</td>", row) == [str(number) for number in counts.values()]
    head = re.search(r"No choice was made with (\d+) facts in view:</strong> (\d+) exact", page)
    measured = judged["headline"]["measured"]
    assert [*map(int, head.groups())] == [measured["items"], measured["exact"]]
    first = re.search(
        r'<p class="sharpest">(\d+) printed facts had no part in any choice .*?:\s(.*?)\.', page, re.S
    )
    statuses = ", ".join(f"{n} {name}" for name, n in measured.items() if n and name != "items")
    assert first.groups() == (str(measured["items"]), statuses)
    for item in judged["items"]:
        assert f"<dt>Basis</dt><dd>{item['basis']}: " in page


def test_text_is_escaped_and_symbols_tell_statuses_without_colour(judged, page):
    assert "for this test &lt;&amp;&gt;" in page
    assert "for this test <&>" not in page
    ledger = judged["assumptions"]
    name = next(iter(ledger))
    spoilt = judged | {"assumptions": ledger | {name: ledger[name] | {"unit": "<b>kg</b>"}}}
    text = verdict_page(spoilt, PAPER_FOLDER)
    assert "&lt;b&gt;kg&lt;/b&gt;" in text
    assert "<b>kg</b>" not in text
    cells = re.findall(r'<td class="[\w-]+" data-status="(\w+)" .*?class="symbol"[^>]*>(.*?)</', page)
    symbols = {status: html.unescape(symbol) for status, symbol in cells}
    assert symbols == {status: STATUS_LOOKS[status][0] for status in symbols}
    assert {"exact", "explained", "missed"} <= set(symbols)
    assert len({symbol for symbol, _ in STATUS_LOOKS.values()}) == len(STATUS_LOOKS)


def test_a_cell_is_coloured_by_the_size_of_its_deviation():
    def item(relative, status="missed"):
        return {"status": status, "relative": relative, "pull": None}

    sizes = {0.0: "1", 0.01: "1", -0.0101: "2", 0.02: "2", 0.05: "3", -0.051: "4", 9.0: "4", None: "none"}
    assert {deviation: size_class(item(deviation)) for deviation in sizes} == {
        deviation: f"size-{size}" for deviation, size in sizes.items()
    }
    assert size_class(item(0.03, "exact")) == "size-0"  # within the digits, or the reading
    deviations = item(0.0123), item(-0.5) | {"pull": -3.21}, item(1e-9)
    words = tuple(map(deviation_text, deviations))
    assert words == ("+1.23 %", "-50 %, pull -3.2", "0 %")


def test_findings_stand_before_the_items_and_another_study_says_so(page, judged):
    heads = ["Counts", "Reproduced over printed", "Finding 1", "Finding 2"]
    heads += ["The paper's tables", "Items", "Errata", "Doubts", "Assumptions"]
    places = [re.search(rf"<h2[^>]*>{head}", page).start() for head in heads]
    assert places == sorted(places)
    none = dict.fromkeys(("wrong_row", "transport", "by_experiment"))
    text = verdict_page(judged | {"study": "smoke", "highlights": judged["highlights"] | none}, PAPER_FOLDER)
    assert "not the paper's" in text and "Finding 1" not in text


@pytest.fixture(scope="module")
def file(page, tmp_path_factory):
    path = tmp_path_factory.mktemp("html") / "verdict.html"
    path.write_text(page, encoding="utf-8")
    return path


@pytest.fixture
def browser(visit, file):
    return visit(file)


@in_chromium
class TestInBrowser:
    def shown(self, browser) -> int:
        shown = browser.run("[...document.querySelectorAll('.item')].filter(item => !item.hidden).length")
        assert browser.run("document.getElementById('shown').textContent").startswith(f"{shown} of ")
        return shown

    def test_loads_without_network_and_without_complaint_and_either_would_be_seen(self, browser, file):
        assert_quiet(browser, file)
        browser.run("console.error('x')")
        assert len(browser.console) == 1
        browser.run("fetch('http://localhost:9/').catch(() => 0)")
        assert len(browser.console) > 1  # the page's own policy forbids it

    def test_filters(self, browser, judged):
        counts = judged["counts"]
        every = counts["items"]
        assert self.shown(browser) == every
        clicks = [(f".tile.{status}", count) for status in STATUS_LOOKS for count in (counts[status], every)]
        for control, count in [*clicks, ("input[value=exact]", every - counts["exact"]), ("#reset", every)]:
            browser.run(f"document.querySelector('{control}').click()")
            assert self.shown(browser) == count, control
        typed = ("search", "t8.e07.m7", "input", 1), ("search", "nothing like it", "input", 0)
        for control, value, event, count in (("part", "table-8", "change", 96), *typed):
            change = f"c.value = '{value}'; c.dispatchEvent(new Event('{event}'))"
            browser.run(f"{{const c = document.getElementById('{control}'); {change}}}")
            assert self.shown(browser) == count, value
            assert browser.run("document.getElementById('none').hidden") == bool(count)
            grids = "[...document.querySelectorAll('.grid')].filter(g => !g.hidden).length"
            assert browser.run(grids) == bool(count)
        browser.run("document.getElementById('reset').click()")
        browser.run("document.getElementById('falls').click()")
        assert self.shown(browser) == 1
        browser.run("document.getElementById('reset').click()")
        change = "c.value = 'table 7'; c.dispatchEvent(new Event('input'))"
        browser.run(f"{{const c = document.getElementById('search'); {change}}}")
        of_table_7 = sum("Table 7" in item["where"] for item in judged["items"])
        assert 30 < of_table_7 < 40 and self.shown(browser) == of_table_7  # not 17, 7.5 or links to T7

    @pytest.mark.slow
    def test_a_permanent_link_opens_its_item(self, visit, file):
        browser = visit(file, "#T8.E07.M7")
        browser.wait("document.activeElement.parentElement.id === 'T8.E07.M7'")
        assert browser.run("['T8.E07.M7', 'table-8'].every((id) => document.getElementById(id).open)")
        top = browser.run("document.getElementById('T8.E07.M7').getBoundingClientRect().top")
        bar = browser.run("document.querySelector('.filters').getBoundingClientRect().bottom")
        assert bar - 1 <= top < browser.run("innerHeight")

    def test_a_link_opens_an_item_that_a_filter_hides(self, browser, judged):
        browser.run("document.querySelector('.tile.missed').click()")
        browser.run("location.hash = '#S1.P_0'")
        browser.wait("document.getElementById('S1.P_0').open")
        assert self.shown(browser) == judged["counts"]["items"]

    @pytest.mark.slow
    def test_keyboard(self, browser, judged):
        browser.press("Tab")
        assert browser.run("document.activeElement.className") == "skip"
        for _ in range(5):  # doi, the other verdict, then tiles
            browser.press("Tab")
        assert browser.run("document.activeElement.dataset.status") == "explained"
        assert browser.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"
        browser.press("Enter")
        assert self.shown(browser) == judged["counts"]["explained"]
        unreachable = "document.querySelectorAll('[onclick], [tabindex=\"-1\"], .tile:not(button)').length"
        assert browser.run(unreachable) == 0
        browser.run("document.querySelector('td[data-id=\"T4.E.k_0=0.02\"] a').focus()")
        browser.press("Enter")
        browser.wait("document.activeElement.parentElement.id === 'T4.E.k_0=0.02'")
        browser.press("Enter")
        assert not browser.run("document.getElementById('T4.E.k_0=0.02').open")

    @pytest.mark.parametrize("filtered", in_brief([False, True], [True]))
    def test_contrast_is_at_least_4_5(self, browser, filtered):
        if filtered:
            browser.run("document.querySelector('.tile.missed').click()")
        browser.run("for (const details of document.querySelectorAll('details')) details.open = true")
        assert_readable(browser, 600 if filtered else 5000)

    @pytest.mark.slow
    def test_axe_finds_nothing(self, visit, file):
        # Items are alike: every twentieth stands for them, and the table cells keep all their links.
        fewer = "document.querySelectorAll('.item').forEach((e, i) => i % 20 && e.remove())"
        assert_accessible(visit, file, fewer)


def test_item_text(judged):
    errata = {erratum["id"]: erratum for erratum in judged["errata"]}
    items = {item["id"]: item for item in judged["items"]}
    story = item_text(items["S4.M7_40"], errata, "contradicted")
    words = ["Section 4", "fitted: constants", "M7_is_M8", "40 %", "54 %", "class fraction"]
    words += ["erratum", "proof", "statistics.nc"]
    assert all(word in story for word in words), story
    assert "(recorded: exact)" in item_text(items["T7.M5.mse"], errata, "exact")
    assert max(map(len, story.splitlines())) <= 100


def test_cell_text(printed_once):
    first, *others = cell_text(printed_once, "E07", "M8", 1.35).splitlines()
    assert len(others) == 5
    mse, mean, sigma = (float(re.search(rf"{name} (\S+)", first)[1]) for name in ("MSE", "mean", "sigma"))
    assert mse == pytest.approx(mean**2 + sigma**2, rel=1e-3)  # four printed digits
    wrong_n = "M8", 1.33, r"n = 1\.33: must be one of 1\.0, 1\.05"
    for model, n, words in (wrong_n, ("M99", 1.35, "model = 'M99': must be one of M1")):
        with pytest.raises(ResultError, match=words):
            cell_text(printed_once, "E07", model, n)
