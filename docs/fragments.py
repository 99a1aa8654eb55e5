"""Parts of pages: numbers and tables of results, errata, models, files of results, commands."""

import re
from pathlib import Path
from typing import Any

import xarray as xr
import yaml
from typer.cli import get_docs_for_click
from typer.core import TyperGroup
from typer.main import get_command

from paper.study.paper_2006.paper import PAPER_2006
from paper.study.text.markdown_tables import markdown_table as table
from pneumo.cli.commands import app
from pneumo.fit.fitted_parameters import PARAMETERS, STARTS, STARTS_OF_ONE
from pneumo.fit.record.formats import FORMATS
from pneumo.fit.rig.rig_file import QUANTITIES, TEXTS, key
from pneumo.physics.models import MODELS, Model
from pneumo.physics.symbols import SYMBOLS
from pneumo.verdict.errata import Erratum, read_errata

ROOT = Path(__file__).parents[1]
NUMBERS = Path(__file__).with_name("numbers.yaml")
KINDS = {  # file of results -> what its kind is called
    "datum/E06.nc": "datum/E01.nc ...",
    "settling/E06.nc": "settling/E01.nc ...",
    "settling.nc": "settling.nc",
    "exact/replay/E06.nc": "TRANSPORT/replay/E01.nc ...",
    "exact/statistics.nc": "TRANSPORT/statistics.nc",
}


def plain(text: Any) -> str:
    """Text with every sign of Markdown escaped."""
    return re.sub(r"([\\`*_\[\]<>|$#{}])", r"\\\1", str(text))


def span(values: xr.DataArray, digits: int | str) -> str:
    """Lowest and highest value, with so many digits or in another format."""
    form = digits if isinstance(digits, str) else f".{digits}f"
    return f"{values.min().item():{form}} to {values.max().item():{form}}"


def stored_numbers(file: str = NUMBERS.name) -> dict[str, dict[str, Any]]:
    """Numbers and tables by page and name: of results, or, in frozen.yaml, of finished studies."""
    return yaml.safe_load(NUMBERS.with_name(file).read_text(encoding="utf-8"))


def errata() -> dict[str, str]:
    """A box for every entry of paper/2006/errata.yaml, by name, with the outcome of its proof."""
    return {
        name: _box(erratum) for name, erratum in read_errata(PAPER_2006.folder, PAPER_2006.proofs).items()
    }


def _box(erratum: Erratum) -> str:
    return f"""\
:::{{admonition}} {erratum.kind.capitalize()}: {plain(erratum.where)}
:class: warning
:name: erratum-{erratum.id}

Printed: {plain(erratum.printed)}

Meant: {plain(erratum.meant)}

Proof {"holds" if erratum.passes else "FAILS"}: {plain(erratum.evidence)}
:::"""


def models() -> str:
    """The table of models, from the rows that everything runs on."""
    shown = {"n": "$n$", "gamma": r"$\gamma$", "True": "yes", "False": "no", "k_0": "$k_0$"}
    shown |= {"lambda_0 A_q": r"$\lambda_0 A_q(x)$", "lambda A_q": r"$\lambda(P, T) A_q(x)$"}
    rows = ([shown.get(str(cell), str(cell)) for cell in model] for model in MODELS.values())
    return table([f"`{field}`" for field in Model._fields], rows)


def fitted_parameters() -> str:
    """The parameters of a fit, from the rows that everything uses."""
    rows = []
    for name, row in PARAMETERS.items():
        if name in STARTS and name not in STARTS_OF_ONE:
            continue
        unit = f"times `{row.search.times}`" if row.search.times else row.quantity.unit
        if row.search.times == "A_q0":
            unit = f"W/(m² K) {unit}, the wall's area in mid-stroke"
        bounds = f"{row.search.low:g} to {row.search.high:g} {unit}".removesuffix(" 1")
        also = {"configured": "within `accuracy`; freely ", "cause": ""}.get(row.group)
        fitted = "" if also is None else f"{also}with `--also {name}`"
        rows.append([f"`{name}`", row.quantity.name, bounds, fitted, f"`{row.key}`" if row.key else ""])
    return table(["parameter", "meaning", "searched", "fitted", "key of `fitted.yaml`"], rows)


def record_formats() -> str:
    """The formats of a record: those that are read, and what to do with the others."""
    rows = [
        [form.name, ", ".join(form.suffixes) or "other", "read" if form.read else "not read", form.remark]
        for form in FORMATS
    ]
    return table(["format", "file ending", "", ""], rows)


def rig_quantities() -> str:
    """What a rig's file may hold, from the rows that everything uses."""
    texts = [[f"`{name}`", " or ".join(choices), choices[0], ""] for name, choices in TEXTS.items()]
    rows = [
        [
            f"`{key(name)}`",
            f"{q.low:g} to {q.high:g}",
            "" if q.default is None else f"{q.default:g}",
            q.meaning,
        ]
        for name, q in QUANTITIES.items()
    ]
    return table(["key", "allowed", "default", "meaning"], [*texts, *rows])


def symbols() -> str:
    """The notation of what is stored and drawn."""
    rows = ([f"`{name}`", f"${s.latex}$", s.unit, s.long_name] for name, s in SYMBOLS.items())
    return table(["name", "symbol", "unit", "meaning"], rows)


def files(results: Path) -> str:
    """Variables, dimensions and units of each kind of file in a folder of results."""
    sections = []
    for file, kind in KINDS.items():
        rows = []
        with xr.open_dataset(results / file) as dataset:
            for name, variable in dataset.variables.items():
                dimensions = ", ".join(f"`{dimension}`" for dimension in variable.dims) or "none"
                meaning = variable.attrs.get("long_name", variable.attrs.get("comment", ""))
                rows.append([f"`{name}`", dimensions, variable.attrs.get("units", ""), plain(meaning)])
        sections.append(f"## `{kind}`\n\n" + table(["variable", "dimensions", "unit", "meaning"], rows))
    return "\n\n".join(sections)


def commands() -> str:
    """Reference of the command line, by typer."""
    group = get_command(app)
    assert isinstance(group, TyperGroup)
    text = get_docs_for_click(obj=group, ctx=group.context_class(group, info_name="pneumo"), name="pneumo")
    return re.sub(r"<(\w[\w\[\]]*)>", r"(\1)", text.partition("## ")[2].join(["## ", ""]))
