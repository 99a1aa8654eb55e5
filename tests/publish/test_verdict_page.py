"""The verdict's page: its text, and how it behaves in a headless Chromium where there is one."""

import re

import pytest
from browser import Browser
from page_checks import CONTRAST, SHORTLY, Structure, in_chromium

from pneumo.errors import ResultError
from pneumo.publish.pages.page import STATUS_LOOKS
from pneumo.publish.pages.verdict_page import verdict_page
from pneumo.publish.text.explain import cell_text, item_text

TAB, ENTER = 9, 13
pytestmark = pytest.mark.xdist_group("printed")


@pytest.fixture(scope="module")
def results(printed_once):
    return printed_once


@pytest.fixture(scope="module")
def judged(judged_once):
    found = judged_once
    # One of every status, and one item that falls with exact transport.
    for item in found["items"]:
        if item["id"] == "T7.M5.mse":
            item["status"], item["reason"] = "missed", "for this test <&>"
        if item["id"] == "S4.M6_85":
            item["stands_exact"] = False
    found["counts"]["missed"] += 1
    found["counts"]["exact"] -= 1
    return found


@pytest.fixture(scope="module")
def page(judged):
    return verdict_page(judged)


def test_one_file_that_loads_nothing_and_is_the_same_twice(judged, page):
    assert len(page.encode()) < 3_000_000
    assert [target for target in Structure(page).loads if not target.startswith("data:")] == []
    assert "url(" not in page
    assert "@import" not in page
    assert verdict_page(judged) == page


def test_every_item_has_an_anchor_and_every_link_a_target(judged, page):
    structure = Structure(page)
    assert len(set(structure.ids)) == len(structure.ids)
    assert {item["id"] for item in judged["items"]} <= set(structure.ids)
    targets = {link[1:] for link in structure.links if link.startswith("#")}
    assert targets <= set(structure.ids)
    assert {f"erratum-{erratum['id']}" for erratum in judged["errata"]} <= set(structure.ids)


def test_every_cell_of_the_tables_stands_once(judged, page):
    cells = re.findall(r'<td class="(\w+)" data-id="([^"]+)">', page)
    expected = [(item["status"], item["id"]) for item in judged["items"] if item["table"]]
    assert sorted(cells) == sorted(expected)


def test_text_is_escaped(judged, page):
    assert "for this test &lt;&amp;&gt;" in page
    assert "for this test <&>" not in page
    ledger = judged["assumptions"]
    name = next(iter(ledger))
    spoilt = judged | {"assumptions": ledger | {name: ledger[name] | {"unit": "<b>kg</b>"}}}
    text = verdict_page(spoilt)
    assert "&lt;b&gt;kg&lt;/b&gt;" in text
    assert "<b>kg</b>" not in text


def test_findings_stand_before_the_items(page):
    heads = ["Counts", "Finding 1", "Finding 2", "The paper's tables", "Items", "Errata", "Assumptions"]
    places = [re.search(rf"<h2[^>]*>{head}", page).start() for head in heads]
    assert places == sorted(places)


def test_another_study_says_so(judged):
    none = dict.fromkeys(("wrong_row", "transport", "by_experiment"))
    text = verdict_page(judged | {"study": "smoke", "highlights": judged["highlights"] | none})
    assert "not the paper's" in text and "Finding 1" not in text


# In the browser


@pytest.fixture(scope="module")
def file(page, tmp_path_factory):
    path = tmp_path_factory.mktemp("html") / "verdict.html"
    path.write_text(page, encoding="utf-8")
    return path


@pytest.fixture
def browser(file):
    with Browser() as opened:
        opened.open(file)
        yield opened


