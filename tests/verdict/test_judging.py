"""Judging, on a study in which everything came out as printed: needs no results."""

import json
import re
import shutil
from pathlib import Path

import pytest
import xarray as xr
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.configuration.study_json import from_json, to_json
from pneumo.errors import ResultError
from pneumo.papers.paper_2006.current_verdict import current_verdict
from pneumo.papers.paper_2006.erratum_proofs import PROOFS
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.storage.files import read_json, write, write_json
from pneumo.verdict.judging import Judge, statuses_text, verdict
from pneumo.verdict.sources import StudyResults
from pneumo.verdict.stored_verdict import stored_verdict

OF_M7 = {"S4.M7_40", "S4.M7_10", "S4.M7_mu", "S4.M7_sigma", "S4.M7_72", "S4.best_choice"}

pytestmark = pytest.mark.xdist_group("printed")


@pytest.fixture(scope="module")
def printed(printed_once) -> Path:
    return printed_once


@pytest.fixture(scope="module")
def judged(judged_once) -> dict:
    return judged_once


@pytest.fixture
def results(printed, tmp_path) -> Path:
    """A copy that a test may spoil."""
    return Path(shutil.copytree(printed, tmp_path / "results"))


@pytest.fixture
def paper(tmp_path) -> Path:
    """A copy of claims and published tables that a test may spoil."""
    return Path(shutil.copytree(PAPER_2006.folder, tmp_path / "paper"))


def status(results: Path, name: str, paper: Path = PAPER_2006.folder) -> str:
    judge = Judge(results, PAPER_2006._replace(folder=paper))
    return judge.judge(judge.claims.items[name])["status"]


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def scale_netcdf(file: Path, variable: str, factor: float, **labels: str) -> None:
    with xr.open_dataset(file) as opened:
        dataset = opened.load()
    dataset[variable].loc[labels] *= factor
    write(dataset, file, {})


def scale_settling_time(results: Path, factor: float) -> None:
    scale_netcdf(results / "settling.nc", "settling_time", factor, experiment="E14", quantity="P_A")


# The study as printed


def test_a_perfect_reproduction_is_exact_but_for_the_papers_own_mistakes(judged):
    not_exact = {item["id"]: item["status"] for item in judged["items"] if item["status"] != "exact"}
    assert {name: status for name, status in not_exact.items() if name.startswith("T")} == {
        "T4.E.k_0=0.02": "explained",
        "T5.E04.P_B": "unreadable",
        "T5.E04.T_A": "unreadable",
        "T5.E08.T_A": "unreadable",
    }
    assert "missed" not in not_exact.values()
    contradicted = {name for name, status in not_exact.items() if status == "contradicted"}
    alike = {"S4.alike.adiabatic", "S4.alike.typical", "S4.levels.adiabatic"}
    assert contradicted == OF_M7 | alike | {"S4.slpm_D", "S4.slpm_E"}
    explained = {name for name, status in not_exact.items() if status == "explained"}
    assert {"S4.runs", "S4.n_step", "S4.models_with_n", "S2.eq5", "S2.eq4_7", "A2.eq17"} <= explained


def test_counts_and_highlights(judged):
    counts = dict(judged["counts"])
    assert counts.pop("items") == len(judged["items"]) == sum(counts.values())
    scores = judged["highlights"]["scores"]
    equal = {"rms_of_ln_ratio": 0.0, "lowest_ratio": 1.0, "highest_ratio": 1.0}
    assert scores["table_7_mse"] == {"cells": 10} | equal
    assert scores["table_9_mse"] == {"cells": 30} | equal
    assert scores["table_8"] == {"cells": 96, "exact": 96, "exact_or_close": 96}
    assert scores["table_5"] == {"cells": 61, "exact": 61, "exact_or_close": 61}
    row = judged["highlights"]["wrong_row"][0]
    assert (row["model"], row["mu"]) == ("M7", -237.0)
    lines = statuses_text(judged["items"]).splitlines()
    assert lines[0] == "id,status" and "T4.E.k_0=0.02,explained" in lines


# What must not go unnoticed


def test_a_changed_result_is_noticed(results):
    statuses = [status(results, "T5.E14.P_A")]
    for _ in range(2):
        scale_settling_time(results, 1.015)
        statuses.append(status(results, "T5.E14.P_A"))
    assert statuses == ["exact", "close", "missed"]


def test_a_changed_statistic_changes_what_the_text_says_of_it(results):
    assert status(results, "S4.M5_40") == "exact"
    for factor, expected in ((1.05, "close"), (1.10, "missed")):
        scale_netcdf(results / "published/statistics.nc", "mse", factor, level="overall", model="M5")
        assert status(results, "S4.M5_40") == expected


@pytest.mark.parametrize(
    ("item", "before", "file", "old", "new", "after"),
    [
        ("T7.M8.mse", "exact", "published/table7.csv", "M8,mse,1.16e7", "M8,mse,1.61e7", "missed"),
        ("T8.E07.M7", "exact", "published/table8.csv", "E07,M7,1.35", "E07,M7,1.25", "missed"),
        ("S2.critical_ratio", "exact", "claims.yaml", '"0.5283"', '"0.5823"', "contradicted"),
        ("S4.runs", "explained", "errata.yaml", 'S4.runs: "1056"', 'S4.runs: "1065"', "contradicted"),
    ],
)
def test_a_changed_number_of_the_paper_is_noticed(printed, paper, item, before, file, old, new, after):
    assert status(printed, item, paper) == before
    edit(paper / file, old, new)
    assert status(printed, item, paper) == after


