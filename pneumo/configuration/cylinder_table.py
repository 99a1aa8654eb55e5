"""Tables of cylinders: a CSV or Parquet file instead of the section ``cylinders``, one row per cylinder.

Its columns are ``name`` and keys of the schema, those of inner sections with a point (``valve.b``). Every
experiment of the configuration runs on every row.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.configuration.schema import SCHEMA
from pneumo.configuration.schema_messages import dotted, resolved
from pneumo.configuration.schema_parts import merged
from pneumo.configuration.text_file import NUMBER, csv_rows, read_text
from pneumo.errors import ConfigurationError, printable, shown
from pneumo.regular_file import regular_file

LARGEST_TABLE = 100_000_000  # bytes as text; ten thousand cylinders have one or two million
LONGEST_INTEGER = 4000  # digits; Python reads no more than 4300
OF_EXPERIMENTS = ("k_0_W_per_K", "lambda_0_W_per_m2K", "duration_s")  # keys that may differ between rows


def _columns(node: Mapping[str, Any], path: str = "") -> list[str]:
    """Columns that a table may have for a section of the schema; keys of inner sections get a point."""
    keys: list[str] = []
    for key, field in node["properties"].items():
        inner = resolved(field)
        keys += _columns(inner, f"{path}{key}.") if "properties" in inner else [path + key]
    return keys


COLUMNS = ("name", *_columns(SCHEMA["$defs"]["CylinderSection"]), *OF_EXPERIMENTS)


class CylinderTable(NamedTuple):
    """Rows of a table, as sections of a configuration."""

    file: str  # name in messages
    cylinders: dict[str, dict[str, Any]]  # sections by name
    of_experiments: dict[str, dict[str, Any]]  # `OF_EXPERIMENTS` that a row sets, by name
    rows: dict[str, int]  # number by name, as in a spreadsheet: row 1 has the columns' names

    def part(self, names: Iterable[str]) -> "CylinderTable":
        """Table with only the rows of the given names."""
        chosen = list(names)
        cylinders = {name: self.cylinders[name] for name in chosen}
        of_experiments = {name: self.of_experiments[name] for name in chosen}
        return CylinderTable(self.file, cylinders, of_experiments, {name: self.rows[name] for name in chosen})

    @property
    def source(self) -> tuple[str, dict[str, Any]]:
        """Name of the table's file, and its rows as sections of a configuration, for error messages."""
        sections = {name: section | self.of_experiments[name] for name, section in self.cylinders.items()}
        return self.file, {"cylinders": sections}

    def written(self, path: tuple[Any, ...], experiments: Iterable[str]) -> tuple[tuple[Any, ...], str]:
        """Find where the user wrote a field of the configuration that `with_table` made.

        Returns the field's path in the table or in the configuration file, and text for a message, such as
        "row 3, column bore_mm". `experiments` are the names in the configuration file.
        """
        if path[:1] == ("experiments",) and len(path) > 1:
            for cylinder, name in ((c, e) for e in experiments for c in self.rows):
                if path[1] == experiment_name(cylinder, name):
                    in_table = path[2:3] and path[2] in self.of_experiments[cylinder]
                    path = ("cylinders", cylinder, path[2]) if in_table else ("experiments", name, *path[2:])
                    break
        if path[:1] == ("cylinders",) and len(path) > 1 and path[1] in self.rows:
            return path, f"row {self.rows[path[1]]}, column {'.'.join(map(str, path[2:])) or 'name'}"
        return path, dotted(path)


def experiment_name(cylinder: str, experiment: str) -> str:
    """Name of an experiment when it runs on one cylinder of a table: cylinder, hyphen, experiment."""
    return f"{cylinder}-{experiment}"


def with_table(
    content: Mapping[str, Any], table: CylinderTable, names: Iterable[str] | None = None
) -> dict[str, Any]:
    """Configuration with the named cylinders of a table, by default all, and every experiment on each.

    `ConfigurationError` if an experiment names a cylinder itself, or two experiments would get one name.
    """
    cylinders = {name: table.cylinders[name] for name in names or table.cylinders}
    result = {**content, "cylinders": cylinders}
    templates, run = content.get("experiments"), content.get("run")
    if not isinstance(templates, Mapping) or not all(isinstance(e, Mapping) for e in templates.values()):
        return result  # the schema says what is wrong
    experiments: dict[str, Any] = {}
    for name, template in templates.items():
        if "cylinder" in template:
            problem = "not allowed with a table of cylinders, where every experiment runs on every row"
            field = f"experiments.{printable(name)}.cylinder = {shown(template['cylinder'])}"
            raise ConfigurationError(f"{field}: {problem}")
        for cylinder in cylinders:
            full = experiment_name(cylinder, name)
            if full in experiments:
                raise ConfigurationError(f"{table.file}: two experiments would have the name {full}")
            experiments[full] = merged(template, {"cylinder": cylinder, **table.of_experiments[cylinder]})
    result["experiments"] = experiments
    if isinstance(run, Mapping) and isinstance(run.get("experiments"), list):
        chosen = [experiment_name(cylinder, name) for cylinder in cylinders for name in run["experiments"]]
        result["run"] = {**run, "experiments": chosen}
    return result


