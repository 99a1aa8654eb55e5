"""What a paper claims, from ``claims.yaml``: one `Claim` per printed number or statement.

The cells of the tables come from the transcriptions, through one rule per table; the text's claims are
written out. Reading them needs no result.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from pneumo.verdict import PAPER_FOLDER, PaperError, paper_file
from pneumo.verdict.published import STATISTICS, Cell, half_unit, read_table

UNITS_IN_TEXT = {"Pa2": "Pa²", "m2": "m²", "m3": "m³", "W m-2 K-1": "W/(m² K)", "1": ""}  # from UDUNITS

Kind = Literal["exact", "rounded", "ratio", "ranking", "qualitative"]
Sense = Literal["equal", "at_most", "at_least"]
Measure = Literal["absolute", "relative", "sigma", "swing", "truth", "log10"]


PASSED_ON = ("kind", "compute", "digits", "models", "arithmetic")  # from a table's rule to its claims


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ToleranceClass(_Strict):
    """A tolerance class, as decided in ``paper/decisions/0010-tolerance-classes.md``.

    Attributes
    ----------
    limit : float
        Largest deviation at which an item is still close.
    measure : str
        Unit of the limit: the number's own, the printed number, the row's sigma, the swing of the run,
        decades; or truth, for statements.
    floor : float
        Smallest limit, in the number's unit.
    """

    limit: float
    measure: Measure
    floor: float = 0.0


class Evidence(_Strict):
    """File in which an item can be seen, and where in it."""

    path: str
    select: str


class Claim(_Strict):
    """One printed number or statement and how it is judged.

    Attributes
    ----------
    id, where, statement : str
        Name, place in the paper, and what is claimed, in other words than the paper's.
    printed, unit, scale : str, str, float
        The number as printed; times ``scale`` it is the value in ``unit``.
    digits : int or None
        Significant digits, where the authors filled up with zeros.
    sense, kind : str
        Direction and kind of the claim.
    tolerance : str
        Name of the tolerance class (key ``class`` of the file).
    compute, arguments : str, mapping
        Name of the computation and its arguments (key ``with``).
    evidence : Evidence
    models : bool
        A statement about models, judged with exact transport and on the paper's own tables too.
    headline : bool
        Stands in short lists.
    arithmetic : bool
        Needs only the paper's own numbers and formulas.
    used_in_identification : bool
        Constants that the paper leaves open were found from this number.
    erratum, assumption, see : str or None
        Erratum or alternative assumption that may explain a difference; erratum worth reading beside it.
    sigma : float or None
        Scale of class ``mu``, Pa.
    unreadable : str
        Why the print cannot be read, or empty.
    table, row, column, level : int or None, str, str, str
        Cell of the paper's tables that the item is, if it is one.
    """

    id: str
    where: str
    statement: str = ""
    printed: str
    unit: str = ""
    scale: float = 1.0
    digits: int | None = None
    sense: Sense = "equal"
    kind: Kind
    tolerance: str
    compute: str
    arguments: Mapping[str, Any] = {}
    evidence: Evidence
    models: bool = False
    headline: bool = False
    arithmetic: bool = False
    used_in_identification: bool = False
    erratum: str | None = None
    assumption: str | None = None
    see: str | None = None
    sigma: float | None = None
    unreadable: str = ""
    table: int | None = None
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
    """Read the claims and, through their rules, the published tables.

    Parameters
    ----------
    folder
        Folder that holds ``claims.yaml`` and ``published/``.

    Raises
    ------
    PaperError
        If the file is missing, has an unknown key, a name twice, or an undefined tolerance class.
    """
    file = paper_file(folder, "claims.yaml")
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    try:
        classes = {name: ToleranceClass(**value) for name, value in content["classes"].items()}
        claims = [claim for rule in content["tables"] for claim in _cells_of_table(rule, folder)]
        claims += [_claim_of_text(**entry) for entry in content["claims"]]
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise PaperError(f"{file}: {error.title}: {place} = {first['input']!r}: {first['msg']}") from None
    items: dict[str, Claim] = {}
    for claim in claims:
        if claim.id in items:
            raise PaperError(f"{file}: id = {claim.id!r}: stands there twice")
        if claim.tolerance not in classes:
            raise PaperError(
                f"{file}: {claim.id}: class = {claim.tolerance!r}: must be one of {', '.join(classes)}"
            )
        items[claim.id] = claim
    return Claims(classes, items)


def _claim_of_text(**entry: Any) -> Claim:
    """Claim from an entry under ``claims``."""
    entry["tolerance"] = entry.pop("class")
    entry["arguments"] = entry.pop("with", {})
    return Claim(**entry)


def _cells_of_table(rule: Mapping[str, Any], folder: Path) -> Iterator[Claim]:
    """Claims of one table's cells: names in braces are filled from the keys of the cell."""
    number = rule["table"]
    cells = read_table(number, folder)
    if "columns" in rule:
        cells = [cell for cell in cells if cell["column"] in rule["columns"]]
    used = rule.get("used_in_identification", {})
    for cell in cells:
        row, column, note = cell["row"], cell["column"], cell["note"]
        names = cell | {"variable": STATISTICS.get(column, ("",))[0]}
        name = _filled(rule["id"], names)
        tolerance = rule["class"] if isinstance(rule["class"], str) else rule["class"][column]
        yield Claim(
            id=name,
            where=f"Table {number}, {_filled(rule.get('where', '{row}, {column}'), names)}",
            statement=_filled(rule.get("statement", ""), names),
            printed=cell["printed"],
            unit=cell.get("unit", ""),
            scale=float(cell.get("scale", 1)),
            tolerance=tolerance,
            arguments={key: _filled(text, names) for key, text in rule["with"].items()},
            evidence=Evidence(**{key: _filled(text, names) for key, text in rule["evidence"].items()}),
            **{key: rule[key] for key in PASSED_ON if key in rule},
            used_in_identification=column in used.get("columns", []) and row in used.get("rows", [row]),
            erratum=rule.get("errata", {}).get(name),
            assumption=rule.get("assumptions", {}).get(name),
            sigma=_sigma(cells, cell) if tolerance == "mu" else None,
            unreadable=note.removeprefix("unreadable: ") if note.startswith("unreadable") else "",
            table=number,
            row=row,
            column=column,
            level=cell.get("level", ""),
        )


def _filled(text: Any, names: Mapping[str, str]) -> Any:
    """Fill in the names in braces of a text; return anything else unchanged."""
    return text.format(**names) if isinstance(text, str) else text


def _sigma(cells: Sequence[Cell], of: Cell) -> float:
    """Standard deviation printed in the row of a mean error, Pa."""
    (sigma,) = (
        cell
        for cell in cells
        if cell["column"] == "sigma" and all(cell.get(key) == of.get(key) for key in ("row", "level"))
    )
    return float(sigma["printed"]) * float(sigma.get("scale", 1))
