"""Printed and reproduced numbers of a paper as tables in HEPData's form: one YAML file each, and an index."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from pneumo.storage.files import write_text
from pneumo.verdict.claims import Claim, Claims
from pneumo.verdict.judging import Item

SOURCES = ("printed", "reproduced")
KEYWORDS = {"observables": ["MSE", "settling time"], "phrases": ["servo-pneumatics", "reduced-order models"]}

Table = dict[str, Any]  # content of one data file


def numbers_by_table(claims: Claims, items: Sequence[Item]) -> dict[str, list[tuple[Claim, Item]]]:
    """Cells of tables and points of figures with printed and reproduced numbers, by table, such as T7."""
    tables: dict[str, list[tuple[Claim, Item]]] = {}
    for item in items:
        claim = claims.items[item["id"]]
        if claim.row and isinstance(item["reproduced"], float | list) and _is_number(claim.printed):
            tables.setdefault(claim.id.partition(".")[0], []).append((claim, item))
    return tables


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def data_table(cells: Sequence[tuple[Claim, Item]]) -> Table:
    """Content of one data file: a row per printed row; per column and unit, printed and reproduced values.

    Errors: of a printed number half a unit of its last digit, or two standard deviations of reading a figure;
    of a reproduced one the standard deviation over sets of seeds, where it is known. An interval is given by
    its middle and half its width.
    """
    places = [_row_and_column(claim) for claim, _ in cells]
    at = {(*place, cell[0].unit): cell for place, cell in zip(places, cells, strict=True)}
    rows = list(dict.fromkeys(row for row, _ in places))
    columns = list(dict.fromkeys((column, unit) for _, column, unit in at))
    heading = {"header": {"name": "row"}, "values": [{"value": row} for row in rows]}
    dependent = [
        {
            "header": {"name": name, "units": unit},
            "qualifiers": [{"name": "source", "value": source}],
            "values": [_value(at.get((row, name, unit)), source) for row in rows],
        }
        for name, unit in columns
        for source in SOURCES
    ]
    return {"independent_variables": [heading], "dependent_variables": dependent}


def _row_and_column(claim: Claim) -> tuple[str, str]:
    """Row and column of a cell, from its place, such as "Table 9, typical, M8, sigma"; the column is last."""
    row, _, column = claim.where.partition(", ")[2].rpartition(", ")
    return (row, column) if row else (column, claim.column)


def _value(cell: tuple[Claim, Item] | None, source: str) -> dict[str, Any]:
    """Value of a cell with its error; a dash where the paper prints none."""
    if cell is None:
        return {"value": "-"}
    claim, item = cell
    value, error, label = claim.value, claim.half_unit, "last printed digit or reading"
    if source == "reproduced":
        value, error, label = item["reproduced"], claim.seed_deviation, "other seeds"
        if isinstance(value, list):
            value, error, label = sum(value) / 2, (value[1] - value[0]) / 2, "what the printed inputs allow"
    errors = [{"symerror": float(f"{error:.3g}"), "label": label}] if error else []
    return {"value": float(f"{value:.6g}")} | ({"errors": errors} if errors else {})


def submission(
    tables: Mapping[str, Sequence[tuple[Claim, Item]]], titles: Mapping[str, str], about: str
) -> Iterator[dict[str, Any]]:
    """Documents of ``submission.yaml``: `about`, then each table with its place in print and keywords."""
    yield {"comment": about}
    for name, cells in tables.items():
        place = cells[0][0].where.partition(",")[0]
        yield {
            "name": name,
            "location": place,
            "description": titles.get(name, place),
            "keywords": [{"name": key, "values": values} for key, values in KEYWORDS.items()],
            "data_file": f"{name}.yaml",
        }


def write_records(
    claims: Claims, verdict: Mapping[str, Any], titles: Mapping[str, str], about: str, folder: Path
) -> None:
    """Write ``submission.yaml`` and a file for each table into a folder."""
    tables = numbers_by_table(claims, verdict["items"])
    documents = list(submission(tables, titles, about))
    write_text(yaml.safe_dump_all(documents, sort_keys=False, allow_unicode=True), folder / "submission.yaml")
    for name, cells in tables.items():
        text = yaml.safe_dump(data_table(cells), sort_keys=False, allow_unicode=True)
        write_text(text, folder / f"{name}.yaml")
