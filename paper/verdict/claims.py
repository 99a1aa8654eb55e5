"""Claims of a paper from ``claims.yaml``: one `Claim` per printed number or statement.

The cells of the tables come from the transcriptions, through one rule per table; claims of the text are
written out.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import Field

from paper.verdict.facts import Fact, fact_of
from paper.verdict.published import Entry, PaperError, half_unit, read_cells, read_entries, recorded

UNITS_IN_TEXT = {
    "Pa2": "Pa²",
    "log10(Pa2)": "log₁₀(Pa²)",
    "m2": "m²",
    "m3": "m³",
    "W m-2 K-1": "W/(m² K)",
    "1": "",
}  # from UDUNITS

# Keys of a rule that depend on the cell; all others are passed to its claims, names in braces filled.
BY_CELL = ("table", "figure", "columns", "class", "errata", "variables")

OF_CELL = ("row", "column", "level", "printed", "unit", "scale")

BASES = {  # kind of evidence -> what it is
    "prediction": "no constant and no rule was chosen with it in view",
    "fitted": "constants or a setup that the paper leaves open were chosen with it in view",
    "arithmetic": "follows from the paper's own numbers and formulas",
    "set-up": "an input, a count or an identity",
}
READ_OFF = "read_off"  # tolerance class of numbers read off a figure


class ToleranceClass(Entry):
    """A tolerance class, as decided in decisions 10 and 39."""

    limit: float  # largest deviation at which an item is still close
    # Fraction of the standard deviation over seeds: a number is close if it differs from the printed one by
    # at most half a unit of the last digit plus this fraction of its deviation, and by at most `limit`.
    seeds: float | None = None
    signed: bool = False  # close only with the sign of the printed number
    # Unit of the limit: the number's own, the printed number, the row's sigma, the swing of the run, truth
    # (statements), decades, or steps of n that cost little.
    measure: Literal["absolute", "relative", "sigma", "swing", "truth", "log10", "index"]
    floor: float = 0.0  # smallest limit, in the number's unit


class Claim(Entry):
    """One printed number or statement and how it is judged."""

    id: str
    where: str  # place in the paper
    statement: str = ""  # what is claimed, in other words than the paper's
    printed: str  # the number as printed; times `scale` it is the value in `unit`
    unit: str = ""
    scale: float = 1.0
    digits: int | None = None  # significant digits, where the authors filled up with zeros
    sense: Literal["equal", "at_most", "at_least"] = "equal"
    tolerance: str = Field(alias="class")  # name of the tolerance class
    compute: str  # name of the computation
    arguments: Mapping[str, Any] = Field({}, alias="with")
    evidence: Mapping[Literal["path", "select"], str]  # file that shows the item, and the place in it
    models: bool = False  # about models: judged with exact signals and on the paper's own tables too
    fact: str = ""  # in ``facts.yaml``
    basis: str = ""  # kind of evidence of that fact, see `BASES`
    erratum: str | None = None  # may explain a difference
    see: str | None = None  # erratum worth reading beside it
    sigma: float | None = None  # unit of a limit in sigma; of `read_off`, standard deviation of the reading
    # Standard deviation over seed sets of the number in `unit`, of a statement's margin, or, of a best n, of
    # the logarithm of the mean square error there; from ``seed_deviations.csv``.
    seed_deviation: float | None = None
    table: int | None = None  # number of the table, and its cell, of a table's number
    row: str = ""
    column: str = ""
    level: str = ""

    @property
    def value(self) -> float:
        """The printed number in `unit`; for percentages a fraction."""
        return float(self.printed) * self.scale

    @property
    def half_unit(self) -> float:
        """Half a unit in the last printed digit, in `unit`; for a reading off a figure, two sigma of it."""
        if self.tolerance == READ_OFF:
            return 2 * (self.sigma or 0.0)
        return half_unit(self.printed, self.digits) * self.scale


class Claims(NamedTuple):
    """All claims by id, and the tolerance classes and facts by name."""

    classes: dict[str, ToleranceClass]
    items: dict[str, Claim]
    facts: dict[str, Fact]


def read_claims(folder: Path) -> Claims:
    """Read ``claims.yaml`` of a folder and, through its rules, the published tables.

    `PaperError` if an entry is wrong, an id is repeated, or a tolerance class is undefined.
    """
    file, content = folder / "claims.yaml", read_entries(folder, "claims.yaml")
    classes = {name: ToleranceClass.read(file, name, entry) for name, entry in content["classes"].items()}
    cells = [cell for rule in content["tables"] for cell in _cells_of_table(rule, classes, folder)]
    deviations, facts = recorded(folder / "seed_deviations.csv"), Fact.read_all(folder, "facts.yaml")
    items: dict[str, Claim] = {}
    for entry in cells + content["claims"]:
        fact = fact_of(entry["id"], facts)
        more = {"seed_deviation": deviations.get(entry["id"]), "fact": fact, "basis": facts[fact].basis}
        claim = Claim.read(file, entry["id"], entry | more)
        if claim.id in items:
            raise PaperError(f"{file}: id = {claim.id!r}: is repeated")
        if claim.tolerance not in classes:
            allowed = ", ".join(classes)
            raise PaperError(f"{file}: {claim.id}: class = {claim.tolerance!r}: must be one of {allowed}")
        items[claim.id] = claim
    return Claims(classes, items, facts)


def _cells_of_table(
    rule: Mapping[str, Any], classes: Mapping[str, ToleranceClass], folder: Path
) -> Iterator[dict[str, Any]]:
    """Entry of a `Claim` for each cell of one table or figure, made by a rule of ``claims.yaml``."""
    kind, word = ("table", "Table") if "table" in rule else ("figure", "Fig.")
    cells = read_cells(f"{kind}{rule[kind]}", folder)
    sigmas = {(cell["row"], cell.get("level")): cell for cell in cells if cell["column"] == "sigma"}
    passed_on = {"where": "{row}, {column}"} | {key: rule[key] for key in rule if key not in BY_CELL}
    for cell in cells:
        row, column = cell["row"], cell["column"]
        if column not in rule.get("columns", [column]):
            continue
        entry = _filled(passed_on, cell | {"variable": rule.get("variables", {}).get(column, "")})
        entry |= {key: cell[key] for key in OF_CELL if key in cell}
        entry |= {"table": rule.get("table"), "where": f"{word} {rule[kind]}, {entry['where']}"}
        entry["class"] = rule["class"] if isinstance(rule["class"], str) else rule["class"][column]
        tolerance = classes.get(entry["class"])
        if tolerance and tolerance.measure == "sigma":  # printed beside it, or in a column of its own
            beside = cell.get("sigma")
            sigma = cell | {"printed": beside, "scale": 1} if beside else sigmas[row, cell.get("level")]
            entry["sigma"] = float(sigma["printed"]) * float(sigma.get("scale", 1))
        entry["erratum"] = rule.get("errata", {}).get(entry["id"])
        yield entry


def _filled(value: Any, names: Mapping[str, str]) -> Any:
    """Replace names in braces by their values in `names`, in all texts inside a value."""
    if isinstance(value, dict):
        return {key: _filled(inner, names) for key, inner in value.items()}
    return value.format(**names) if isinstance(value, str) else value
