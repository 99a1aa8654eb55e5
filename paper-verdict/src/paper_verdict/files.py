"""Reading a paper's files strictly: YAML whose entries know their lines, CSV files, and printed numbers.

Whatever could be a slip (a key twice, a decimal comma, a row with a field too many) is a `PaperError` of one
line that names file and line.
"""

import csv
import math
import re
from collections.abc import Hashable, Iterable, Mapping
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any, Self

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from paper_verdict.errors import PaperError, nearest

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast where PyYAML has libyaml
MERGE = "tag:yaml.org,2002:merge"
PRINTED = ("row", "column", "printed")  # columns of a printed table with one line for each cell
NOT_KEYS = ("note", "unit", "scale", "sigma", "printed")  # columns that do not identify a cell
HEAD = re.compile(r"^(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]$")  # `mass [kg]`
SLIPS = [  # how a number may be written that is none -> what to do
    (re.compile(r"[−–—]\s*[\d.]"), "has a typographic minus; write -"),
    (re.compile(r"^[+-]?\d+,\d+(e[+-]?\d+)?$", re.I), "has a comma; write a decimal point and no separators"),
    (
        re.compile(r"^[~≈∼<>≤≥]\s*[+-]?[\d.]"),
        "is not a plain number; write the digits, and give its claim a wider class or a sense",
    ),
    (re.compile(r"\d\s*[×x·*]\s*10"), "has a power of ten; write it as in 1.2e7"),
    (re.compile(r"^[+-]?[\d.]+\s*%$"), "has a per cent sign; write the number, with unit % and scale 0.01"),
    (re.compile(r"^[+-]\s+[\d.]"), "has a space after its sign; leave it out"),
    (re.compile(r"\d\s*(±|\+/-)|\d\(\d+\)$"), "has an uncertainty; write it into the column sigma"),
    (re.compile(r"^[+-]?\d+([ '_\u00a0\u202f]\d+)+(\.\d+)?$"), "has separators of thousands; leave them out"),
    (re.compile(r"^[+-]?(\d*\.){2,}\d*$"), "has two decimal points"),
    (re.compile(r"^(?=.*\d)[+-]?[\dOolI]*\.?[\dOolI]+$"), "has a letter among its digits"),
]


class Entries(dict[str, Any]):
    """Mapping of a YAML file or row of a CSV file that knows its line."""

    file: Path = Path()
    line: int = 0

    @property
    def place(self) -> str:
        """File and line, as in ``claims.yaml:12``."""
        return f"{self.file}:{self.line}"


def _text(file: Path) -> str:
    try:
        return file.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = file.read_bytes()[: error.start].count(b"\n") + 1
        raise PaperError(f"{file}:{line}: is not UTF-8; save the file in that encoding") from None
    except OSError:
        folder = file.parent
        if not folder.is_dir():
            raise PaperError(f"{folder}: no such folder") from None
        beside = [each.name for each in sorted(folder.iterdir())]
        raise PaperError(f"{file}: no such file{nearest(file.name, beside)}") from None


def read_yaml(file: Path) -> Entries:
    """Read a YAML file, a mapping; `PaperError` if it is missing, wrong, or has a key twice."""

    class Loader(LOADER):
        def construct_entries(self, node: Any) -> Any:
            entries = Entries()
            entries.file = file
            entries.line = node.start_mark.line + 1
            yield entries
            entries.update(self.construct_mapping(node))

    Loader.add_constructor("tag:yaml.org,2002:map", Loader.construct_entries)
    loader = Loader(_text(file))
    try:
        root = loader.get_single_node()
        _check_keys(root, file, set())
        content = loader.construct_document(root) if root else Entries()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = mark.line + 1 if mark else 1
        raise PaperError(f"{file}:{line}: {error.problem or error.context}") from None
    finally:
        loader.dispose()
    if content is None:
        return Entries()
    if not isinstance(content, Entries):
        raise PaperError(f"{file}:1: must be a mapping of names to entries; write {{}} if there are none")
    return content


