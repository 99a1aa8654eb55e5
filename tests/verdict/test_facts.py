"""Facts: their items, the choices made in view of them, and the status that follows from the items."""

import pytest

from paper.verdict.errata import Erratum
from paper.verdict.facts import Assumption, Fact, choices, fact_of, headline, headline_text, judged_facts
from paper.verdict.published import PaperError

MASS = {"open": "mass", "value": [1, 2], "basis": "a table", "alternatives": {}}
ASSUMPTIONS = {"mass": Assumption(**MASS), "rule": Assumption(**MASS | {"value": "a rule"})}


def fact(basis: str = "prediction", **keys) -> Fact:
    return Fact(says="it is so", items=["a.*"], basis=basis, **keys)


def item(status: str, seeds: float | None = None, relative: float | None = None, name: str = "a") -> dict:
    numbers = {"seeds": seeds, "relative": relative}
    return {"id": f"{name}.x", "fact": name, "status": status, "reason": "so"} | numbers


def erratum(**keys) -> Erratum:
    return Erratum(**{"id": "", "kind": "", "where": "", "printed": "", "meant": "", "proof": ""} | keys)


ERRATA = {
    "row": erratum(passes=True, evidence="proof"),
    "odd": erratum(passes=True, evidence="argument", items=["a"]),
    "wrong": erratum(passes=False, evidence="no proof"),
}


def one(of: Fact, *items: dict, chi_square: float | None = None) -> dict:
    return judged_facts({"a": of}, items, ASSUMPTIONS, ERRATA, lambda names: chi_square)[0]


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
        (fact(erratum="wrong"), [item("missed")], None, "differs, unexplained"),
        (fact(erratum="odd"), [item("missed")], None, "differs, explained"),  # only suspected
        (fact(why="a leak"), [item("missed")], None, "differs, explained"),
    ],
)
def test_status(of, items, chi_square, status):
    assert one(of, *items, chi_square=chi_square)["status"] == status


def test_a_chi_square_of_some_of_the_items_is_none_of_the_fact():
    assert one(fact(), item("exact"), item("not judged"), chi_square=1.0)["chi_square"] is None


def test_choices_are_shared_by_numbers_of_items_and_counted_once():
    facts = {
        "a": fact("fitted", chosen=["mass", "rule"]),
        "b": fact("fitted", chosen=["mass"]),
        "c": fact(),
    }
    items = [item("exact", name="a")] + [item("exact", None, 0.01, "b")] * 3 + [item("missed", 5.0, 0.1, "c")]
    rows = judged_facts(facts, items, ASSUMPTIONS, {}, lambda names: None)
    assert [row["name"] for row in rows] == ["c", "b", "a"]  # worst first
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
