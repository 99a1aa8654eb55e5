"""The examples, papers of other fields: their recorded verdicts and errata, and numbers made again."""

import importlib.util
import re
from pathlib import Path

import pytest
from small_papers import EXAMPLES, NAMES

from paper_verdict import Judge, load_paper, page
from paper_verdict.command import main


def written_by(folder: Path, into: Path) -> Path:
    """Reproduced values, computed again."""
    spec = importlib.util.spec_from_file_location("compute_again", folder / "compute.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (module.write_all if hasattr(module, "write_all") else module.write)(into)
    return into


@pytest.mark.parametrize("name", NAMES)
def test_the_verdict_is_the_recorded_one(name, capsys):
    assert main(["check", str(EXAMPLES / name)]) == 0
    assert "Every fact has its recorded status." in capsys.readouterr().out


@pytest.mark.parametrize("name", NAMES)
def test_numbers_are_those_that_its_program_computes(name, tmp_path):
    again = written_by(EXAMPLES / name, tmp_path / "again")
    stored = sorted(f for f in (EXAMPLES / name / "reproduced").rglob("*") if f.is_file())
    assert stored
    for file in stored:
        other = again / file.relative_to(EXAMPLES / name / "reproduced")
        assert other.read_text() == file.read_text(), file


@pytest.mark.parametrize("name", NAMES)
def test_each_has_a_misprint_that_a_proof_shows(name):
    judged = Judge(load_paper(EXAMPLES / name)).verdict()
    misprints = [fact for fact in judged["facts"] if fact["status"] == "misprint"]
    assert misprints and "differs, unexplained" not in {fact["status"] for fact in judged["facts"]}
    text = page(judged)
    for item in judged["items"]:
        assert text.count(f'id="{item["id"].replace(" ", "_")}"') == 1
    ids = re.findall(r'id="([^"]*)"', text)
    assert len(set(ids)) == len(ids)
    assert {link for link in re.findall(r'href="#([^"]*)"', text)} <= set(ids)
    assert "http:" not in text and "https:" not in text.replace("https://doi.org", "")  # loads nothing


def test_deviations_over_seeds_come_from_the_repeated_results(example):
    folder = example("needles")
    items = {item["id"]: item for item in Judge(load_paper(folder)).verdict()["items"]}
    wolf = items["T1.Wolf.crossings"]
    share = 2 * 0.8 / 3.14159
    expected = (5000 * share * (1 - share)) ** 0.5  # of a binomial distribution
    deviation = (wolf["reproduced"] - 2532) / wolf["seeds"]
    assert deviation == pytest.approx(expected, rel=0.4)  # from 20 seeds: 16 %
    claims = folder / "claims.yaml"
    claims.write_text(claims.read_text().replace("repeats: seeds/*", "repeats: none/*"))
    assert main(["check", str(folder)]) == 2
