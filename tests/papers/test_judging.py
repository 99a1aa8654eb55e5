"""Judging, on a study in which everything came out as printed: needs no results."""

import os
import shutil
import time
from pathlib import Path

import pytest
import xarray as xr
from typer.testing import CliRunner

from paper.study.known_papers import KNOWN, current_verdict
from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.stored_runs import read_study, to_json
from paper.study.stored_verdict import OF_EVIDENCE, stored_verdict
from paper_verdict.facts import MISPRINT, UNEXPLAINED, headline_text
from paper_verdict.judging import verdict
from paper_verdict.record import changes, read_record
from pneumo.cli.commands import app
from pneumo.errors import InputError, ResultError
from pneumo.storage.files import write, write_text

OF_M7 = {"S4.M7_40", "S4.M7_10", "S4.M7_mu", "S4.M7_sigma", "S4.M7_72"}

pytestmark = pytest.mark.xdist_group("printed")


@pytest.fixture
def results_as_printed(printed_once, tmp_path) -> Path:
    """A copy that a test may spoil."""
    return Path(shutil.copytree(printed_once, tmp_path / "results"))


@pytest.fixture
def paper(tmp_path) -> Path:
    """A copy of claims and published tables that a test may spoil."""
    return Path(shutil.copytree(PAPER_2006.folder, tmp_path / "paper"))


def write_study(results: Path, name: str, experiments: dict) -> None:
    whole = read_study(results / "parameters.json")
    write_text(to_json(whole._replace(name=name, experiments=experiments)), results / "parameters.json")


def test_a_perfect_reproduction_is_exact_but_for_the_papers_mistakes(judged_once):
    statuses = {item["id"]: item["agreement"] or item["status"] for item in judged_once["items"]}
    names = {status: {name for name in statuses if statuses[name] == status} for status in statuses.values()}
    assert {name for name in statuses if name.startswith(("T", "F"))} - names["exact"] == {"T4.E.k_0=0.02"}
    assert UNEXPLAINED not in names
    alike = {"S4.alike.adiabatic", "S4.alike.typical", "S4.levels.adiabatic", "S4.best_choice"}
    assert names["differs, explained"] == alike | {"S4.slpm_D", "S4.slpm_E"}
    known = OF_M7 | {
        "S4.runs",
        "S4.n_step",
        "S4.models_with_n",
        "S2.eq5",
        "S2.eq4_7",
        "A2.eq17",
        "T4.E.k_0=0.02",
    }
    assert known <= names[MISPRINT]
    scores = judged_once["highlights"]["scores"]
    equal = {"rms_of_ln_ratio": 0.0, "lowest_ratio": 1.0, "highest_ratio": 1.0}
    assert scores["table_7_mse"] == {"cells": 10} | equal
    assert scores["table_8"] == {"cells": 96, "exact": 96, "exact_or_close": 96}
    row = judged_once["highlights"]["wrong_row"][0]
    assert (row["model"], row["mu"]) == ("M7", -237.0)
    facts = {fact["name"]: fact["status"] for fact in judged_once["facts"]}
    assert "differs, unexplained" not in facts.values() and facts["quoted_row"] == "misprint"
    assert judged_once["headline"]["came_out"] == judged_once["headline"]["predictions"] == 7
    shown = {item["id"]: item["shown"] for item in judged_once["items"]}
    assert shown["ABS.ten_percent"].startswith("10 % (") and shown["T5.E01.P_A"] == "7.844 s"
    assert shown["T9.adiabatic.M1.mu"] == "-110"  # in hundreds of Pa, as its table says


