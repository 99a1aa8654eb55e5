"""The verdict's page: its text, and how it behaves in a headless Chromium where there is one."""

import html
import json
import re
import shutil

import pytest
from page_checks import Structure, assert_accessible, assert_quiet, assert_readable, in_chromium, stands_alone

from paper.study.pages.verdict_page import SIMULATORS, verdict_page
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.stored_runs import read_json
from paper.study.text.explain import cell_text
from paper_verdict.facts import headline_text
from pneumo.errors import ResultError

pytestmark = pytest.mark.xdist_group("printed")


@pytest.fixture(scope="module")
def judged(judged_once):
    judged = judged_once
    items = {item["id"]: item for item in judged["items"]}
    items["T7.M5.mse"] |= {"status": "differs, explained", "agreement": None, "reason": "for this test <&>"}
    items["S4.M6_85"]["also"]["exact"]["holds"] = False  # falls with exact signals
    return judged


@pytest.fixture(scope="module")
def page(judged):
    return verdict_page(judged, PAPER_FOLDER)


def test_one_file_that_loads_nothing_and_is_the_same_twice(judged, page):
    stands_alone(page)
    assert verdict_page(judged, PAPER_FOLDER) == page
    assert "Evidence beside the study" not in page
    assert "Evidence beside the study: a &lt;; b.</p>" in verdict_page(judged, PAPER_FOLDER, ["a <", "b"])


def test_every_item_has_one_row_and_every_link_a_target(judged, page):
    structure = Structure(page)
    anchors = [item["id"] for item in judged["items"]]
    anchors += [f"erratum-{erratum['id']}" for erratum in judged["errata"]]
    assert all(structure.ids.count(anchor) == 1 for anchor in anchors)
    assert {link[1:] for link in structure.links if link.startswith("#")} <= set(structure.ids)


def test_a_reader_sees_the_headline_then_a_line_for_each_table_and_figure(judged, page):
    assert html.escape(headline_text(judged["headline"])) in page
    places = [page.index(f'id="{part}"') for part in ("lines", "wrong-row", "facts", "places", "errata")]
    assert places == sorted(places)
    lines = re.search(r'<table class="plain lines">(.*?)</table>', page, re.S)[1]
    names = re.findall(r'<th scope="row">(?:<a [^>]*>)?([^<]+)', lines)
    expected = [f"Table {n}" for n in (2, *range(4, 10))] + [f"Fig. {n}" for n in (7, 9, 11)]
    assert names == [*expected, "Equations", "Text"]
    others = re.search(r'<p class="rest">(.*?)</p>', page)[1]
    expected = [f"Table {n}" for n in (1, 3)] + [f"Fig. {n}" for n in (*range(1, 7), 12, 8, 10)]
    assert re.findall(r"<a [^>]*>([^<]+)", others) == expected
    assert "not true by exact" in page


def test_every_cell_of_a_table_has_print_and_reproduction_and_leads_to_its_file(judged, page):
    cell = re.search(r'<a href="#T9.typical.M8.mse" title="[^"]*">(.*?)<b>(.*?)</b></a>', page)
    assert cell.groups() == ("5.60", "5.60")
    row = re.search(r'<tr id="T9.typical.M8.mse">(.*?)</tr>', page, re.S)[1]
    assert "within 10 %" in row and "results/published/statistics.nc" in row and "level=" in row
    assert page.count('class="curve"') == 5  # panels of Fig. 7, over what was read off the print
    drawn = page.partition('id="place-fig-10"')[2].partition("</section>")[0]
    assert drawn.count("<svg") == 3  # mean square errors of Table 7, and percentiles of Fig. 9


