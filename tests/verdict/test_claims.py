"""Claims, tolerance classes, errata, assumptions and recorded statuses hold together."""

import re
import shutil
from pathlib import Path

import pytest
import yaml
from checkout import ROOT, edit

from paper.study.paper_2006.computations import COMPUTATIONS
from paper.study.paper_2006.erratum_proofs import PROOFS
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.verdict import PaperError
from pneumo.verdict.assumptions import read_assumptions
from pneumo.verdict.claims import read_claims
from pneumo.verdict.errata import read_errata
from pneumo.verdict.facts import FACT_STATUSES
from pneumo.verdict.judging import recorded_facts

CLAIMS, ASSUMPTIONS = read_claims(PAPER_FOLDER), read_assumptions(PAPER_FOLDER)
ERRATA = read_errata(PAPER_FOLDER, PROOFS)
CELLS = {
    1: 40,
    2: 4,
    4: 8,
    5: 64,
    6: 16,
    7: 30,
    8: 96,
    9: 90,
}  # items by table


def test_every_cell_of_tables_and_figures_is_an_item():
    tables = [claim.table for claim in CLAIMS.items.values()]
    assert {table: tables.count(table) for table in CELLS} == CELLS
    figures = [name.split(".")[0] for name, claim in CLAIMS.items.items() if claim.row and not claim.table]
    assert {figure: figures.count(figure) for figure in figures} == {"F7": 80, "F9": 18, "F11": 81}
    assert tables.count(None) >= 80 + 179


NARROWED = ("mse", "sigma", "fraction", "mu", "best_n", "statement", "decade")  # by seed deviations


def test_tolerances_are_narrowed_by_seeds_and_every_status_is_recorded():
    assert CLAIMS.classes["settling"].floor == 0.001
    seeds = {name: tolerance.seeds for name, tolerance in CLAIMS.classes.items() if tolerance.seeds}
    assert seeds == dict.fromkeys(NARROWED, 0.25) and CLAIMS.classes["mu"].signed
    recorded = recorded_facts(PAPER_FOLDER)
    assert set(recorded) == set(CLAIMS.facts)
    assert set(recorded.values()) <= set(FACT_STATUSES)


def test_whatever_a_claim_names_is_there_and_whatever_is_there_is_named():
    for claim in CLAIMS.items.values():
        assert claim.compute in COMPUTATIONS, claim.id
        assert claim.statement or claim.table, claim.id
        assert claim.evidence.path.startswith(("results/", "pneumo/", "paper/")), claim.id
        assert {claim.erratum, claim.see} - {None} <= set(ERRATA), claim.id
        if claim.assumption:
            name, alternative = claim.assumption.split(".")
            assert alternative in ASSUMPTIONS[name].alternatives, claim.id
        if not claim.evidence.path.startswith("results/"):
            assert (ROOT / claim.evidence.path).is_file(), claim.id
    assert {claim.compute for claim in CLAIMS.items.values()} == set(COMPUTATIONS)
    assert [erratum.proof for erratum in ERRATA.values()] == list(PROOFS)
    assert {name for erratum in ERRATA.values() for name in erratum.values} <= set(CLAIMS.items)


@pytest.mark.parametrize("name", ERRATA)
def test_proof_of_erratum_passes_with_evidence(name):
    assert ERRATA[name].passes, ERRATA[name].evidence
    assert ERRATA[name].evidence


def test_sigma_of_mean_errors_is_printed_and_that_of_points_their_readings():
    claims = CLAIMS.items
    assert (claims["T7.M1.mu"].sigma, claims["T9.adiabatic.M1.mse"].sigma) == (19_900.0, None)
    for name in ("T9.adiabatic.M1", "T9.typical.M5"):
        assert claims[f"{name}.mu"].sigma == claims[f"{name}.sigma"].value
    claims = CLAIMS.items
    read_off = {name: claim for name, claim in claims.items() if name.startswith(("F7.", "F9.", "F11."))}
    assert {claim.tolerance for claim in read_off.values()} == {"read_off", "best_n"}
    assert not any("average" in name for name in read_off)
    assert (claims["F9.M1.p10"].sigma, claims["F9.M1.p10"].half_unit) == (0.016, 0.032)
    assert claims["F7.P_A.1.value"].sigma == 800 and claims["F7.x.1.time"].sigma == 0.005
    assert claims["F11.typical.M7.best_n"].half_unit == 0.005  # print, not a reading


def test_what_was_chosen_in_view_of_a_number_is_not_counted_as_its_prediction():
    of_figures = {name for name in CLAIMS.items if name.startswith(("F7.", "F9.", "F11."))}
    fitted = {name for name in of_figures if CLAIMS.items[name].basis == "fitted"}
    percentiles = {name for name in of_figures if name.endswith((".p10", ".p90"))}
    times = {f"F7.{row}.{i}.time" for row in ("P_A", "P_B", "T_A", "T_B") for i in range(1, 9)}
    assert fitted == percentiles | times  # decision 62; their release
    assert {claim.basis for claim in CLAIMS.items.values() if claim.table in (5, 6, 7, 8, 9)} == {"fitted"}
    for claim in CLAIMS.items.values():
        if claim.models and not claim.row and claim.basis != "set-up":  # Tables 7 to 9 in words
            assert (claim.basis == "fitted") == (claim.id not in ("S4.no_single_best", "S4.M7_n")), claim.id


def test_assumptions_are_those_of_the_configuration():
    config = yaml.safe_load((ROOT / "config/paper.yaml").read_text(encoding="utf-8"))

    def at(key: str):
        node = config
        for part in key.split("."):
            node = node[part]
        return node

    for name, entry in ASSUMPTIONS.items():
        assert bool(entry.config) != bool(entry.code), name
        module = ROOT / f"{entry.code.replace('.', '/')}.py"
        assert not entry.code or module.is_file() or (ROOT / entry.code).is_file(), name
        values = entry.value if isinstance(entry.value, list) else [entry.value] * len(entry.config)
        assert not entry.config or [at(key) for key in entry.config] == values, name
        for alternative in entry.alternatives.values():
            for key, value in alternative.items() if isinstance(alternative, dict) else ():
                assert at(key) != value, (name, key)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("id: S1.P_0\n", "id: S1.states\n", "id = 'S1.states': is repeated"),
        ("class: half_bridge", "class: halfbridge", "class = 'halfbridge': must be one of printed"),
        ("kind: rounded", "kind: round", "kind = 'round'"),
    ],
)
def test_bad_claims_are_named(tmp_path, old, new, words):
    paper = Path(shutil.copytree(PAPER_FOLDER, tmp_path / "paper"))
    edit(paper / "claims.yaml", old, new)
    with pytest.raises(PaperError, match=re.escape(words)):
        read_claims(paper)