def test_an_erratum_whose_proof_fails_explains_nothing(printed, monkeypatch):
    assert status(printed, "S2.eq5") == "explained"
    monkeypatch.setitem(PROOFS, "eq5_factor_T", lambda: (False, "no"))
    assert status(printed, "S2.eq5") == "contradicted"


def test_an_alternative_assumption_explains_only_where_it_was_run_and_fits(results, paper):
    scale_settling_time(results, 1.5)
    named = "    assumptions: {T5.E14.P_A: hold.hold_longer}\n"
    edit(paper / "claims.yaml", "    errata: {T5.E04", f"{named}    errata: {{T5.E04")
    assert status(results, "T5.E14.P_A", paper) == "missed"
    for value, expected in ((1.5, "missed"), (1.290, "explained")):
        labels = {"alternative": ["hold.hold_longer"], "item": ["T5.E14.P_A"]}
        alternatives = xr.Dataset({"reproduced": (tuple(labels), [[value]])}, labels)
        write(alternatives, results / "assumptions.nc", {})
        assert status(results, "T5.E14.P_A", paper) == expected


def test_another_study_is_judged_without_the_papers_experiments(results):
    whole = from_json(read_json(results / "parameters.json"))
    few = {name: whole.experiments[name] for name in ("E06", "E12")}
    write_json(to_json(whole._replace(name="smoke", experiments=few)), results / "parameters.json")
    for file in ("settling.nc", "published/statistics.nc", "exact/statistics.nc"):
        with xr.open_dataset(results / file) as opened:
            dataset = opened.load()
        write(dataset.sel(experiment=list(few)), results / file, {})
    found = verdict(results, PAPER_2006)
    items = {item["id"]: item for item in found["items"]}
    assert found["study"] == "smoke"
    assert found["highlights"]["transport"] is None
    assert items["T5.E14.P_A"]["status"] == "missed"
    assert "not to be judged: this study has no E14" in items["T5.E14.P_A"]["reason"]
    assert items["T5.E06.P_A"]["status"] == "exact"


@pytest.mark.parametrize("text", ['{"name": 1}', '{"name": "", "experiments": [1]}', '{"a": "\\u0000"}'])
def test_parameters_that_are_no_study_are_refused(tmp_path, text):
    write_json(text, tmp_path / "parameters.json")
    with pytest.raises(ResultError, match=r"parameters\.json: does not hold a study"):
        _ = StudyResults(tmp_path, "published").study


# The verdict that a folder of results holds


def test_a_stored_verdict_is_shown_while_nothing_it_was_made_from_changed(results, paper, judged):
    def stored(module: str = PAPER_2006.module) -> dict | None:
        return stored_verdict(results, paper, module)

    assert stored() is None
    found = verdict(results, PAPER_2006._replace(folder=paper))
    assert json.dumps(found["items"]) == json.dumps(judged["items"])  # the same results, the same text
    write_json(json.dumps(found), results / "verdict.json")
    assert stored() | {"sha256": ""} == json.loads(json.dumps(found)) | {"sha256": ""}
    assert stored("pneumo.verdict.judging") is None  # other code
    scale_settling_time(results, 1.5)
    assert stored() is None
    anew = current_verdict(results, paper)
    assert anew["counts"] != found["counts"]
    write_json(json.dumps(anew), results / "verdict.json")
    assert stored() is not None
    edit(paper / "claims.yaml", "# What the paper claims", "# What it claims")
    assert stored() is None


# The command line


def test_explain_tells_an_item_and_a_cell(printed):
    item = CliRunner().invoke(app, ["paper", "explain", "T7.M8.mse", "--results", str(printed)])
    assert item.exit_code == 0
    assert item.stdout.splitlines()[0] == "T7.M8.mse"
    assert "1.16e7 Pa²" in item.stdout
    cell = CliRunner().invoke(app, ["paper", "explain", "E07", "M8", "1.35", "--results", str(printed)])
    assert cell.exit_code == 0
    assert "E07 M8 n = 1.35  exact      chamber B:" in cell.stdout


@pytest.mark.parametrize(
    ("what", "words"),
    [
        (["T7.M11.mse"], "T7.M11.mse: no such item; there are T7.M1.mu"),
        (["nonsense"], "nonsense: no such item"),
        (["E07", "M8"], "name one item"),
        (["E07", "M8", "x"], "n = 'x': must be a number"),
    ],
)
def test_explain_says_what_is_wrong(printed, what, words):
    with pytest.raises(ResultError, match=re.escape(words)):
        command = ["paper", "explain", *what, "--results", str(printed)]
        CliRunner().invoke(app, command, catch_exceptions=False)


def test_verdict_counts(printed, judged):
    done = CliRunner().invoke(app, ["paper", "verdict", "--results", str(printed)])
    assert done.stdout.splitlines()[-1].startswith(f"{len(judged['items'])} items, ")
    assert "contradicted  S4.M7_40" in done.stdout