def test_other_simulators_stand_beside_with_their_scores(judged, page, tmp_path):
    part = page.partition('<h2 id="simulators">')[2].partition("</details>")[0]
    rows = re.findall(r'<th scope="row">(.*?)</th>(.*?)</tr>', part)
    stored = json.loads((PAPER_FOLDER / SIMULATORS).read_text(encoding="utf-8"))
    assert [html.unescape(name) for name, _ in rows] == [row["name"] for row in stored]
    for (_, cells), row in zip(rows, stored, strict=True):
        numbers = re.findall(r"<td>([\d.]+)</td>", cells)
        assert numbers == [f"{row['table_7']:.3f}", f"{row['table_9']:.3f}", str(row["table_8"]["exact"])]
    folder = tmp_path / "paper"
    shutil.copytree(PAPER_FOLDER, folder, ignore=shutil.ignore_patterns(SIMULATORS))
    assert 'id="simulators"' not in verdict_page(judged, folder)


@pytest.mark.results
def test_pneumo_s_row_beside_other_simulators_is_of_todays_study(results):
    """Else the page would compare other simulators with a study that is no more."""
    row, *_ = json.loads((PAPER_FOLDER / SIMULATORS).read_text(encoding="utf-8"))
    scores = read_json(results / "verdict.json")["highlights"]["scores"]
    for table in (7, 9):
        assert row[f"table_{table}"] == scores[f"table_{table}_mse"]["rms_of_ln_ratio"]
    assert row["table_8"]["exact"] == scores["table_8"]["exact"]


def test_text_is_escaped(judged, page):
    assert "for this test &lt;&amp;&gt;" in page and "for this test <&>" not in page
    ledger = judged["assumptions"]
    name = next(iter(ledger))
    spoilt = judged | {"assumptions": ledger | {name: ledger[name] | {"unit": "<b>kg</b>"}}}
    text = verdict_page(spoilt, PAPER_FOLDER)
    assert "&lt;b&gt;kg&lt;/b&gt;" in text and "<b>kg</b>" not in text


@pytest.fixture(scope="module")
def file(page, tmp_path_factory):
    path = tmp_path_factory.mktemp("html") / "verdict.html"
    path.write_text(page, encoding="utf-8")
    return path


@in_chromium
class TestInBrowser:
    def test_loads_without_network_and_without_complaint_and_either_would_be_seen(self, visit, file):
        browser = visit(file)
        assert_quiet(browser, file)
        browser.run("fetch('http://localhost:9/').catch(() => 0)")
        assert len(browser.console) > 0  # the page's own policy forbids it

    def test_a_link_opens_the_part_that_holds_an_item(self, visit, file):
        browser = visit(file, "#T8.E07.M7")
        browser.wait("document.getElementById('T8.E07.M7').closest('details').open")
        top = browser.run("document.getElementById('T8.E07.M7').getBoundingClientRect().top")
        assert -1 <= top < browser.run("innerHeight")
        assert not browser.run("document.getElementById('T7.M8.mse').closest('details').open")

    def test_contrast_is_at_least_4_5(self, visit, file):
        browser = visit(file)
        browser.run("for (const details of document.querySelectorAll('details')) details.open = true")
        assert_readable(browser, 1500)

    @pytest.mark.slow
    def test_axe_finds_nothing(self, visit, file):
        # Rows are alike: every twentieth is enough.
        assert_accessible(
            visit, file, "document.querySelectorAll('.items tr').forEach((e, i) => i % 20 && e.remove())"
        )


def test_cell_text(printed_once):
    first, *others = cell_text(printed_once, "E07", "M8", 1.35).splitlines()
    assert len(others) == 5
    mse, mean, sigma = (float(re.search(rf"{name} (\S+)", first)[1]) for name in ("MSE", "mean", "sigma"))
    assert mse == pytest.approx(mean**2 + sigma**2, rel=1e-3)  # four printed digits
    wrong_n = "M8", 1.33, r"n = 1\.33: must be one of 1\.0, 1\.05"
    for model, n, words in (wrong_n, ("M99", 1.35, "model = 'M99': must be one of M1")):
        with pytest.raises(ResultError, match=words):
            cell_text(printed_once, "E07", model, n)
