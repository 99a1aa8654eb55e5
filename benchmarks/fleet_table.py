"""A table of cylinders beside its configuration."""

import csv
from pathlib import Path

from pneumo.selection.cylinder_template import write_table_template

SHORT_S = 0.3  # of every run: enough to tell files apart, too little for their numbers to mean something
SHORT = f"\n  duration_limit_s: {SHORT_S}"


def write_fleet(folder: Path, count: int, run: str = "") -> None:
    """Write fleet.yaml and fleet.csv, anew if they are there.

    The rows are the first of the table to begin with, each with a stroke and a seed of its own. `run` are
    lines for the section of that name.
    """
    for name in ("fleet.yaml", "fleet.csv"):
        (folder / name).unlink(missing_ok=True)
    configuration = folder / "fleet.yaml"
    table = write_table_template(configuration)
    text = configuration.read_text(encoding="utf-8")
    configuration.write_text(text.replace("\nrun:", f"\nrun:{run}"), encoding="utf-8")
    with table.open(encoding="utf-8", newline="") as file:
        first = next(csv.DictReader(file))
    with table.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(first), lineterminator="\n")
        writer.writeheader()
        for i in range(count):
            row = {"name": f"c{i:05}", "stroke_mm": str(80 + i % 400), "seed": str(i + 1)}
            writer.writerow(first | row)