def read_table(file: Path, value: str, named_in: str) -> CylinderTable:
    """Read a table of cylinders; `named_in` and `value` (the configuration's name for it) are for messages.

    CSV has commas, semicolons or tabs between columns and points in numbers. Values of a file named
    ``*.parquet`` are converted to text. An empty or null cell leaves its key out; an empty row is skipped.

    Raises
    ------
    ConfigurationError
        With one line that names the file, and row and column where one is wrong.
    """
    where, named = printable(str(file), 300), f"{named_in}: cylinders = {shown(value)}"
    parquet = file.suffix.lower() == ".parquet"
    rows = _parquet_rows(file, named) if parquet else _csv_rows(where, read_text(file, LARGEST_TABLE, named))
    head = [cell.strip() for cell in next(rows, [])]
    _check_head(where, head)
    table = CylinderTable(where, {}, {}, {})
    for number, cells in enumerate(rows, start=2):
        if any(map(str.strip, cells)):
            _add_row(table, head, number, [cell.strip() for cell in cells])
    if not table.rows:
        raise ConfigurationError(f"{where}: has no rows below the names of its columns")
    return table


def _csv_rows(where: str, text: str) -> Iterator[list[str]]:
    reader = csv_rows(text)
    try:
        yield from reader
    except csv.Error as error:
        raise ConfigurationError(f"{where}: line {reader.line_num}: {printable(str(error))}") from None


def _parquet_rows(file: Path, named: str) -> Iterator[list[str]]:
    """Yield the column names of a Parquet file, then each row with its values as text; null becomes ""."""
    try:
        from pyarrow import ArrowException, string
        from pyarrow.parquet import ParquetFile
    except ImportError:
        raise ConfigurationError(f"{named}: a Parquet file needs pyarrow; pip install pyarrow") from None
    too_large = ConfigurationError(f"{named}: must have at most {LARGEST_TABLE} bytes when written as text")
    try:
        with regular_file(file, LARGEST_TABLE) as stream, ParquetFile(stream) as table:
            about = table.metadata
            yield table.schema_arrow.names
            if (
                about.num_rows * about.num_columns > LARGEST_TABLE
            ):  # a cell and its separator: one byte or more
                raise too_large
            # No cell is larger than all values uncompressed: so many rows fit into memory.
            largest_cell = 1 + sum(about.row_group(i).total_byte_size for i in range(about.num_row_groups))
            size = 0
            for batch in table.iter_batches(min(1000, 1 + LARGEST_TABLE // largest_cell)):
                columns = [column.cast(string()).to_pylist() for column in batch.columns]
                rows = [[cell or "" for cell in row] for row in zip(*columns, strict=True)]
                size += sum(len(cell) + 1 for row in rows for cell in row)
                if size > LARGEST_TABLE:
                    raise too_large
                yield from rows
    except ConfigurationError:
        raise
    except (OSError, ValueError, ArrowException) as error:
        raise ConfigurationError(f"{named}: cannot be read: {printable(str(error), 300)}") from None


def _check_head(where: str, head: Sequence[str]) -> None:
    for column in head:
        if column not in COLUMNS:
            known = ", ".join(COLUMNS)
            problem = f"unknown; columns are keys of a cylinder: {known}"
            raise ConfigurationError(f"{where}: row 1, column {shown(column)}: {problem}")
        if head.count(column) > 1:
            raise ConfigurationError(f"{where}: row 1, column {column}: appears twice")
    if "name" not in head:
        raise ConfigurationError(f"{where}: row 1: no column name with the names of the cylinders")


def _value(text: str) -> int | float | str:
    """Value of a table's cell: a number if it is one, else the text."""
    if not NUMBER.fullmatch(text):
        return text
    whole = text.lstrip("+-").isdecimal() and len(text) < LONGEST_INTEGER
    return int(text) if whole else float(text)


def _add_row(table: CylinderTable, head: Sequence[str], number: int, cells: Sequence[str]) -> None:
    """Add to a table, in place, the cylinder of one row; `number` is that of the row in the file."""
    place = f"{table.file}: row {number}"
    if any(cells[len(head) :]):
        raise ConfigurationError(f"{place}: has {len(cells)} cells for {len(head)} columns")
    filled = {column: cell for column, cell in zip(head, cells, strict=False) if cell}
    name = filled.pop("name", "")
    if name in table.rows:
        raise ConfigurationError(f"{place}, column name = {shown(name)}: duplicate of row {table.rows[name]}")
    section: dict[str, Any] = {}
    for column, cell in filled.items():
        *parents, key = column.split(".")
        inner = section
        for parent in parents:
            inner = inner.setdefault(parent, {})
        inner[key] = _value(cell)
    table.rows[name] = number
    table.of_experiments[name] = {key: section.pop(key) for key in OF_EXPERIMENTS if key in section}
    table.cylinders[name] = section
