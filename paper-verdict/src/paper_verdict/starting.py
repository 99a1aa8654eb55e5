"""``paper-verdict init``: a commented folder, from CSV files of the printed tables or with an example."""

import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

from paper_verdict.errors import PaperError
from paper_verdict.files import cells_of, check_number

EXAMPLE = {
    "table1.csv": """\
liquid,density [kg m-3],boils [degC]
water,998,101
ethanol,789,78
""",
}
EXAMPLE_REPRODUCED = """\
liquid,density [kg m-3],boils [degC]
water,998.2,99.97
ethanol,789.3,78.2
"""
PAPER = """\
# What the paper is. Every key may be left out.
title: {title}
authors: ""
journal: ""
doi: ""
# How the numbers were reproduced, in one sentence.
how: ""
# The folder of reproduced values, relative to this one.
results: reproduced
"""
CLAIMS = """\
# What the paper claims, and how each number is judged. Choose the tolerances before you look at results.

classes:
  printed: {{limit: 0, measure: absolute}} # equal at the printed digits
  about: {{limit: 0.05, measure: relative}} # within 5 % of the print
  statement: {{limit: 0, measure: truth}} # true or false

# A rule for the cells of each printed table: published/table1.csv, and so on. Without more, the reproduced
# numbers are at the same rows and columns of a file of the same name in the folder of results. They can be
# anywhere else:
#   values: {{file: run.nc, variable: "{{column}}", select: {{model: "{{row}}"}}, reduce: mean}}
# or a function of computations.py can compute them:
#   compute: my_function
#   with: {{name: "{{row}}"}}
tables:
{rules}
# Statements and numbers of the text, for instance:
#   - id: S1.densest
#     where: Section 1
#     statement: water is the densest
#     printed: "true"
#     class: statement
#     compute: densest # def densest(results): ... in computations.py, returns True or False
claims: []
"""
RULE = """\
  - table: {number}
    class: about
"""
FACTS = """\
# What the paper says, one entry for each independent fact. An item belongs to the first fact with a pattern
# of its id.
#   basis   prediction (nothing was chosen with it in view), fitted (something was, name it under chosen),
#           arithmetic (follows from the paper's own numbers) or set-up (an input: it cannot fail)
{facts}"""
FACT = """\
table_{number}: {{says: "The numbers of Table {number}", basis: prediction, items: [T{number}.*]}}
"""
ERRATA = """\
# Misprints of the paper. Only a proof from printed numbers alone can say that the paper is wrong: a function
# of computations.py, which returns whether the print is wrong, and the numbers that show it. For instance:
#   boiling:
#     kind: misprint
#     where: Table 1
#     printed: "101"
#     meant: "100"
#     values: {T1.water.boils: "100"}
#     proof: boiling
# with erratum: boiling in the entry of facts.yaml.
"""
ASSUMPTIONS = """\
# What the paper leaves open, and what you took. A fact for whose sake it was chosen names it under chosen.
# For instance:
#   pressure: {open: pressure of the air, value: 101325, unit: Pa, basis: usual, alternatives: {}}
"""


def write_start(folder: Path, tables: Sequence[Path]) -> Iterator[str]:
    """Write a folder to start from, and yield what to do next; `PaperError` if there is one already."""
    if (folder / "claims.yaml").exists():
        raise PaperError(f"{folder / 'claims.yaml'}: already exists; nothing was written")
    named = _numbered(tables)
    for file in tables:
        for cell in cells_of(file):
            check_number(cell["printed"], f"{cell.place}: {cell['column']}", numbers_only=False)
    published = folder / "published"
    reproduced = folder / "reproduced"
    published.mkdir(parents=True, exist_ok=True)
    reproduced.mkdir(exist_ok=True)
    if tables:
        for name, file in named.items():
            shutil.copyfile(file, published / name)
            (reproduced / name).write_text(_emptied(file), encoding="utf-8")
    else:
        named = dict.fromkeys(EXAMPLE, Path())
        for name, text in EXAMPLE.items():
            (published / name).write_text(text, encoding="utf-8")
            (reproduced / name).write_text(EXAMPLE_REPRODUCED, encoding="utf-8")
    numbers = [re.sub(r"\D", "", name) for name in named]
    texts = {
        "paper.yaml": PAPER.format(title=folder.resolve().name),
        "claims.yaml": CLAIMS.format(rules="".join(RULE.format(number=number) for number in numbers)),
        "facts.yaml": FACTS.format(facts="".join(FACT.format(number=number) for number in numbers)),
        "errata.yaml": ERRATA,
        "assumptions.yaml": ASSUMPTIONS,
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    yield f"{folder}: written, with {'your tables' if tables else 'an example'}"
    if tables:
        yield f"Next: tolerances in {folder / 'claims.yaml'}, then the numbers of your run in {reproduced}"
    yield f"Then: paper-verdict check {folder}"


def _numbered(tables: Sequence[Path]) -> dict[str, Path]:
    """Files by their name in ``published``: that of their number, or of their place."""
    named: dict[str, Path] = {}
    for place, file in enumerate(tables, 1):
        match = re.search(r"(\d+)$", file.stem)
        name = f"table{match[1] if match else place}.csv"
        if name in named:
            raise PaperError(f"{file}: is Table {name[5:-4]}, and so is {named[name]}; rename one")
        named[name] = file
    return named


def _emptied(file: Path) -> str:
    """A printed table with empty cells, to be filled with reproduced numbers."""
    head, *rows = file.read_text(encoding="utf-8-sig").splitlines()
    names = head.split(",")
    if {"row", "column", "printed"} <= set(names):
        cells = cells_of(file)
        return "\n".join(["row,column,value", *(f"{cell['row']},{cell['column']}," for cell in cells), ""])
    kept = [row.split(",")[0] for row in rows if row.strip()]
    return "\n".join([head, *(f"{label}{',' * (len(names) - 1)}" for label in kept), ""])
