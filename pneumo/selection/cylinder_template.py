"""The configuration that `pneumo init` writes, with a section or a table of cylinders."""

import csv
import io
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pneumo.configuration.parameters import read_yaml
from pneumo.errors import InputError
from pneumo.storage.files import write_text

TEMPLATE = Path(__file__).parent / "templates" / "cylinder.yaml"
STROKES = {"first": 160, "second": 80}  # mm, of the rows of the template table


def write_template(file: Path, source: Path = TEMPLATE) -> None:
    """Write a copy of the commented configuration, or of another one.

    `InputError` if the file already exists or cannot be written.
    """
    _write_new({file: source.read_text(encoding="utf-8-sig")})


def write_table_template(file: Path) -> Path:
    """Write a configuration and, beside it, a table of two cylinders; return the table's path.

    `InputError` if one of the files already exists or cannot be written.
    """
    table = file.with_suffix(".csv")
    text = TEMPLATE.read_text(encoding="utf-8")
    section = f"cylinders: {table.name} # one row a cylinder; columns are keys of its section\n\n"
    text = re.sub(r"^cylinders:\n.*?(?=^experiments:)", section, text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^ *cylinder: .*\n", "", text, flags=re.MULTILINE)
    columns = dict(_leaves(read_yaml(TEMPLATE)["cylinders"]["mine"]))
    rows = [{"name": name, **columns, "stroke_mm": stroke} for name, stroke in STROKES.items()]
    content = io.StringIO()
    writer = csv.DictWriter(content, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    _write_new({file: text, table: content.getvalue()})
    return table


def _leaves(section: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (column, value) for each key of a section; keys of inner sections get a point, as in valve.b."""
    for key, value in section.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield path + key, value


def _write_new(texts: Mapping[Path, str]) -> None:
    """Write files; `InputError` if one of them already exists."""
    for file in texts:
        if file.exists() or file.is_symlink():
            raise InputError(f"{file}: already exists; not overwritten, name another file")
    for file, text in texts.items():
        try:
            write_text(text, file)
        except OSError as error:
            raise InputError(f"{file}: cannot be written ({error.strerror})") from None