@pytest.mark.slow
def test_another_study_is_judged_without_the_papers_experiments(results_as_printed):
    results = results_as_printed
    whole = read_study(results / "parameters.json")
    few = {name: whole.experiments[name] for name in ("E06", "E12")}
    write_study(results, "smoke", few)
    for file in ("settling.nc", "published/statistics.nc", "exact/statistics.nc"):
        with xr.open_dataset(results / file) as opened:
            dataset = opened.load()
        write(dataset.sel(experiment=list(few)), results / file, {})
    judged = verdict(PAPER_2006, results)
    items = {item["id"]: item for item in judged["items"]}
    assert judged["study"] == "smoke" and judged["highlights"]["transport"] is None
    assert items["T5.E14.P_A"]["status"] == "not judged"
    assert "this study has no E14" in items["T5.E14.P_A"]["reason"]
    assert items["T5.E06.P_A"]["agreement"] == "exact"
    write_study(results, "paper", {name: e._replace(steps=e.steps // 10) for name, e in few.items()})
    judged = verdict(PAPER_2006, results)
    items = {item["id"]: (item["status"], item["reason"]) for item in judged["items"]}
    assert items["T5.E06.P_A"] == ("not judged", "the parameters of E06, E12 are not the paper's")
    assert items["S2.sonic_coefficient"][0] == "agrees"
    assert UNEXPLAINED not in {status for status, _ in items.values()}
    assert judged["headline"]["predictions"] == judged["headline"]["choices"] == 0


def test_results_of_another_study_are_named_as_such(results_as_printed):
    whole = read_study(results_as_printed / "parameters.json")
    write_study(results_as_printed, "32 x 200 mm", {"own": whole.experiments["E06"]})
    with pytest.raises(ResultError, match="holds another study, 32 x 200 mm, with the experiments own;"):
        verdict(PAPER_2006, results_as_printed)


def test_a_stored_verdict_is_shown_until_a_file_behind_it_is_newer(
    results_as_printed, paper, monkeypatch, tmp_path
):
    monkeypatch.setattr("paper.study.stored_verdict.KEPT", tmp_path / "kept")
    reads, file = KNOWN["2006"].reads, results_as_printed / "verdict.json"
    assert stored_verdict(results_as_printed, paper, reads) is None
    write_text('{"items": []}', file)
    later = time.time() + 10
    os.utime(file, (later, later))
    assert stored_verdict(results_as_printed, paper, reads) == {"items": []}
    kept = tmp_path / "kept" / OF_EVIDENCE[0]
    write_text("", kept)
    for newer in (kept, paper / "claims.yaml", results_as_printed / "datum/E06.nc"):
        os.utime(newer, (later + 1, later + 1))
        assert stored_verdict(results_as_printed, paper, reads) is None
        os.utime(newer, (later - 1, later - 1))
    write_text('{"items": [', file)
    assert stored_verdict(results_as_printed, paper, reads) is None  # cut short


def test_a_papers_file_that_is_missing_is_an_error_of_the_user(monkeypatch, tmp_path):
    monkeypatch.setattr("paper.study.known_papers.PAPERS", tmp_path)
    done = CliRunner().invoke(app, ["paper", "verdict", "--results", str(tmp_path)])
    assert isinstance(done.exception, InputError) and "no such folder" in str(done.exception)


@pytest.mark.slow
def test_explain_tells_an_item_and_a_cell_and_verdict_counts(printed_once, judged_once):
    for what, first, words in (
        (["T7.M8.mse"], "T7.M8.mse", "1.16e7 Pa²"),
        (["E07", "M8", "1.35"], "E07", "E07 M8 n = 1.35  exact      chamber B:"),
    ):
        done = CliRunner().invoke(app, ["paper", "explain", *what, "--results", str(printed_once)])
        assert done.exit_code == 0 and done.stdout.startswith(first) and words in done.stdout
    done = CliRunner().invoke(app, ["paper", "verdict", "--results", str(printed_once)])
    lines = done.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert " ".join(lines).startswith(headline_text(judged_once["headline"]))
    assert "M7 with n = 1.35 has the errors that the text quotes (0 of 5 within tolerance;" in done.stdout


@pytest.mark.results
def test_every_fact_has_its_recorded_status(results):
    """A worse fact fails, and a better one does until ``pneumo paper verdict --record`` accepts it."""
    facts = current_verdict(results, "2006")["facts"]
    record = read_record(PAPER_FOLDER, [fact["name"] for fact in facts])
    assert [change.text for change in changes(facts, record)] == []
