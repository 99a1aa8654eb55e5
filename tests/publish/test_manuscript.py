"""The manuscript: its numbers are those of the results, the same bytes twice, six to eight pages."""

import json
import shutil

import pytest
import typst
from checkout import ROOT

from paper.study.stored_runs import read_json
from paper.study.text import manuscript as m
from paper_verdict.facts import headline_text

FOLDER = ROOT / "paper/manuscript"

pytestmark = pytest.mark.results


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project with the study's verdict and the manuscript's source."""
    root = tmp_path_factory.mktemp("a manuscript")
    (root / "results/figures").mkdir(parents=True)
    shutil.copy(ROOT / "results/figures/traces.svg", root / "results/figures")
    shutil.copytree(FOLDER, root / "paper/manuscript")
    of_study = [ROOT / "results" / name for name in ("parameters.json", "verdict.json")]
    frozen = json.loads((FOLDER / "frozen.json").read_text(encoding="utf-8"))
    numbers = json.dumps(m.manuscript_numbers(*of_study) | frozen)
    (root / "results/manuscript.json").write_text(numbers, encoding="utf-8")
    return root


def test_numbers_are_those_of_the_results(project):
    quoted = json.loads((project / "results/manuscript.json").read_text(encoding="utf-8"))
    verdict = read_json(ROOT / "results/verdict.json")
    assert quoted["verdict"]["headline"] == headline_text(verdict["headline"])
    assert quoted["setup"]["replays"] == "1056"
    assert quoted["verdict"]["claimed"]["of_M6"] == "40 %"
    rows = {(row["level"], row["source"]): row for row in quoted["verdict"]["transport"]}
    assert quoted["verdict"]["exact"]["typical"] == f"{100 * float(rows['typical', 'exact']['M8/M7']):.0f} %"


def test_it_is_typeset_twice_to_the_same_bytes_on_six_to_eight_pages(project):
    source, one, two = project / "paper/manuscript/manuscript.typ", project / "one.pdf", project / "two.pdf"
    for output in (one, two):
        m.compile_pdf(source, project, output)
    assert one.read_bytes() == two.read_bytes()
    assert one.read_bytes()[:5] == b"%PDF-" and str(project).encode() not in one.read_bytes()
    pages = typst.compile(str(source), root=str(project), format="png", ppi=20, ignore_system_fonts=True)
    assert isinstance(pages, list) and 6 <= len(pages) <= 8
