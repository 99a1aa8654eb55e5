"""What a paper claims, from ``claims.yaml``: one `Claim` per printed number or statement.

The cells of the tables come from the transcriptions, through one rule per table; the text's claims are
written out. Reading them needs no result.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import Field

from pneumo.verdict import PAPER_FOLDER, PaperError
from pneumo.verdict.entries import Entry, read_entries
from pneumo.verdict.published import STATISTICS, half_unit, read_table

UNITS_IN_TEXT = {"Pa2": "Pa²", "m2": "m²", "m3": "m³", "W m-2 K-1": "W/(m² K)", "1": ""}  # from UDUNITS

# Keys of a table's rule that depend on the cell; all others are passed to its claims, names in braces filled.
BY_CELL = ("table", "columns", "class", "used_in_identification", "errata", "assumptions")

OF_CELL = ("row", "column", "level", "printed", "unit", "scale")


class ToleranceClass(Entry):
    """A tolerance class, as decided in ``paper/decisions/0010-tolerance-classes.md``."""

    limit: float  # largest deviation at which an item is still close
    # Unit of the limit: the number's own, the printed number, the row's sigma, the swing of the run, truth
    # (statements) or decades.
    measure: Literal["absolute", "relative", "sigma", "swing", "truth", "log10"]
    floor: float = 0.0  # smallest limit, in the number's unit


class Evidence(Entry):
    """File in which an item can be seen, and where in it."""

    path: str
    select: str


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
    kind: Literal["exact", "rounded", "ratio", "ranking", "qualitative"]
    tolerance: str = Field(alias="class")  # name of the tolerance class
    compute: str  # name of the computation
    arguments: Mapping[str, Any] = Field({}, alias="with")
    evidence: Evidence
    models: bool = False  # about models: judged with exact transport and on the paper's own tables too
    headline: bool = False  # stands in short lists
    arithmetic: bool = False  # needs only the paper's own numbers and formulas
    used_in_identification: bool = False  # constants that the paper leaves open were found from it
    erratum: str | None = None  # may explain a difference
    assumption: str | None = None  # an alternative that may explain a difference
    see: str | None = None  # erratum worth reading beside it
    sigma: float | None = None  # scale of class `mu`, Pa
    unreadable: str = ""  # why the print cannot be read
    table: int | None = None  # cell of the paper's tables that it is, if it is one
    row: str = ""
    column: str = ""
    level: str = ""

    @property
    def value(self) -> float:
        """The printed number in `unit`; for percentages a fraction."""
        return float(self.printed) * self.scale

    @property
    def half_unit(self) -> float:
        """Half a unit in the last printed digit."""
        return half_unit(self.printed, self.digits) * self.scale


class Claims(NamedTuple):
    """All claims by id, and the tolerance classes by name."""

    classes: dict[str, ToleranceClass]
    items: dict[str, Claim]


def read_claims(folder: Path = PAPER_FOLDER) -> Claims:
    """Read ``claims.yaml`` of a folder and, through its rules, the published tables.

    A wrong entry, an id that stands twice, or an undefined tolerance class raises `PaperError`.
    """
    file, content = folder / "claims.yaml", read_entries(folder, "claims.yaml")
    classes = {name: ToleranceClass.read(file, name, entry) for name, entry in content["classes"].items()}
    cells = [cell for rule in content["tables"] for cell in _cells_of_table(rule, folder)]
    items: dict[str, Claim] = {}
    for entry in cells + content["claims"]:
        claim = Claim.read(file, entry["id"], entry)
        if claim.id in items:
            raise PaperError(f"{file}: id = {claim.id!r}: stands there twice")
        if claim.tolerance not in classes:
            allowed = ", ".join(classes)
            raise PaperError(f"{file}: {claim.id}: class = {claim.tolerance!r}: must be one of {allowed}")
        items[claim.id] = claim
    return Claims(classes, items)


def _cells_of_table(rule: Mapping[str, Any], folder: Path) -> Iterator[dict[str, Any]]:
    """Entries of one table's cells."""
    cells = read_table(rule["table"], folder)
    sigmas = {(cell["row"], cell.get("level")): cell for cell in cells if cell["column"] == "sigma"}
    used = rule.get("used_in_identification", {})
    passed_on = {"where": "{row}, {column}"} | {key: rule[key] for key in rule if key not in BY_CELL}
    for cell in cells:
        row, column, note = cell["row"], cell["column"], cell["note"]
        if column not in rule.get("columns", [column]):
            continue
        entry = _filled(passed_on, cell | {"variable": STATISTICS.get(column, ("",))[0]})
        entry |= {key: cell[key] for key in OF_CELL if key in cell}
        entry |= {"table": rule["table"], "where": f"Table {rule['table']}, {entry['where']}"}
        entry["class"] = rule["class"] if isinstance(rule["class"], str) else rule["class"][column]
        if entry["class"] == "mu":
            sigma = sigmas[row, cell.get("level")]
            entry["sigma"] = float(sigma["printed"]) * float(sigma.get("scale", 1))
        if note.startswith("unreadable"):
            entry["unreadable"] = note.removeprefix("unreadable: ")
        entry["used_in_identification"] = column in used.get("columns", []) and row in used.get("rows", [row])
        entry["erratum"] = rule.get("errata", {}).get(entry["id"])
        entry["assumption"] = rule.get("assumptions", {}).get(entry["id"])
        yield entry


def _filled(value: Any, names: Mapping[str, str]) -> Any:
    """Fill in the names in braces of all texts in a value."""
    if isinstance(value, dict):
        return {key: _filled(inner, names) for key, inner in value.items()}
    return value.format(**names) if isinstance(value, str) else value
