"""The configuration that `pneumo init` writes, with a section or a table of cylinders."""

import re
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from pneumo.configuration.parameters import read_yaml
from pneumo.errors import InputError
from pneumo.storage.files import write_text

TEMPLATE = Path(__file__).parent / "templates" / "cylinder.yaml"
STROKES = {"first": 160, "second": 80}  # mm, of the rows of the template table


def write_template(file: Path) -> None:
    """Write the commented configuration; `InputError` if the file already exists or cannot be written."""
    _write_new({file: TEMPLATE.read_text(encoding="utf-8")})


def write_table_template(file: Path) -> Path:
    """Write a configuration and, beside it, a table of two cylinders; return the table's path.

    `InputError` if one of the files already exists or cannot be written.
    """
    table = file.with_suffix(".csv")
    text = TEMPLATE.read_text(encoding="utf-8")
    section = f"cylinders: {table.name} # one row a cylinder; columns are keys of its section\n\n"
    text = re.sub(r"^cylinders:\n.*?(?=^experiments:)", section, text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^ *cylinder: .*\n", "", text, flags=re.MULTILINE)
    mine = read_yaml(TEMPLATE)["cylinders"]["mine"]
    rows = pd.json_normalize([{"name": name, **mine, "stroke_mm": s} for name, s in STROKES.items()])
    _write_new({file: text, table: rows.to_csv(index=False, lineterminator="\n")})
    return table


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
