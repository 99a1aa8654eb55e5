"""Facts: their items, the choices made in view of them, and the status that follows from the items."""

from fnmatch import fnmatchcase

import pytest

from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2007.paper import PAPER_2007
from pneumo.verdict import PaperError
from pneumo.verdict.assumptions import Assumption, read_assumptions
from pneumo.verdict.claims import read_claims
from pneumo.verdict.facts import Fact, choices, fact_of, headline, headline_text, judged_facts

MASS = {"open": "mass", "value": [1, 2], "basis": "a table", "alternatives": {}}
ASSUMPTIONS = {"mass": Assumption(**MASS), "rule": Assumption(**MASS | {"value": "a rule"})}


def fact(basis: str = "prediction", **keys) -> Fact:
    return Fact(says="it is so", items=["a.*"], basis=basis, **keys)


def item(status: str, seeds: float | None = None, relative: float | None = None, name: str = "a") -> dict:
    return {
        "id": f"{name}.x",
        "fact": name,
        "status": status,
        "seeds": seeds,
        "relative": relative,
        "reason": "so",
    }


def one(of: Fact, *items: dict, chi_square: float | None = None, holds: tuple[str, ...] = ()) -> dict:
    texts = dict.fromkeys(holds, "proof")
    return judged_facts({"a": of}, items, ASSUMPTIONS, texts, texts, lambda names: chi_square)[0]


@pytest.mark.parametrize(
    ("of", "items", "chi_square", "status"),
    [
        (fact(), [item("exact"), item("close")], None, "agrees"),
        (fact("set-up"), [item("exact")], None, "not judged"),
        (fact(), [item("not judged")], None, "not judged"),
        (fact(), [item("missed", 1.9), item("exact")], None, "agrees within the seeds' scatter"),
        (fact(), [item("missed", -2.1), item("exact")], None, "differs, unexplained"),
        (fact(), [item("missed")], None, "differs, unexplained"),
        # One chi-square decides in place of single deviations: 5 % exceed 3.84 for one degree of freedom.
        (fact(), [item("missed", 9.0)], 3.8, "agrees within the seeds' scatter"),
        (fact(), [item("missed", 1.0)], 3.9, "differs, unexplained"),
        (fact(), [item("explained"), item("exact")], None, "misprint"),
        (fact(), [item("contradicted"), item("explained")], None, "differs, explained"),
        (fact(erratum="row"), [item("contradicted")], None, "misprint"),
        (fact(erratum="other"), [item("missed")], None, "differs, unexplained"),
        (fact(doubt="row"), [item("missed")], None, "differs, explained"),
        (fact(doubt="other"), [item("missed")], None, "differs, unexplained"),
        (fact(why="a leak"), [item("missed")], None, "differs, explained"),
    ],
)
def test_status(of, items, chi_square, status):
    assert one(of, *items, chi_square=chi_square, holds=("row",))["status"] == status


def test_a_chi_square_of_some_of_the_items_is_none_of_the_fact():
    assert one(fact(), item("exact"), item("not judged"), chi_square=1.0)["chi_square"] is None


def test_choices_are_shared_by_numbers_of_items_and_counted_once():
    facts = {
        "a": fact("fitted", chosen=["mass", "rule"]),
        "b": fact("fitted", chosen=["mass"]),
        "c": fact(),
    }
    items = [item("exact", name="a")] + [item("exact", name="b")] * 3 + [item("missed", 5.0, 0.1, "c")]
    rows = judged_facts(facts, items, ASSUMPTIONS, {}, {}, lambda names: None)
    assert [row["name"] for row in rows] == ["c", "a", "b"]  # worst first
    spent = {row["name"]: (row["spent"], row["left"]) for row in rows}
    assert spent == {"a": (1.5, -0.5), "b": (1.5, 1.5), "c": (0, 1)}  # two values over four items, and a rule
    counts = headline(rows, ASSUMPTIONS)
    assert (counts["facts"], counts["choices"], counts["predictions"], counts["came_out"]) == (3, 3, 1, 0)
    text = "3 independent facts: 2 agree; 1 differs, unexplained. 3 free choices were made"
    assert headline_text(counts) == f"{text}; 0 of 1 predictions came out."


def test_unknown_names_are_refused():
    with pytest.raises(PaperError, match=r"'b\.y'"):
        fact_of("b.y", {"a": fact()})
    with pytest.raises(PaperError, match="chosen = 'lag'"):
        choices(["lag"], ASSUMPTIONS)


@pytest.mark.parametrize("paper", [PAPER_2006, PAPER_2007], ids=["2006", "2007"])
def test_facts_of_a_paper(paper):
    claims, assumptions = read_claims(paper.folder), read_assumptions(paper.folder)
    assert {claim.fact for claim in claims.items.values()} == set(claims.facts)  # none without an item
    for name, of in claims.facts.items():
        choices(of.chosen, assumptions)
        assert (of.basis == "fitted") == bool(of.chosen), name
        for pattern in of.items:
            assert any(fnmatchcase(key, pattern) for key in claims.items), pattern
