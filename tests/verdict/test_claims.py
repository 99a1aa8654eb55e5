"""Claims, tolerance classes, errata, assumptions and recorded statuses hold together."""

import re
import shutil
from pathlib import Path

import pytest
import yaml

from pneumo.papers.paper_2006.computations import COMPUTATIONS
from pneumo.papers.paper_2006.erratum_proofs import PROOFS
from pneumo.verdict import PAPER_FOLDER, PaperError
from pneumo.verdict.assumptions import read_assumptions
from pneumo.verdict.claims import read_claims
from pneumo.verdict.errata import read_errata
from pneumo.verdict.judging import STATUSES, read_statuses
from pneumo.verdict.published import read_table

ROOT = Path(__file__).parents[2]
CLAIMS, ERRATA, ASSUMPTIONS = read_claims(), read_errata(PAPER_FOLDER, PROOFS), read_assumptions()
CELLS = {1: 40, 2: 4, 4: 8, 5: 64, 6: 16, 7: 30, 8: 96, 9: 90}  # table -> items
INPUTS = {2: 4}  # table -> cells that are no items


def test_every_cell_of_the_tables_is_an_item_or_an_input():
    tables = [claim.table for claim in CLAIMS.items.values()]
    assert {table: tables.count(table) for table in CELLS} == CELLS
    assert tables.count(None) >= 80
    for table, number in CELLS.items():
        assert len(read_table(table)) == number + INPUTS.get(table, 0)


def classes_of_the_decision() -> dict[str, tuple[float, str]]:
    """Class -> (limit, measure) from the table of decision 10."""
    text = (ROOT / "paper/decisions/0010-tolerance-classes.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([\d.e-]+)( %)?(.*?) \|", text, re.MULTILINE)
    words = {"": "absolute", " absolute": "absolute", " of the row's printed sigma": "sigma"}
    words |= {" of the swing": "swing", " of log10": "log10", " or 1 ms": "relative"}
    classes = {}
    for name, number, percent, after in rows:
        measure = "relative" if percent and not after else words[after]
        classes[name] = (float(number) / (100 if percent else 1), "truth" if name == "statement" else measure)
    return classes


def test_classes_are_those_of_the_decision():
    found = {name: (tolerance.limit, tolerance.measure) for name, tolerance in CLAIMS.classes.items()}
    assert found == classes_of_the_decision()
    assert CLAIMS.classes["settling"].floor == 0.001


def test_whatever_a_claim_names_is_there():
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


def test_every_computation_proof_and_corrected_number_is_used():
    assert {claim.compute for claim in CLAIMS.items.values()} == set(COMPUTATIONS)
    assert [erratum.proof for erratum in ERRATA.values()] == list(PROOFS)
    assert {name for erratum in ERRATA.values() for name in erratum.values} <= set(CLAIMS.items)


@pytest.mark.parametrize("name", ERRATA)
def test_proof_of_erratum_passes_with_evidence(name):
    assert ERRATA[name].passes, ERRATA[name].evidence
    assert ERRATA[name].evidence


def test_mean_errors_are_judged_by_the_deviation_printed_beside_them():
    claims = CLAIMS.items
    assert (claims["T7.M1.mu"].sigma, claims["T9.adiabatic.M1.mse"].sigma) == (19_900.0, None)
    for name in ("T9.adiabatic.M1", "T9.typical.M5"):
        assert claims[f"{name}.mu"].sigma == claims[f"{name}.sigma"].value


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


def test_statuses_are_recorded_for_every_item():
    recorded = read_statuses()
    assert list(recorded) == list(CLAIMS.items)
    assert set(recorded.values()) <= set(STATUSES)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("id: S1.P_0\n", "id: S1.states\n", "id = 'S1.states': stands there twice"),
        ("class: half_bridge", "class: halfbridge", "class = 'halfbridge': must be one of printed"),
        ("kind: rounded", "kind: round", "kind = 'round'"),
        ("arithmetic: true", "arithmetics: true", "arithmetics"),
    ],
)
def test_bad_claims_are_named(tmp_path, old, new, words):
    paper = Path(shutil.copytree(PAPER_FOLDER, tmp_path / "paper"))
    text = (paper / "claims.yaml").read_text(encoding="utf-8")
    assert old in text
    (paper / "claims.yaml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(PaperError, match=re.escape(words)):
        read_claims(paper)
