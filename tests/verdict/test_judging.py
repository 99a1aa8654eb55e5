"""The verdict's machinery, on a study in which everything came out as printed: needs no results."""

import json
import math
import re
import shutil
from pathlib import Path

import pytest
import xarray as xr
import yaml
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.configuration.exchange import from_json, to_json
from pneumo.configuration.parameters import load, study
from pneumo.errors import ResultError
from pneumo.papers.paper_2006.computations import COMPUTATIONS
from pneumo.papers.paper_2006.erratum_proofs import PROOFS
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.papers.paper_2006.summary import scores
from pneumo.physics.valve import choked_flow
from pneumo.storage.files import read_json, write, write_json
from pneumo.verdict.assumptions import read_assumptions
from pneumo.verdict.claims import Claim, PaperError, ToleranceClass, read_claims
from pneumo.verdict.comparison import as_printed, compare
from pneumo.verdict.errata import read_errata
from pneumo.verdict.judging import STATUSES, Judge, read_statuses, statuses_text, verdict
from pneumo.verdict.published import read_table
from pneumo.verdict.sources import Finding, StudyResults

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "paper/2006"
PLANT_D = study(load(ROOT / "config/paper.yaml")).experiments["E01"].plant
CELLS = {1: 40, 2: 4, 4: 8, 5: 64, 6: 16, 7: 30, 8: 96, 9: 90}
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
    ignored = shutil.ignore_patterns("decisions", "readme", "*.png")
    return Path(shutil.copytree(PAPER, tmp_path / "paper", ignore=ignored))


def status(results: Path, name: str, paper: Path = PAPER) -> str:
    judge = Judge(results, PAPER_2006._replace(folder=paper))
    return judge.judge(judge.claims.items[name])["status"]


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")


def edit_netcdf(file: Path, variable: str, factor: float, **labels: str) -> None:
    with xr.open_dataset(file) as opened:
        dataset = opened.load()
    dataset[variable].loc[labels] *= factor
    write(dataset, file, {})


# Claims, classes and ledgers hold together


def test_every_cell_of_the_tables_is_an_item():
    items = read_claims().items
    assert len(items) >= 330
    found = [claim.table for claim in items.values()]
    assert {table: found.count(table) for table in CELLS} == CELLS
    assert found.count(None) >= 80


def test_classes_are_those_of_the_decision():
    assert classes_of(PAPER) == decided()


def decided() -> dict[str, tuple[float, str]]:
    """Class -> (limit, unit words) from the table of decision 10."""
    text = (ROOT / "paper/decisions/0010-tolerance-classes.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([\d.e-]+)( %)?(.*?) \|", text, re.MULTILINE)
    words = {"": "absolute", " absolute": "absolute", " of the row's printed sigma": "sigma"}
    words |= {" of the swing": "swing", " of log10": "log10", " or 1 ms": "relative"}
    found = {}
    for name, number, percent, after in rows:
        measure = "relative" if percent and not after else words[after]
        found[name] = (float(number) / (100 if percent else 1), "truth" if name == "statement" else measure)
    return found


def classes_of(paper: Path) -> dict[str, tuple[float, str]]:
    classes = read_claims(paper).classes
    assert classes["settling"].floor == 0.001
    return {name: (tolerance.limit, tolerance.measure) for name, tolerance in classes.items()}


def test_every_claim_can_be_judged():
    claims = read_claims()
    errata, assumptions = read_errata(PAPER, PROOFS), read_assumptions()
    for claim in claims.items.values():
        assert claim.compute in COMPUTATIONS, claim.id
        assert claim.statement or claim.table, claim.id
        assert claim.evidence.path.startswith(("results/", "pneumo/", "paper/")), claim.id
        for erratum in filter(None, (claim.erratum, claim.see)):
            assert erratum in errata, claim.id
        if claim.assumption:
            name, alternative = claim.assumption.split(".")
            assert alternative in assumptions[name].alternatives, claim.id
        if not claim.evidence.path.startswith("results/"):
            assert (ROOT / claim.evidence.path).is_file(), claim.id


def test_every_computation_is_used():
    assert {claim.compute for claim in read_claims().items.values()} == set(COMPUTATIONS)


@pytest.mark.parametrize("name", PROOFS)
def test_proof_of_erratum(name):
    passes, evidence = PROOFS[name]()
    assert passes, evidence
    assert evidence


def test_every_proof_belongs_to_an_erratum():
    errata = read_errata(PAPER, PROOFS)
    assert [erratum.proof for erratum in errata.values()] == list(PROOFS)
    claims = read_claims().items
    assert {name for erratum in errata.values() for name in erratum.values} <= set(claims)