class TestInBrowser:
    pytestmark = in_chromium

    def shown(self, browser) -> int:
        shown = browser.run("[...document.querySelectorAll('.item')].filter(item => !item.hidden).length")
        assert browser.run("document.getElementById('shown').textContent").startswith(f"{shown} of ")
        return shown

    def test_loads_without_network_and_without_complaint(self, browser, file):
        assert browser.requests == [file.as_uri()]
        assert browser.console == []

    def test_the_check_for_complaints_would_see_one(self, browser):
        browser.run("console.error('x')")
        assert len(browser.console) == 1
        browser.run("void fetch('http://localhost:9/').catch(() => 0)")
        browser.run(SHORTLY)
        assert len(browser.console) > 1  # the page's own policy forbids it

    def test_filters(self, browser, judged):
        counts = judged["counts"]
        assert self.shown(browser) == counts["items"]
        for status in STATUS_LOOKS:
            browser.run(f"document.querySelector('.tile.{status}').click()")
            assert self.shown(browser) == counts[status]
            browser.run(f"document.querySelector('.tile.{status}').click()")
        browser.run("document.querySelector('input[value=exact]').click()")
        assert self.shown(browser) == counts["items"] - counts["exact"]
        browser.run("document.getElementById('reset').click()")
        assert self.shown(browser) == counts["items"]

        def choose(control: str, value: str, event: str) -> int:
            browser.run(
                f"{{const c = document.getElementById('{control}'); c.value = '{value}';"
                f" c.dispatchEvent(new Event('{event}'))}}"
            )
            return self.shown(browser)

        assert choose("part", "table-8", "change") == 96
        assert browser.run("[...document.querySelectorAll('.grid')].filter(g => !g.hidden).length") == 1
        assert choose("search", "e07 m7", "input") == 1
        assert choose("search", "nothing like it", "input") == 0
        assert not browser.run("document.getElementById('none').hidden")
        browser.run("document.getElementById('reset').click()")
        browser.run("document.getElementById('falls').click()")
        assert self.shown(browser) == 1

    def test_a_permanent_link_opens_its_item(self, file):
        with Browser() as browser:
            browser.open(file, "#T8.E07.M7")
            browser.run(SHORTLY)
            assert browser.run("document.getElementById('T8.E07.M7').open")
            assert browser.run("document.getElementById('table-8').open")
            assert browser.run("document.activeElement.parentElement.id") == "T8.E07.M7"
            top = browser.run("document.getElementById('T8.E07.M7').getBoundingClientRect().top")
            bar = browser.run("document.querySelector('.filters').getBoundingClientRect().bottom")
            assert bar - 1 <= top < browser.run("innerHeight")

    def test_a_link_opens_an_item_that_a_filter_hides(self, browser, judged):
        browser.run("document.querySelector('.tile.missed').click()")
        browser.run("location.hash = '#S1.P_0'")
        browser.run(SHORTLY)
        assert self.shown(browser) == judged["counts"]["items"]
        assert browser.run("document.getElementById('S1.P_0').open")

    def test_keyboard(self, browser, judged):
        browser.press("Tab", TAB)
        assert browser.run("document.activeElement.className") == "skip"
        for _ in range(4):  # doi, then tiles
            browser.press("Tab", TAB)
        assert browser.run("document.activeElement.dataset.status") == "explained"
        assert browser.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"
        browser.press("Enter", ENTER, "\r")
        assert self.shown(browser) == judged["counts"]["explained"]
        unreachable = browser.run(
            "[...document.querySelectorAll('[onclick], [tabindex=\"-1\"], .tile:not(button)')].length"
        )
        assert unreachable == 0
        browser.run("document.querySelector('td[data-id=\"T4.E.k_0=0.02\"] a').focus()")
        browser.press("Enter", ENTER, "\r")
        browser.run(SHORTLY)
        assert browser.run("document.activeElement.parentElement.id") == "T4.E.k_0=0.02"
        browser.press("Enter", ENTER, "\r")
        assert not browser.run("document.getElementById('T4.E.k_0=0.02').open")

    @pytest.mark.parametrize("filtered", [False, True])
    def test_contrast_is_at_least_4_5(self, browser, filtered):
        if filtered:
            browser.run("document.querySelector('.tile.missed').click()")
        browser.run("for (const details of document.querySelectorAll('details')) details.open = true")
        worst = browser.run(CONTRAST)
        assert worst["texts"] > (600 if filtered else 5000)
        assert worst["ratio"] >= 4.5, worst

    def test_symbols_tell_statuses_without_colour(self, browser):
        symbols = browser.run(
            "Object.fromEntries([...document.querySelectorAll('td[data-id]')]"
            ".map(cell => [cell.className.split(' ')[0], cell.querySelector('.symbol').textContent]))"
        )
        assert symbols == {status: STATUS_LOOKS[status][0] for status in symbols}
        assert {"exact", "explained", "missed", "unreadable"} <= set(symbols)
        assert len({symbol for symbol, _ in STATUS_LOOKS.values()}) == len(STATUS_LOOKS)


# The same in a terminal


def test_item_text(judged):
    errata = {erratum["id"]: erratum for erratum in judged["errata"]}
    items = {item["id"]: item for item in judged["items"]}
    story = item_text(items["S4.M7_40"], errata, "contradicted")
    words = ["Section 4", "40 %", "54 %", "class fraction", "erratum", "proof", "statistics.nc"]
    assert all(word in story for word in words), story
    assert "(recorded: exact)" in item_text(items["T7.M5.mse"], errata, "exact")
    assert max(map(len, story.splitlines())) <= 100


def test_cell_text(results):
    story = cell_text(results, "E07", "M8", 1.35)
    assert len(story.splitlines()) == 6
    first = story.splitlines()[0]
    mse, mean, sigma = (float(re.search(rf"{name} (\S+)", first)[1]) for name in ("MSE", "mean", "sigma"))
    assert mse == pytest.approx(mean**2 + sigma**2, rel=1e-3)  # four printed digits
    with pytest.raises(ResultError, match=r"n = 1\.33: must be one of 1\.0, 1\.05"):
        cell_text(results, "E07", "M8", 1.33)
    with pytest.raises(ResultError, match="model = 'M11': must be one of M1"):
        cell_text(results, "E07", "M11", 1.35)
