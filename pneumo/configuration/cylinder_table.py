"""Tables of cylinders: a CSV file instead of the section ``cylinders``, one row per cylinder.

Its columns are ``name`` and keys of the schema, with dots for nested keys (``valve.b``). Every
experiment of the configuration runs on every row.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.configuration.schema import SCHEMA
from pneumo.configuration.schema_messages import dotted, resolved
from pneumo.configuration.schema_parts import merged
from pneumo.configuration.text_file import NUMBER, read_csv
from pneumo.errors import ConfigurationError, printable, shown

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
    cylinders: dict[str, dict[str, Any]]  # sections by name, and the `OF_EXPERIMENTS` that their rows set
    rows: dict[str, int]  # number by name, as in a spreadsheet: row 1 has the columns' names

    @property
    def source(self) -> tuple[str, dict[str, Any]]:
        """Name of the table's file, and its rows as sections of a configuration, for error messages."""
        return self.file, {"cylinders": self.cylinders}

    def written(self, path: tuple[Any, ...], experiments: Iterable[str]) -> tuple[tuple[Any, ...], str]:
        """Find where the user wrote a field of the configuration that `with_table` made.

        Returns the field's path in the table or in the configuration file, and text for a message, such as
        "row 3, column bore_mm". `experiments` are the names in the configuration file.
        """
        if path[:1] == ("experiments",) and len(path) > 1:
            made = {experiment_name(c, e): (c, e) for e in experiments for c in self.rows}
            if path[1] in made:
                cylinder, experiment = made[path[1]]
                in_row = path[2:3] and path[2] in _of_experiments(self.cylinders[cylinder])
                path = ("cylinders", cylinder, path[2]) if in_row else ("experiments", experiment, *path[2:])
        if path[:1] == ("cylinders",) and len(path) > 1 and path[1] in self.rows:
            return path, f"row {self.rows[path[1]]}, column {'.'.join(map(str, path[2:])) or 'name'}"
        return path, dotted(path)


def experiment_name(cylinder: str, experiment: str) -> str:
    """Name of an experiment when it runs on one cylinder of a table: cylinder, hyphen, experiment."""
    return f"{cylinder}-{experiment}"


def _of_experiments(row: Mapping[str, Any]) -> dict[str, Any]:
    return {key: row[key] for key in OF_EXPERIMENTS if key in row}


def with_table(
    content: Mapping[str, Any], table: CylinderTable, names: Iterable[str] | None = None
) -> dict[str, Any]:
    """Configuration with the named cylinders of a table, by default all, and every experiment on each.

    `ConfigurationError` if an experiment names a cylinder itself, or two experiments would get one name.
    """
    rows = {name: table.cylinders[name] for name in names or table.cylinders}
    sections = {name: {k: v for k, v in row.items() if k not in OF_EXPERIMENTS} for name, row in rows.items()}
    result = {**content, "cylinders": sections}
    templates, run = content.get("experiments"), content.get("run")
    if not isinstance(templates, Mapping) or not all(isinstance(e, Mapping) for e in templates.values()):
        return result  # the schema says what is wrong
    experiments: dict[str, Any] = {}
    for name, template in templates.items():
        if "cylinder" in template:
            problem = "not allowed with a table of cylinders, where every experiment runs on every row"
            field = f"experiments.{printable(name)}.cylinder = {shown(template['cylinder'])}"
            raise ConfigurationError(f"{field}: {problem}")
        for cylinder, row in rows.items():
            full = experiment_name(cylinder, name)
            if full in experiments:
                raise ConfigurationError(f"{table.file}: two experiments would have the name {full}")
            experiments[full] = merged(template, {"cylinder": cylinder, **_of_experiments(row)})
    result["experiments"] = experiments
    if isinstance(run, Mapping) and isinstance(run.get("experiments"), list):
        chosen = [experiment_name(cylinder, name) for cylinder in rows for name in run["experiments"]]
        result["run"] = {**run, "experiments": chosen}
    return result


def read_table(file: Path, value: str, named_in: str) -> CylinderTable:
    """Read a table of cylinders; `named_in` and `value` (the configuration's name for it) are for messages.

    Commas, semicolons or tabs are between columns and points in numbers. An empty cell leaves its key out;
    an empty row is skipped. The line of a `ConfigurationError` names the file, and row and column where one
    is wrong.
    """
    where, named = printable(str(file), 300), f"{named_in}: cylinders = {shown(value)}"
    cells = read_csv(file, named)
    for column in cells:
        if column not in COLUMNS:
            problem = f"unknown; columns are keys of a cylinder: {', '.join(COLUMNS)}"
            raise ConfigurationError(f"{where}: row 1, column {shown(column)}: {problem}")
    if not cells.columns.is_unique:
        column = cells.columns[cells.columns.duplicated()][0]
        raise ConfigurationError(f"{where}: row 1, column {column}: appears twice")
    if "name" not in cells:
        raise ConfigurationError(f"{where}: row 1: no column name with the names of the cylinders")
    table = CylinderTable(where, {}, {})
    for number, row in enumerate(cells.to_dict("records"), start=2):
        if filled := {str(column): cell for column, cell in row.items() if cell}:
            _add_row(table, number, filled)
    if not table.rows:
        raise ConfigurationError(f"{where}: has no rows below the names of its columns")
    return table


def _value(text: str) -> int | float | str:
    """Value of a table's cell: a number if it is one, else the text."""
    number = float(text) if NUMBER.fullmatch(text) else text
    return int(number) if isinstance(number, float) and number.is_integer() else number


def _add_row(table: CylinderTable, number: int, filled: dict[str, str]) -> None:
    """Add to a table, in place, the cylinder of one row; `number` is that of the row in the file."""
    name = filled.pop("name", "")
    if name in table.rows:
        place = f"{table.file}: row {number}, column name = {shown(name)}"
        raise ConfigurationError(f"{place}: duplicate of row {table.rows[name]}")
    section: dict[str, Any] = {}
    for column, cell in filled.items():
        *parents, key = column.split(".")
        inner = section
        for parent in parents:
            inner = inner.setdefault(parent, {})
        inner[key] = _value(cell)
    table.rows[name] = number
    table.cylinders[name] = section