def test_assumptions_are_those_of_the_configuration():
    config = yaml.safe_load((ROOT / "config/paper.yaml").read_text(encoding="utf-8"))

    def at(key: str):
        node = config
        for part in key.split("."):
            node = node[part]
        return node

    for name, entry in read_assumptions().items():
        assert bool(entry.config) != bool(entry.code), name
        values = entry.value if isinstance(entry.value, list) else [entry.value] * len(entry.config)
        assert not entry.config or [at(key) for key in entry.config] == values, name
        for alternative in entry.alternatives.values():
            for key, value in alternative.items() if isinstance(alternative, dict) else ():
                assert at(key) != value, (name, key)


def test_statuses_are_recorded_for_every_item():
    recorded = read_statuses()
    assert list(recorded) == list(read_claims().items)
    assert set(recorded.values()) <= set(STATUSES)


# The study as printed


def test_a_perfect_reproduction_is_exact_but_for_the_papers_own_mistakes(judged):
    not_exact = {item["id"]: item["status"] for item in judged["items"] if item["status"] != "exact"}
    cells = {name: found for name, found in not_exact.items() if name.startswith("T")}
    assert cells == {
        "T4.E.k_0=0.02": "explained",
        "T5.E04.P_B": "unreadable",
        "T5.E04.T_A": "unreadable",
        "T5.E08.T_A": "unreadable",
    }
    assert "missed" not in not_exact.values()
    contradicted = {name for name, found in not_exact.items() if found == "contradicted"}
    alike = {"S4.alike.adiabatic", "S4.alike.typical", "S4.levels.adiabatic"}
    assert contradicted == OF_M7 | alike | {"S4.slpm_D", "S4.slpm_E"}
    explained = {name for name, found in not_exact.items() if found == "explained"}
    assert {"S4.runs", "S4.n_step", "S4.models_with_n", "S2.eq5", "S2.eq4_7", "A2.eq17"} <= explained


def test_counts_and_highlights(judged):
    counts = dict(judged["counts"])
    assert counts.pop("items") == len(judged["items"]) == sum(counts.values())
    scores = judged["highlights"]["scores"]
    assert scores["table_7_mse"] | {"cells": 0} == {
        "cells": 0,
        "rms_of_ln_ratio": 0.0,
        "lowest_ratio": 1.0,
        "highest_ratio": 1.0,
    }
    assert (scores["table_7_mse"]["cells"], scores["table_9_mse"]["cells"]) == (10, 30)
    assert scores["table_8"] == {"cells": 96, "exact": 96, "exact_or_close": 96}
    assert scores["table_5"] == {"cells": 61, "exact": 61, "exact_or_close": 61}
    row = judged["highlights"]["wrong_row"][0]
    assert row["model"] == "M7"
    assert row["mu"] == -237.0


def test_the_same_results_give_the_same_text(judged, printed):
    texts = [json.dumps(found, allow_nan=False) for found in (judged, verdict(printed, PAPER_2006))]
    assert texts[0] == texts[1]


def test_statuses_text(judged):
    lines = statuses_text(judged["items"]).splitlines()
    assert lines[0] == "id,status"
    assert "T4.E.k_0=0.02,explained" in lines


# Mutations: what must not go unnoticed


def test_a_changed_result_is_noticed(results):
    assert status(results, "T5.E14.P_A") == "exact"
    edit_netcdf(results / "settling.nc", "settling_time", 1.015, experiment="E14", quantity="P_A")
    assert status(results, "T5.E14.P_A") == "close"
    edit_netcdf(results / "settling.nc", "settling_time", 1.015, experiment="E14", quantity="P_A")
    assert status(results, "T5.E14.P_A") == "missed"


def test_a_changed_statistic_changes_what_the_text_says_of_it(results):
    assert status(results, "S4.M5_40") == "exact"
    for factor, expected in ((1.05, "close"), (1.10, "missed")):
        edit_netcdf(results / "published/statistics.nc", "mse", factor, level="overall", model="M5")
        assert status(results, "S4.M5_40") == expected


def test_a_changed_published_number_is_noticed(printed, paper):
    edit(paper / "published/table7.csv", "M8,mse,1.16e7", "M8,mse,1.61e7")
    assert status(printed, "T7.M8.mse", paper) == "missed"
    edit(paper / "published/table8.csv", "E07,M7,1.35", "E07,M7,1.25")
    assert status(printed, "T8.E07.M7", paper) == "missed"


def test_a_changed_claim_is_noticed(printed, paper):
    edit(paper / "claims.yaml", 'printed: "0.5283"', 'printed: "0.5823"')
    assert status(printed, "S2.critical_ratio", paper) == "contradicted"


