"""Claims of a paper from ``claims.yaml``: one `Claim` per printed number or statement.

The cells of the tables come from the transcriptions, through one rule per table; claims of the text are
written out.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal, NamedTuple

from pydantic import Field

from paper_verdict.curves import Curves
from paper_verdict.errors import PaperError, nearest
from paper_verdict.facts import BASES, Fact, fact_of
from paper_verdict.files import (
    NOT_KEYS,
    Entries,
    Entry,
    cells_of,
    check_number,
    filled,
    half_unit,
    read_yaml,
    recorded,
)
from paper_verdict.values import Cell

__all__ = ["BASES", "Claim", "Claims", "ToleranceClass", "read_claims"]

UNITS_IN_TEXT = {
    "Pa2": "Pa²",
    "log10(Pa2)": "log₁₀(Pa²)",
    "m2": "m²",
    "m3": "m³",
    "W m-2 K-1": "W/(m² K)",
    "1": "",
}  # from UDUNITS
TEXT = "Text"
EQUATIONS = "Equations"
NUMERIC = ("relative", "sigma", "swing", "index")  # measures of numbers only
SECTIONS = ("classes", "tables", "claims", "curves", "inputs", "repeats")  # of ``claims.yaml``


class ToleranceClass(Entry):
    """A tolerance class: how far from the print a number may be."""

    limit: float = Field(ge=0)  # largest deviation at which an item still agrees
    # Fraction of the standard deviation over seeds: a number agrees if it differs from the printed one by
    # at most half a unit of the last digit plus this fraction of its deviation, and by at most `limit`.
    seeds: float | None = Field(None, gt=0)
    signed: bool = False  # agrees only with the sign of the printed number
    # Unit of the limit: the number's own, the printed number, the row's sigma, the swing of the run, truth
    # (statements), decades, or steps of a choice that cost little.
    measure: Literal["absolute", "relative", "sigma", "swing", "truth", "log10", "index"]
    floor: float = Field(0.0, ge=0)  # smallest limit, in the number's unit
    reading: bool = False  # numbers read off a figure: two sigma of the reading are its half unit


class Rule(Entry):
    """A rule for all cells of one printed table or figure; other keys are those of its claims."""

    table: int | None = None
    figure: int | None = None
    columns: Sequence[str] | None = None
    tolerance: str | Mapping[str, str] = Field(alias="class")  # one, or one for each column
    errata: Mapping[str, str] = {}  # item -> erratum
    variables: Mapping[str, str] = {}  # column -> what {variable} is in other texts

    @property
    def file(self) -> str:
        """Name of its CSV file, without suffix."""
        return f"table{self.table}" if self.table is not None else f"figure{self.figure}"

    @property
    def place(self) -> str:
        """The table or figure in words."""
        return f"Table {self.table}" if self.table is not None else f"Fig. {self.figure}"


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
    compute: str = ""  # name of the computation; without, the number is read where `values` says
    arguments: Mapping[str, Any] = Field({}, alias="with")
    values: Cell | None = None  # by default the same row and column of a file named like the table's
    evidence: Mapping[Literal["path", "select"], str] = {}  # what a computation reads, for readers
    also: Sequence[str] = ()  # further sources by which the claim is judged, for information
    fact: str = ""  # in ``facts.yaml``
    basis: str = ""  # kind of evidence of that fact, see `BASES`
    erratum: str | None = None  # may explain a difference
    see: str | None = None  # erratum worth reading beside it
    sigma: float | None = None  # unit of a limit in sigma; of a reading, its standard deviation
    # Over seeds, standard deviation of the number in `unit`, of a statement's margin, or of a choice's cost.
    seed_deviation: float | None = None
    reading: bool = False  # read off a figure
    place: str = ""  # line of the overview: Table 7, Fig. 9, Equations, Text
    row: str = ""  # its cell, of a table's or figure's number
    column: str = ""
    keys: Mapping[str, str] = {}  # further columns that identify the cell
    source: str = ""  # file and line where the print was transcribed

    @property
    def value(self) -> float:
        """The printed number in `unit`; for percentages a fraction."""
        return float(self.printed) * self.scale

    @property
    def half_unit(self) -> float:
        """Half a unit in the last printed digit, in `unit`; for a reading off a figure, two sigma of it."""
        if self.reading:
            return 2 * (self.sigma or 0.0)
        return half_unit(self.printed, self.digits) * self.scale

    @property
    def has_number(self) -> bool:
        """Whether the print is a number."""
        try:
            float(self.printed)
        except ValueError:
            return False
        return True


class Claims(NamedTuple):
    """All claims by id, the tolerance classes and facts by name, and curves of figures."""

    file: Path
    classes: dict[str, ToleranceClass]
    items: dict[str, Claim]
    facts: dict[str, Fact]
    curves: list[Curves]
    repeats: str  # pattern of folders of results with other seeds


def read_claims(folder: Path) -> Claims:
    """Read ``claims.yaml`` of a folder and, through its rules, the published tables.

    `PaperError` if an entry is wrong, an id is repeated, a name is unknown, or a printed table has no rule.
    """
    file = folder / "claims.yaml"
    content = read_yaml(file)
    if unknown := [key for key in content if key not in SECTIONS]:
        raise PaperError(f"{file}: {unknown[0]}: unknown key{nearest(unknown[0], SECTIONS)}")
    classes = {
        name: ToleranceClass.read(file, f"classes.{name}", entry)
        for name, entry in _section(content, "classes", dict, file).items()
    }
    rules = [_rule(entry, file) for entry in _section(content, "tables", list, file)]
    inputs = _section(content, "inputs", list, file)
    curves = [Curves.read(file, "curves", entry) for entry in _section(content, "curves", list, file)]
    _check_files(folder, [*(rule.file for rule, _ in rules), *(c.file for c in curves)], inputs, file)
    entries = [entry for rule, more in rules for entry in _cells_of_table(rule, more, classes, folder)]
    entries += [_of_text(entry, file) for entry in _section(content, "claims", list, file)]
    facts = Fact.read_all(folder / "facts.yaml")
    deviations = _deviations(folder / "seed_deviations.csv")
    items: dict[str, Claim] = {}
    for entry in entries:
        claim = _claim(entry, classes, facts, deviations, file)
        if claim.id in items:
            first = items[claim.id].source
            raise PaperError(f"{claim.source}: id = {claim.id!r}: is repeated; first at {first}")
        items[claim.id] = claim
    for entry in _section(content, "tables", list, file):
        _check_known(entry.get("errata", {}), items, f"{entry.place}: errata", "item")
    _check_known(deviations, items, str(folder / "seed_deviations.csv"), "item")
    _check_facts(facts, items, folder / "facts.yaml")
    repeats = str(content.get("repeats") or "")
    if not deviations and not repeats:
        for name, tolerance in classes.items():
            if tolerance.seeds is not None:
                raise PaperError(
                    f"{file}: classes.{name}.seeds: there are no deviations over seeds; give repeats,"
                    " a pattern of folders of results with other seeds, or seed_deviations.csv"
                )
    return Claims(file, classes, items, facts, curves, repeats)


def _section(content: Mapping[str, Any], key: str, kind: type, file: Path) -> Any:
    section = content.get(key) or kind()
    if not isinstance(section, kind):
        form = "a list of entries that begin with -" if kind is list else "a mapping of names to entries"
        raise PaperError(f"{file}: {key}: must be {form}")
    if kind is list and key not in ("inputs",):
        for number, entry in enumerate(section, 1):
            if not isinstance(entry, Entries):
                raise PaperError(f"{file}: {key}, entry {number}: must be a mapping of keys to values")
    return section


def _check_known(names: Any, known: Mapping[str, Any], place: str, what: str) -> None:
    for name in names:
        if name not in known:
            raise PaperError(f"{place}: {name!r}: no such {what}{nearest(str(name), known)}")


def _rule(entry: Entries, file: Path) -> tuple[Rule, Entries]:
    """A rule and the keys that it passes to its claims."""
    own = {field.alias or name for name, field in Rule.model_fields.items()}
    of_rule = Entries((key, value) for key, value in entry.items() if key in own)
    more = Entries((key, value) for key, value in entry.items() if key not in own)
    for each in (of_rule, more):
        each.file = entry.file
        each.line = entry.line
    rule = Rule.read(file, "tables", of_rule)
    if (rule.table is None) == (rule.figure is None):
        raise PaperError(f"{entry.place}: tables: give either table or figure, the number in the paper")
    known = {field.alias or name for name, field in Claim.model_fields.items()}
    _check_known(more, dict.fromkeys([*sorted(known | own)]), f"{entry.place}: {rule.place}", "key")
    return rule, more


def _check_files(folder: Path, judged: Sequence[str], inputs: Sequence[str], file: Path) -> None:
    """Refuse printed tables without a rule, and inputs without a file."""
    published = sorted(each.stem for each in (folder / "published").glob("*.csv"))
    _check_known(inputs, dict.fromkeys(published), f"{file}: inputs", "file of published/")
    for name in published:
        if name not in judged and name not in inputs:
            raise PaperError(
                f"{folder / 'published' / name}.csv: has no rule;"
                f" add one under tables in {file.name}, or list {name} under inputs"
            )


def _cells_of_table(
    rule: Rule, more: Entries, classes: Mapping[str, ToleranceClass], folder: Path
) -> Iterator[Entries]:
    """Entry of a `Claim` for each cell of one table or figure, made by a rule of ``claims.yaml``."""
    cells = cells_of(folder / "published" / f"{rule.file}.csv")
    columns = dict.fromkeys(cell["column"] for cell in cells)
    known = columns | dict.fromkeys(cell["row"] for cell in cells)
    for name in ("columns", "variables"):
        _check_known(getattr(rule, name) or (), columns, f"{more.place}: {rule.place}: {name}", "column")
    if not isinstance(rule.tolerance, str):
        _check_known(rule.tolerance, columns, f"{more.place}: {rule.place}: class", "column")
    sigmas = {_identity(cell, of="row"): cell for cell in cells if cell["column"] == "sigma"}
    short = rule.place.replace("Table ", "T").replace("Fig. ", "F")
    more = Entries({"id": f"{short}.{{row}}.{{column}}", "where": "{row}, {column}"} | more)
    more.file = folder / "claims.yaml"
    for cell in cells:
        column = cell["column"]
        if column not in (rule.columns or columns) or cell.get("note", "").startswith("blank"):
            continue
        if column == "" or cell["row"] == "":
            raise PaperError(f"{cell.place}: has no name of its row or column{nearest('', known)}")
        entry = filled(
            more, cell | {"variable": rule.variables.get(column, "")}, f"{cell.place}: {rule.place}"
        )
        entry |= {key: cell[key] for key in ("row", "column", "printed") if key in cell}
        entry |= {key: cell[key] for key in ("unit", "scale") if cell.get(key)}
        entry["keys"] = {k: v for k, v in cell.items() if k not in ("row", "column", *NOT_KEYS)}
        entry |= {"place": rule.place, "where": f"{rule.place}, {entry['where']}", "source": cell.place}
        name = rule.tolerance if isinstance(rule.tolerance, str) else rule.tolerance.get(column)
        if name is None:
            raise PaperError(
                f"{cell.place}: {rule.place} in claims.yaml: class: has none for column {column!r}"
            )
        entry["class"] = name
        tolerance = classes.get(name)
        if tolerance and tolerance.measure == "sigma":  # printed beside it, or in a column of its own
            entry["sigma"] = _sigma(cell, sigmas)
        entry["erratum"] = rule.errata.get(entry["id"])
        yield entry


def _identity(cell: Mapping[str, str], of: str) -> tuple[str, ...]:
    """Name of a cell's row, and its further keys."""
    return (cell[of], *(value for key, value in cell.items() if key not in ("row", "column", *NOT_KEYS)))