def _check_keys(node: Any, file: Path, seen: set[int]) -> None:
    """Refuse a key that a mapping has twice: YAML would quietly take the last."""
    if node is None or id(node) in seen or isinstance(node, yaml.ScalarNode):
        return
    seen.add(id(node))
    if isinstance(node, yaml.SequenceNode):
        for each in node.value:
            _check_keys(each, file, seen)
        return
    keys = set[Hashable]()
    for key, value in node.value:
        if key.tag != MERGE and key.value in keys:
            raise PaperError(f"{file}:{key.start_mark.line + 1}: {key.value!r}: is there twice; remove one")
        keys.add(key.value if isinstance(key.value, str) else id(key))
        _check_keys(value, file, seen)


def read_optional(file: Path) -> Entries:
    """Read a YAML file; empty if there is none."""
    return read_yaml(file) if file.exists() else Entries()


class Entry(BaseModel):
    """One entry of a YAML file; its subclasses list the keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)

    @classmethod
    def read(cls, file: Path | str, name: str, entry: Any) -> Self:
        """Check an entry of a file; `PaperError` if a key is unknown, missing or holds a wrong value."""
        try:
            return cls.model_validate(entry)
        except ValidationError as error:
            first = error.errors()[0]
        if isinstance(entry, Entries):
            file = entry.place
        place = ".".join(map(str, (name, *first["loc"])))
        if first["type"] == "extra_forbidden" and len(first["loc"]) == 1:
            keys = [field.alias or key for key, field in cls.model_fields.items()]
            raise PaperError(f"{file}: {place}: unknown key{nearest(str(first['loc'][0]), keys)}")
        if first["type"] == "missing":
            raise PaperError(f"{file}: {place}: is missing")
        if first["type"] == "string_type" and isinstance(first["input"], (bool, int, float)):
            raise PaperError(f"{file}: {place} = {first['input']}: write it in quotes, as it is printed")
        message = first["msg"].removeprefix("Value error, ")
        message = re.sub(r"^Input should be '", "must be one of '", message)
        message = message.replace("Input should be", "must be")
        raise PaperError(f"{file}: {place} = {first['input']!r}: {message}")

    @classmethod
    def read_all(cls, file: Path) -> dict[str, Self]:
        """Read the entries of a file by name; none if there is no such file."""
        return {name: cls.read(file, name, entry) for name, entry in read_optional(file).items()}


def read_csv(file: Path) -> list[Entries]:
    """Rows of a CSV file, every value a string; `PaperError` for a row that has not one field per column."""
    rows = csv.reader(_text(file).splitlines())
    try:
        head = [name.strip() for name in next(rows, [])]
        if len(head) == 1 and ";" in head[0]:
            raise PaperError(f"{file}:1: is separated by semicolons; save it with commas and decimal points")
        if len(head) == 1 and "\t" in head[0]:
            raise PaperError(f"{file}:1: is separated by tabs; save it with commas")
        twice = [name for i, name in enumerate(head) if name in head[:i]]
        if not head or twice or "" in head[1:]:
            wrong = f"has two columns {twice[0]!r}" if twice and twice[0] else "has a column without a name"
            raise PaperError(f"{file}:1: {wrong if head else 'is empty'}; the first line names the columns")
        content: list[Entries] = []
        for fields in rows:
            if not any(map(str.strip, fields)):
                continue
            if len(fields) != len(head):
                hint = "quote a text with commas" if len(fields) > len(head) else "leave empty ones empty"
                raise PaperError(
                    f"{file}:{rows.line_num}: has {len(fields)} fields, the first line {len(head)}; {hint}"
                )
            row = Entries(zip(head, map(str.strip, fields), strict=True))
            row.file = file
            row.line = rows.line_num
            content.append(row)
    except csv.Error as error:
        raise PaperError(f"{file}:{rows.line_num}: {error}") from None
    return content


def read_cells(name: str, folder: Path) -> list[Entries]:
    """Cells of a printed table or figure, such as ``figure9``, in ``published`` of a paper's folder.

    The file has a line for each cell, with `PRINTED` and any keys, or is laid out as printed: rows with their
    names first, and columns with units in brackets. Every value is a string.
    """
    return cells_of(folder / "published" / f"{name}.csv")


def cells_of(file: Path) -> list[Entries]:
    """Cells of one CSV file in either layout."""
    rows = read_csv(file)
    head = list(rows[0]) if rows else []
    if "row" in head and "printed" in head:
        if "column" not in head:
            raise PaperError(f"{file}:1: has no column 'column'{nearest('column', head)}")
        return rows
    if {"column", "printed"} & set(head) or head[:2] == ["row", "column"]:
        lacks = next(name for name in PRINTED if name not in head)
        raise PaperError(f"{file}:1: has no column {lacks!r}{nearest(lacks, head)}")
    return list(_cells_as_printed(rows))


def _cells_as_printed(rows: Iterable[Entries]) -> Iterable[Entries]:
    for row in rows:
        (_, label), *others = row.items()
        for head, printed in others:
            column, unit = column_and_unit(head)
            cell = Entries(row=label, column=column, printed=printed, note="", unit=unit)
            cell.file = row.file
            cell.line = row.line
            yield cell


def column_and_unit(head: str) -> tuple[str, str]:
    """Name and unit of a column's heading.

    Examples
    --------
    >>> column_and_unit("mass [kg]"), column_and_unit("mass")
    (('mass', 'kg'), ('mass', ''))
    """
    match = HEAD.match(head)
    return (match["name"], match["unit"].strip()) if match else (head, "")


def recorded(file: Path) -> dict[str, str]:
    """First and second column of a CSV file as a dictionary; empty if there is no such file."""
    if not file.exists():
        return {}
    result: dict[str, str] = {}
    for row in read_csv(file):
        name, value, *_ = row.values()
        if name in result:
            raise PaperError(f"{row.place}: {name!r}: is there twice; remove one")
        result[name] = value
    return result


def check_number(text: str, place: str, numbers_only: bool) -> None:
    """Refuse a printed text that looks like a number and is none, and, with `numbers_only`, any other."""
    try:
        if "_" not in text and math.isfinite(float(text)):
            return
    except ValueError:
        pass
    for pattern, remedy in SLIPS:
        if pattern.search(text):
            raise PaperError(f"{place}: {text!r}: {remedy}")
    if not text.strip():
        raise PaperError(f"{place}: is empty; write what is printed, or `blank` into the column note")
    if numbers_only:
        raise PaperError(f"{place}: {text!r}: is not a number; write its digits, as in -1.2e7")


def decimals(printed: str) -> int:
    """Digits of a printed number after its point, before any exponent; 0 for a text."""
    try:
        exponent = Decimal(printed.lower().partition("e")[0]).as_tuple().exponent
    except InvalidOperation:
        return 0
    return max(0, -exponent) if isinstance(exponent, int) else 0


def half_unit(printed: str, digits: int | None = None) -> float:
    """Half a unit in the last printed digit: the largest error of rounding.

    Where the authors rounded to some `digits` and filled up with zeros, these zeros do not count as digits.

    Examples
    --------
    >>> half_unit("1.02e4"), half_unit("140"), half_unit("-0.047")
    (50.0, 0.5, 0.0005)
    >>> half_unit("3000", digits=2), half_unit("46.0", digits=2), half_unit("27.5", digits=2)
    (50.0, 0.5, 0.05)
    """
    _, figures, exponent = Decimal(printed).as_tuple()
    last = Decimal(5).scaleb(int(exponent) - 1)
    text = "".join(map(str, figures))
    kept = text if digits is None else text[:digits] + text[digits:].rstrip("0")
    return float(last.scaleb(len(text) - len(kept)))


def filled(value: Any, names: Mapping[str, str], place: str) -> Any:
    """Replace names in braces by their values in `names`, in all texts inside a value."""
    if isinstance(value, dict):
        entries = Entries((key, filled(inner, names, place)) for key, inner in value.items())
        if isinstance(value, Entries):
            entries.file = value.file
            entries.line = value.line
        return entries
    if isinstance(value, list):
        return [filled(inner, names, place) for inner in value]
    if not isinstance(value, str):
        return value
    try:
        return value.format_map(names)
    except KeyError as error:
        name = str(error.args[0])
        raise PaperError(
            f"{place}: {value!r}: no column {name!r} in the table{nearest(name, names)}"
        ) from None
    except (ValueError, IndexError, AttributeError):
        raise PaperError(f"{place}: {value!r}: write a column's name in braces, as in {{row}}") from None