def test_a_changed_tolerance_is_noticed(paper):
    edit(paper / "claims.yaml", "mse: {limit: 0.1,", "mse: {limit: 0.2,")
    assert classes_of(paper) != decided()


def test_an_erratum_whose_proof_fails_explains_nothing(printed, paper, monkeypatch):
    assert status(printed, "S2.eq5", paper) == "explained"
    monkeypatch.setitem(PROOFS, "eq5_factor_T", lambda: (False, "no"))
    assert status(printed, "S2.eq5", paper) == "contradicted"


def test_a_meant_number_must_fit(printed, paper):
    assert status(printed, "S4.runs", paper) == "explained"
    edit(paper / "errata.yaml", 'S4.runs: "1056"', 'S4.runs: "1065"')
    assert status(printed, "S4.runs", paper) == "contradicted"


def test_an_alternative_assumption_explains_only_where_it_was_run_and_fits(results, paper):
    edit_netcdf(results / "settling.nc", "settling_time", 1.5, experiment="E14", quantity="P_A")
    edit(
        paper / "claims.yaml",
        "    errata: {T5.E04",
        "    assumptions: {T5.E14.P_A: hold.hold_longer}\n    errata: {T5.E04",
    )
    assert status(results, "T5.E14.P_A", paper) == "missed"
    for value, expected in ((1.5, "missed"), (1.290, "explained")):
        labels = {"alternative": ["hold.hold_longer"], "item": ["T5.E14.P_A"]}
        toggled = xr.Dataset({"reproduced": (tuple(labels), [[value]])}, labels)
        write(toggled, results / "assumptions.nc", {})
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


def test_scores_of_known_items():
    cell = {"table": 7, "column": "mse", "status": "exact", "reproduced": 1.0, "deviation": 0.25}
    items = [
        cell,
        cell | {"deviation": -0.2, "status": "missed"},
        cell | {"reproduced": "none", "status": "contradicted"},
        cell | {"status": "unreadable"},
        cell | {"table": 5, "column": "P_A", "status": "close"},
    ]
    found = scores(items)
    assert found["table_7_mse"] == {
        "cells": 2,
        "rms_of_ln_ratio": pytest.approx(math.log(1.25), abs=1e-6),
        "lowest_ratio": pytest.approx(0.8),
        "highest_ratio": pytest.approx(1.25),
    }
    assert found["table_5"] == {"cells": 1, "exact": 0, "exact_or_close": 1}
    assert found["missed_of_readable"] == 0.25


def test_mean_errors_are_judged_by_the_deviation_printed_beside_them():
    claims = read_claims().items
    assert (claims["T7.M1.mu"].sigma, claims["T9.adiabatic.M1.mse"].sigma) == (19_900.0, None)
    for name in ("T9.adiabatic.M1", "T9.typical.M5"):
        assert claims[f"{name}.mu"].sigma == claims[f"{name}.sigma"].value


def test_the_largest_flow_is_in_standard_litres_per_minute(printed):
    valve = PLANT_D.valve
    kg_per_s = choked_flow(valve.k_xu * valve.u_max, 7e5, 293.0, PLANT_D.gas)
    litre = 101325 * 1e-3 / (287.0 * 293.15)  # kg
    found = COMPUTATIONS["largest_flow"](StudyResults(printed, "published"), "D").value
    assert found == pytest.approx(kg_per_s / litre * 60, rel=1e-12)


# The command line


def test_explain_tells_an_item_and_a_cell(printed):
    item = CliRunner().invoke(app, ["explain", "T7.M8.mse", "--results", str(printed)])
    assert item.exit_code == 0
    assert item.stdout.splitlines()[0] == "T7.M8.mse"
    assert "1.16e7 Pa²" in item.stdout
    cell = CliRunner().invoke(app, ["explain", "E07", "M8", "1.35", "--results", str(printed)])
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
        CliRunner().invoke(app, ["explain", *what, "--results", str(printed)], catch_exceptions=False)


def test_verdict_counts(printed, judged):
    done = CliRunner().invoke(app, ["verdict", "--results", str(printed)])
    assert done.stdout.splitlines()[-1].startswith(f"{len(judged['items'])} items, ")
    assert "contradicted  S4.M7_40" in done.stdout


# Comparison


def claim(**changes) -> Claim:
    fields = {"id": "X", "where": "", "printed": "2.0", "kind": "rounded", "tolerance": "x", "compute": "x"}
    fields |= {"evidence": {"path": "results/x", "select": ""}}
    return Claim(**fields | changes)


def tolerance(measure: str, limit: float, floor: float = 0.0) -> ToleranceClass:
    return ToleranceClass(measure=measure, limit=limit, floor=floor)