def _sigma(cell: Entries, sigmas: Mapping[tuple[str, ...], Entries]) -> float:
    if cell.get("sigma"):
        check_number(cell["sigma"], f"{cell.place}: sigma", numbers_only=True)
        return float(cell["sigma"])
    beside = sigmas.get(_identity(cell, of="row"))
    if beside is None:
        raise PaperError(
            f"{cell.place}: its class is measured in sigma;"
            " add a column sigma to the file, or a cell sigma to the row"
        )
    check_number(beside["printed"], f"{beside.place}: printed", numbers_only=True)
    return float(beside["printed"]) * float(beside.get("scale") or 1)


def _of_text(entry: Entries, file: Path) -> Entries:
    """Entry of a claim of the text, with its place in the overview."""
    where = str(entry.get("where", ""))
    first = re.match(r"(Table|Fig\.|Figure) (\d+)", where)
    place = TEXT
    if first:
        place = f"{'Table' if first[1] == 'Table' else 'Fig.'} {first[2]}"
    elif re.search(r"\b[Ee]qs? \(", where):
        place = EQUATIONS
    whole = Entries({"place": place, "source": entry.place} | entry)
    whole.file = file
    whole.line = entry.line
    return whole


def _claim(
    entry: Entries,
    classes: Mapping[str, ToleranceClass],
    facts: Mapping[str, Fact],
    deviations: Mapping[str, float],
    file: Path,
) -> Claim:
    """Check an entry and make its claim."""
    name = str(entry.get("id", "a claim without an id"))
    fact = fact_of(name, facts, file.with_name("facts.yaml"))
    more = {"seed_deviation": deviations.get(name), "fact": fact, "basis": facts[fact].basis}
    place = entry["source"]
    whole = Entries(entry | more)
    whole.file = Path(place.rpartition(":")[0])
    whole.line = int(place.rpartition(":")[2])
    claim = Claim.read(place, name, whole)
    tolerance = classes.get(claim.tolerance)
    if tolerance is None:
        near = nearest(claim.tolerance, classes)
        raise PaperError(f"{place}: {name}: class = {claim.tolerance!r}: no such class{near}")
    if tolerance.measure not in ("truth", "log10"):
        check_number(claim.printed, f"{place}: {name}: printed", tolerance.measure in NUMERIC)
    if not claim.compute and tolerance.measure in ("truth", "log10") and not claim.values:
        raise PaperError(f"{place}: {name}: give compute, the function that decides it, or values")
    if not claim.compute and not claim.values and not claim.row:
        raise PaperError(f"{place}: {name}: give compute or values, which say where the reproduced number is")
    if claim.compute and claim.values:
        raise PaperError(f"{place}: {name}: gives compute and values; keep one")
    return claim.model_copy(update={"reading": tolerance.reading})


def _check_facts(facts: Mapping[str, Fact], items: Mapping[str, Claim], file: Path) -> None:
    """Refuse patterns of ids that match no item, and facts whose items all belong to facts before them."""
    having_items = {claim.fact for claim in items.values()}
    for name, fact in facts.items():
        for pattern in fact.items:
            if not any(fnmatchcase(item, pattern) for item in items):
                near = nearest(pattern, items)
                raise PaperError(f"{file}: {name}: items: {pattern!r} matches no item{near}")
        if name not in having_items:
            raise PaperError(
                f"{file}: {name}: all its items belong to facts before it; move it up, or remove it"
            )


def _deviations(file: Path) -> dict[str, float]:
    deviations: dict[str, float] = {}
    for name, text in recorded(file).items():
        check_number(text, f"{file}: {name}", numbers_only=True)
        deviations[name] = float(text)
    return deviations
