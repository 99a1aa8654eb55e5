"""Claims, tolerance classes, errata, facts and assumptions of the papers hold together."""

from fnmatch import fnmatchcase

import pytest
import yaml
from checkout import ROOT

from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2007.paper import PAPER_2007
from paper_verdict.claims import read_claims
from paper_verdict.errata import read_errata
from paper_verdict.facts import Assumption, choices

CLAIMS, ASSUMPTIONS = read_claims(PAPER_FOLDER), Assumption.read_all(PAPER_FOLDER / "assumptions.yaml")
SUSPECTED = {"columns_of_table_8", "row_of_M10", "early_temperatures"}  # proofs that need results


@pytest.mark.parametrize("paper", [PAPER_2006, PAPER_2007], ids=["2006", "2007"])
def test_whatever_a_claim_names_is_there_and_whatever_is_there_is_named(paper):
    claims, errata = read_claims(paper.folder), read_errata(paper.folder, paper.proofs)
    for claim in claims.items.values():
        assert claim.statement or claim.row, claim.id
        assert {claim.erratum, claim.see} - {None} <= set(errata), claim.id
        assert claim.evidence["path"].startswith("results/") or (ROOT / claim.evidence["path"]).is_file()
    assert {claim.compute for claim in claims.items.values()} == set(paper.computations)
    assert {erratum.proof for erratum in errata.values()} == set(paper.proofs) - SUSPECTED
    assert {name for erratum in errata.values() for name in erratum.values} <= set(claims.items)
    assert all(erratum.passes and erratum.evidence for erratum in errata.values())
    assert {claim.fact for claim in claims.items.values()} == set(claims.facts)  # none without an item
    for name, fact in claims.facts.items():
        choices(fact.chosen, Assumption.read_all(paper.folder / "assumptions.yaml"))
        assert (fact.basis == "fitted") == bool(fact.chosen), name
        for pattern in fact.items:
            assert any(fnmatchcase(key, pattern) for key in claims.items), pattern


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
