"""Facts: their items, the choices made in view of them, and the statuses of both."""

from pathlib import Path

import pytest

from paper_verdict.errata import Erratum
from paper_verdict.errors import PaperError
from paper_verdict.facts import Assumption, Fact, choices, fact_of, headline, headline_text, judged_facts

MASS = {"open": "mass", "value": [1, 2], "basis": "a table", "alternatives": {}}
ASSUMPTIONS = {"mass": Assumption(**MASS), "rule": Assumption(**MASS | {"value": "a rule"})}
GOOD = {"status": "agrees", "agreement": "exact"}
OFF = {"status": "differs, unexplained", "agreement": None}
PROVED = {"status": "misprint", "agreement": None}
NOT_RUN = {"status": "not judged", "agreement": None}
SCATTER = "agrees within the seeds' scatter"


def fact(basis: str = "prediction", **keys) -> Fact:
    return Fact(says="it is so", items=["a.*"], basis=basis, **keys)


def item(kind: dict, seeds: float | None = None, relative: float | None = None, name: str = "a") -> dict:
    numbers = {"seeds": seeds, "relative": relative}
    return {"id": f"{name}.x", "fact": name, "reason": "so"} | kind | numbers


def erratum(**keys) -> Erratum:
    return Erratum(**{"id": "", "kind": "", "where": "", "printed": "", "meant": "", "proof": ""} | keys)


ERRATA = {
    "row": erratum(passes=True, evidence="proof"),
    "odd": erratum(passes=True, evidence="argument", items=["a"]),
    "number": erratum(passes=True, evidence="of another item", values={"a.y": "1"}),
    "wrong": erratum(passes=False, evidence="no proof"),
}


def one(of: Fact, *items: dict, chi_square: float | None = None) -> dict:
    return judged_facts({"a": of}, items, ASSUMPTIONS, ERRATA, lambda names: chi_square)[0]


@pytest.mark.parametrize(
    ("of", "items", "chi_square", "status", "of_items"),
    [
        (fact(), [item(GOOD), item(GOOD)], None, "agrees", ["agrees", "agrees"]),
        (fact("set-up"), [item(GOOD)], None, "not judged", ["not judged"]),
        (fact("set-up"), [item(OFF)], None, "differs, unexplained", ["differs, unexplained"]),
        (fact(), [item(NOT_RUN)], None, "not judged", ["not judged"]),
        (fact(), [item(OFF, 1.9), item(GOOD)], None, SCATTER, [SCATTER, "agrees"]),
        (
            fact(),
            [item(OFF, -2.1), item(OFF, 1.0)],
            None,
            "differs, unexplained",
            ["differs, unexplained", SCATTER],
        ),
        (fact(), [item(OFF)], None, "differs, unexplained", ["differs, unexplained"]),
        # One chi-square decides in place of single deviations: 5 % exceed 3.84 for one degree of freedom.
        (fact(), [item(OFF, 9.0)], 3.8, SCATTER, [SCATTER]),
        (fact(), [item(OFF, 1.0)], 3.9, "differs, unexplained", [SCATTER]),
        (fact(), [item(PROVED), item(GOOD)], None, "misprint", ["misprint", "agrees"]),
        (
            fact(),
            [item(PROVED), item(OFF)],
            None,
            "differs, unexplained",
            ["misprint", "differs, unexplained"],
        ),
        (fact(erratum="row"), [item(OFF)], None, "misprint", ["misprint"]),
        (fact(erratum="wrong"), [item(OFF)], None, "differs, unexplained", ["differs, unexplained"]),
        (fact(erratum="number"), [item(OFF)], None, "differs, unexplained", ["differs, unexplained"]),
        (
            fact(erratum="odd"),
            [item(OFF)],
            None,
            "differs, explained",
            ["differs, explained"],
        ),  # only suspected
        (fact(why="a leak"), [item(OFF)], None, "differs, explained", ["differs, explained"]),
        # Nothing but a proof makes a misprint, whatever the kind of evidence.
        (fact("arithmetic"), [item(OFF)], None, "differs, unexplained", ["differs, unexplained"]),
    ],
)
def test_status_of_a_fact_and_of_its_items(of, items, chi_square, status, of_items):
    items = [dict(each) for each in items]
    assert one(of, *items, chi_square=chi_square)["status"] == status
    assert [each["status"] for each in items] == of_items


def test_a_chi_square_of_some_of_the_items_is_none_of_the_fact():
    assert one(fact(), item(GOOD), item(NOT_RUN), chi_square=1.0)["chi_square"] is None


def test_choices_are_shared_by_numbers_of_items_and_counted_once():
    facts = {
        "a": fact("fitted", chosen=["mass", "rule"]),
        "b": fact("fitted", chosen=["mass"]),
        "c": fact(),
    }
    items = [item(GOOD, name="a")] + [item(GOOD, None, 0.01, "b") for _ in range(3)]
    rows = judged_facts(facts, [*items, item(OFF, 5.0, 0.1, "c")], ASSUMPTIONS, {}, lambda names: None)
    assert [row["name"] for row in rows] == ["c", "b", "a"]  # worst first
    spent = {row["name"]: (row["spent"], row["left"]) for row in rows}
    assert spent == {"a": (1.5, -0.5), "b": (1.5, 1.5), "c": (0, 1)}  # two values over four items, and a rule
    counts = headline(rows, ASSUMPTIONS)
    assert (counts["facts"], counts["choices"], counts["predictions"], counts["came_out"]) == (3, 3, 1, 0)
    text = "3 independent facts: 2 agree; 1 differs, unexplained. 3 free choices were made"
    assert headline_text(counts) == f"{text}; 0 of 1 predictions came out."


def test_unknown_names_are_refused():
    with pytest.raises(PaperError, match=r"'b\.y'"):
        fact_of("b.y", {"a": fact()}, Path("facts.yaml"))
    with pytest.raises(PaperError, match=r"chosen = 'mas': not in assumptions.yaml; did you mean 'mass'"):
        choices(["mas"], ASSUMPTIONS)
