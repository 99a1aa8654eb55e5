"""What the paper claims, from ``paper/2006/claims.yaml``: one `Claim` per printed number or statement.

The cells of the tables come from the transcriptions, through one rule per table; the text's claims are
written out. Reading them needs no result.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, NamedTuple

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from pneumo.errors import PneumoError
from pneumo.verdict.published import STATISTICS, half_unit, read_table

FOLDER = Path(__file__).resolve().parents[2] / "paper" / "2006"

UNITS = {"Pa2": "Pa²", "m2": "m²", "m3": "m³", "W m-2 K-1": "W/(m² K)", "1": ""}  # UDUNITS -> as read

Kind = Literal["exact", "rounded", "ratio", "ranking", "qualitative"]
Sense = Literal["equal", "at_most", "at_least"]
Measure = Literal["absolute", "relative", "sigma", "swing", "truth", "log10"]


class ClaimsError(PneumoError, ValueError):
    """A file of claims that does not hold together; its text is one line."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ToleranceClass(_Part):
    """A tolerance class, as decided in ``paper/decisions/0010-tolerance-classes.md``.

    Attributes
    ----------
    limit : float
        How far an item may be off and still be close.
    measure : str
        What the limit is counted in: the number's own unit, the printed number, the row's sigma, the
        swing of the run, decades; or truth, for statements.
    floor : float
        Smallest limit, in the number's unit.
    """

    limit: float
    measure: Measure
    floor: float = 0.0


class Evidence(_Part):
    """The file that shows an item, and where in it."""

    path: str
    select: str


class Claim(_Part):
    """One printed number or statement and how it is judged.

    Attributes
    ----------
    id, where, statement : str
        Name, place in the paper, and what is claimed, in other words than the paper's.
    printed : str
        As printed.
    unit : str
        Unit of the value.
    scale : float
        The printed number times this is the value.
    digits : int or None
        Significant digits, where zeros fill up.
    sense, kind : str
        Direction and kind of the claim.
    tolerance : str
        Tolerance class, under the key ``class``.
    compute : str
        Name of a computation; ``arguments`` (key ``with``) are its arguments.
    evidence : Evidence
    models : bool
        A statement about models, judged with exact transport and on the paper's own tables too.
    headline : bool
        One of those that stand in short lists.
    arithmetic : bool
        Needs nothing but the paper's own numbers and formulas.
    used_in_identification : bool
        Constants that the paper leaves open were found from this number.
    erratum, assumption, see : str or None
        Erratum or alternative assumption that may explain a difference; erratum worth reading beside it.
    sigma : float or None
        Scale of class ``mu``, Pa.
    unreadable : str
        Why the print cannot be read, or empty.
    table : int or None
        Table of the paper that the item is a cell of; its ``row``, ``column`` and ``level``.
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


def read_claims(folder: Path = FOLDER) -> Claims:
    """Read the claims and, through their rules, the published tables.

    Parameters
    ----------
    folder
        Folder that holds ``claims.yaml`` and ``published/``.

    Returns
    -------
    Claims

    Raises
    ------
    ClaimsError
        If the file has an unknown key, a name twice, or a tolerance class that it does not define.
    """
    file = folder / "claims.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    try:
        classes = {name: ToleranceClass(**value) for name, value in content["classes"].items()}
        claims = [claim for rule in content["tables"] for claim in _cells(rule, folder / "published")]
        claims += [_claim(**entry) for entry in content["claims"]]
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ClaimsError(f"{file}: {error.title}: {place} = {first['input']!r}: {first['msg']}") from None
    items: dict[str, Claim] = {}
    for claim in claims:
        if claim.id in items:
            raise ClaimsError(f"{file}: id = {claim.id!r}: stands there twice")
        if claim.tolerance not in classes:
            raise ClaimsError(
                f"{file}: {claim.id}: class = {claim.tolerance!r}: must be one of {', '.join(classes)}"
            )
        items[claim.id] = claim
    return Claims(classes, items)


def _claim(**entry: Any) -> Claim:
    entry["tolerance"] = entry.pop("class")
    entry["arguments"] = entry.pop("with", {})
    return Claim(**entry)


def _cells(rule: Mapping[str, Any], folder: Path) -> list[Claim]:
    """Claims of one table's cells: names in braces are filled from the columns of the transcription."""
    number = rule["table"]
    cells = read_table(number, folder)
    if "columns" in rule:
        cells = cells[cells["column"].isin(rule["columns"])]
    used = rule.get("used_in_identification", {})
    claims = []
    for line in cells.itertuples(index=False):
        cell: dict[str, str] = dict(zip(cells.columns, line, strict=True))
        row, column, level = cell["row"], cell["column"], cell.get("level", "")
        names = cell | {"variable": STATISTICS.get(column, ("",))[0]}

        def filled(text: Any, names: Mapping[str, str] = names) -> Any:
            return text.format(**names) if isinstance(text, str) else text

        name = filled(rule["id"])
        tolerance = rule["class"] if isinstance(rule["class"], str) else rule["class"][column]
        note = cell["note"]
        claims.append(
            Claim(
                id=name,
                where=f"Table {number}, {filled(rule.get('where', '{row}, {column}'))}",
                statement=filled(rule.get("statement", "")),
                printed=cell["printed"],
                unit=cell.get("unit", ""),
                scale=float(cell.get("scale", 1)),
                digits=rule.get("digits"),
                kind=rule["kind"],
                tolerance=tolerance,
                compute=rule["compute"],
                arguments={key: filled(text) for key, text in rule["with"].items()},
                evidence=Evidence(**{key: filled(text) for key, text in rule["evidence"].items()}),
                models=rule.get("models", False),
                arithmetic=rule.get("arithmetic", False),
                used_in_identification=column in used.get("columns", []) and row in used.get("rows", [row]),
                erratum=rule.get("errata", {}).get(name),
                assumption=rule.get("assumptions", {}).get(name),
                sigma=_sigma(cells, cell) if tolerance == "mu" else None,
                unreadable=note.removeprefix("unreadable: ") if note.startswith("unreadable") else "",
                table=number,
                row=row,
                column=column,
                level=level,
            )
        )
    return claims


def _sigma(cells: Any, cell: Mapping[str, str]) -> float:
    """Return the standard deviation printed in the row of a mean error, Pa."""
    same = (cells["row"] == cell["row"]) & (cells["column"] == "sigma")
    if "level" in cell:
        same &= cells["level"] == cell["level"]
    (sigma,) = cells[same].to_dict("records")
    return float(sigma["printed"]) * float(sigma.get("scale", 1))