@pytest.mark.parametrize(
    ("found", "kind", "limit", "changes", "expected"),
    [
        (2.05, "relative", 0.1, {}, "exact"),  # the edge of half a unit
        (2.0501, "relative", 0.1, {}, "close"),
        (2.2, "relative", 0.1, {}, "close"),  # the edge of the class
        (2.2001, "relative", 0.1, {}, None),
        (1.7999, "relative", 0.1, {}, None),
        (2.06, "absolute", 0.05, {}, None),
        (1.0, "relative", 0.1, {"sense": "at_most"}, "exact"),
        (2.2, "relative", 0.1, {"sense": "at_most"}, "close"),
        (2.3, "relative", 0.1, {"sense": "at_most"}, None),
        (2.5, "sigma", 0.1, {"sigma": 5.0}, "close"),
        (2.6, "sigma", 0.1, {"sigma": 5.0}, None),
        (24.0, "relative", 0.0, {"printed": "20", "digits": 1}, "exact"),
        (0.205, "relative", 0.0, {"printed": "20", "scale": 0.01}, "exact"),
        (-2.05, "relative", 0.0, {"printed": "-2.0"}, "exact"),
        (0.1, "log10", 0.1, {"sense": "at_most"}, "exact"),
        (0.11, "log10", 0.1, {"sense": "at_most"}, None),
        (0.11, "log10", 0.1, {"sense": "at_least"}, "exact"),
        (-0.2, "log10", 0.1, {"sense": "at_least"}, None),
    ],
)
def test_comparison_of_numbers(found, kind, limit, changes, expected):
    assert compare(claim(**changes), tolerance(kind, limit), Finding(found)).agreement == expected


def test_comparison_with_a_floor_a_swing_and_an_interval():
    quick = claim(printed="0.0108")
    assert compare(quick, tolerance("relative", 0.02, 0.001), Finding(0.0118)).agreement == "close"
    assert compare(quick, tolerance("relative", 0.02), Finding(0.0118)).agreement is None
    assert compare(claim(), tolerance("swing", 0.01), Finding(2.09, swing=10.0)).agreement == "close"
    assert compare(claim(), tolerance("swing", 0.01), Finding(2.11, swing=10.0)).agreement is None
    between = compare(claim(), tolerance("relative", 0.1), Finding(low=1.0, high=3.0))
    assert between == ("close", 0.0, 0.1)  # never exact: the paper does not say which run it means
    assert compare(claim(), tolerance("relative", 0.1), Finding(low=2.3, high=3.0)).agreement is None


def test_comparison_of_statements_and_words():
    assert compare(claim(), tolerance("truth", 0.0), Finding(holds=True)).agreement == "exact"
    assert compare(claim(), tolerance("truth", 0.0), Finding(holds=False)).agreement is None
    assert compare(claim(printed="×"), tolerance("absolute", 0.0), Finding(shown="×")).agreement == "exact"
    assert compare(claim(printed="×"), tolerance("absolute", 0.0), Finding(shown="✓")).agreement is None


@pytest.mark.parametrize(
    ("value", "changes", "exact", "text"),
    [
        (1.2345e7, {"printed": "1.16e7"}, False, "1.23e7"),
        (1.1649e7, {"printed": "1.16e7"}, True, "1.16e7"),
        (1.1601e7, {"printed": "1.16e7"}, False, "1.1601e7"),  # not equal, so it must not look so
        (0.05, {"printed": "0.5"}, False, "0.05"),
        (41.2e6, {"printed": "45.0", "scale": 1e6}, False, "41.2"),
        (-23.4, {"printed": "-6.14e1"}, False, "-2.34e1"),
        (0.547, {"printed": "40", "scale": 0.01}, False, "55"),
        (1056, {"printed": "912"}, False, "1056"),
    ],
)
def test_as_printed(value, changes, exact, text):
    assert as_printed(value, claim(**changes), exact) == text


# Claims that do not hold together


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("id: S1.P_0\n", "id: S1.states\n", "id = 'S1.states': stands there twice"),
        ("class: half_bridge", "class: halfbridge", "class = 'halfbridge': must be one of printed"),
        ("kind: rounded", "kind: round", "kind = 'round'"),
        ("arithmetic: true", "arithmetics: true", "arithmetics"),
    ],
)
def test_bad_claims_are_named(paper, old, new, words):
    edit(paper / "claims.yaml", old, new)
    with pytest.raises(PaperError, match=re.escape(words)):
        read_claims(paper)


def test_published_tables_have_no_cell_that_no_rule_reads():
    inputs = {2: 4}
    for table, number in CELLS.items():
        assert len(read_table(table)) == number + inputs.get(table, 0)
