"""A third paper: five claims in a folder of their own, judged without a change to the package."""

import pytest

from paper_verdict import Finding, MissingEvidence, Paper, page, verdict

FILES = {
    "published/table1.csv": """\
row,column,printed,note,unit
water,density,998,,kg m-3
water,boils,101,,degC
""",
    "claims.yaml": """
classes:
  printed: {limit: 0.0, measure: absolute}
  about: {limit: 0.1, measure: relative}
  statement: {limit: 0.0, measure: truth}
tables:
  - table: 1
    id: T1.{row}.{column}
    class: printed
    compute: property_of
    with: {name: "{column}"}
    evidence: {path: toy, select: "{column}"}
    errata: {T1.water.boils: boils}
claims:
  - &claim
    id: S1.sinks
    where: Section 1
    statement: ice sinks
    printed: "true"
    class: statement
    compute: ice_sinks
    evidence: {path: toy, select: density}
  - <<: *claim
    id: S1.near
    statement: density is about 1050
    printed: "1050"
    class: about
    compute: property_of
    with: {name: density}
  - {<<: *claim, id: S1.salt, statement: salt changes it, compute: salt}
""",
    "facts.yaml": """
water: {says: water is dense and boils, basis: prediction, items: [T1.*, S1.near, S1.salt]}
ice: {says: ice sinks, basis: arithmetic, items: [S1.*]}
""",
    "errata.yaml": """
boils:
  {kind: misprint, where: p. 1, printed: "101", meant: "100", proof: boils, values: {T1.water.boils: "100"}}
""",
    "assumptions.yaml": """
pressure: {open: pressure, value: 101325, unit: Pa, basis: usual, alternatives: {}}
""",
    "paper.yaml": """
{title: Water, authors: A. Toy, journal: J. Toys 1 (2030), doi: 10.0/0, how: Looked up.}
""",
}


@pytest.fixture
def toy(tmp_path) -> Paper:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")

    def salt(_) -> Finding:
        raise MissingEvidence("nobody tasted it")

    computations = {
        "property_of": lambda water, name: Finding(water[name]),
        "ice_sinks": lambda water: Finding(holds=water["ice"] > water["density"], shown="917 kg/m^3"),
        "salt": salt,
    }
    return Paper(
        tmp_path,
        computations,
        {"boils": lambda: (True, "100 °C at 101325 Pa")},
        lambda results, folder: {"water": {"density": 998.2, "boils": 100.0, "ice": 917.0}},
    )


def test_a_toy_paper_is_judged_and_has_its_page(toy):
    judged = verdict(toy)
    assert {item["id"]: item["status"] for item in judged["items"]} == {
        "T1.water.density": "agrees",
        "T1.water.boils": "misprint",
        "S1.sinks": "differs, unexplained",  # no proof: who knows whose mistake it is
        "S1.near": "agrees",
        "S1.salt": "not judged",
    }
    rows = {fact["name"]: (fact["status"], fact["agree"], fact["judged"]) for fact in judged["facts"]}
    assert rows == {"water": ("misprint", 2, 3), "ice": ("differs, unexplained", 0, 1)}
    text = page(judged)
    assert "A. Toy" in text and 'id="S1.salt"' in text and "nobody tasted it" in text and "1 not run" in text


def test_a_claim_whose_run_failed_is_not_judged(toy):
    failed = toy._replace(
        computations=toy.computations | {"property_of": lambda water, name: Finding(float("nan"))}
    )
    status = {item["id"]: item["status"] for item in verdict(failed)["items"]}
    assert status["S1.near"] == status["T1.water.density"] == "not judged"


def test_a_suspected_misprint_is_shown_beside_its_items_and_changes_nothing(toy):
    def salty(_):
        raise MissingEvidence("nobody tasted it")

    suspected = "{kind: suspected, where: p. 2, printed: '998', meant: less, items: [T1.water.d], proof: %s}"
    errata = toy.folder / "errata.yaml"
    errata.write_text(f"{FILES['errata.yaml']}cold: {suspected % 'cold'}\nsalty: {suspected % 'salty'}\n")
    proofs = {"cold": lambda water: (water["density"] < 998, "998.2 in fact"), "salty": salty}
    judged = verdict(toy._replace(proofs=toy.proofs | proofs))
    assert [item["errata"] for item in judged["items"]] == [["cold", "salty"], ["boils"], [], [], []]
    outcomes = [(erratum["id"], erratum["passes"]) for erratum in judged["errata"]]
    assert outcomes == [("boils", True), ("cold", False), ("salty", None)]
    assert judged["items"][0]["status"] == "agrees"
    text = page(judged)
    assert "998.2 in fact" in text and 'href="#erratum-salty"' in text


def test_an_erratum_whose_proof_fails_or_that_means_another_number_explains_nothing(toy):
    def status(**changes):
        judged = verdict(toy._replace(**changes))
        return next(item["status"] for item in judged["items"] if item["id"] == "T1.water.boils")

    assert status() == "misprint"
    assert status(proofs={"boils": lambda: (False, "it does boil at 101")}) == "differs, unexplained"
    errata = toy.folder / "errata.yaml"
    errata.write_text(errata.read_text(encoding="utf-8").replace('boils: "100"', 'boils: "102"'))
    assert status() == "differs, unexplained"
