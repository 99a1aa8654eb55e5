"""Parts of pages that are made from the code: tables, errata, commands; and stored numbers."""

import re
from pathlib import Path
from typing import Any

import yaml
from typer.cli import get_docs_for_click
from typer.core import TyperGroup
from typer.main import get_command

from paper.study.paper_2006.paper import PAPER_2006
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.text.markdown_tables import markdown_table as table
from paper_verdict.errata import Erratum, read_errata
from pneumo.cli.commands import app
from pneumo.fitting.record.formats import FORMATS
from pneumo.physics.models import MODELS, Model
from pneumo.physics.symbols import SYMBOLS
from pneumo.quantities.table import PARAMETERS, STARTS, STARTS_OF_ONE, VALVE_CURVE

ROOT = Path(__file__).parents[1]
NUMBERS = Path(__file__).with_name("numbers.yaml")


def plain(text: Any) -> str:
    """Text with every sign of Markdown escaped."""
    return re.sub(r"([\\`*_\[\]<>|$#{}])", r"\\\1", str(text))


def stored_numbers() -> dict[str, dict[str, Any]]:
    """Numbers and tables by page or source, then by name."""
    return yaml.safe_load(NUMBERS.read_text(encoding="utf-8"))


def errata() -> dict[str, str]:
    """A box for every entry of paper/2006/errata.yaml, by name, with the outcome of its proof."""
    every = read_errata(PAPER_2006.folder, PAPER_2006.proofs)
    return {name: _box(erratum) for name, erratum in every.items()}


def _box(erratum: Erratum) -> str:
    return f"""\
:::{{admonition}} {erratum.kind.capitalize()}: {plain(erratum.where)}
:class: warning
:name: erratum-{erratum.id}

Printed: {plain(erratum.printed)}

Meant: {plain(erratum.meant)}

Proof {"holds" if erratum.passes else "FAILS"}: {plain(erratum.evidence)}
:::"""


def shown(cell: object) -> str:
    """A cell of the table of models with its symbols as formulas."""
    symbols = {"n": "$n$", "gamma": r"$\gamma$", "True": "yes", "False": "no", "k_0": "$k_0$"}
    symbols |= {"lambda_0 A_q": r"$\lambda_0 A_q(x)$", "lambda A_q": r"$\lambda(P, T) A_q(x)$"}
    return (symbols | {"lambda_0": r"$\lambda_0$"}).get(str(cell), str(cell))


def models() -> str:
    """The table of models, from the rows that everything runs on."""
    rows = ([shown(cell) for cell in model] for model in MODELS.values())
    return table([f"`{field}`" for field in Model._fields], rows)


def ten_models() -> str:
    """Table of the paper's models in words."""
    head = ["model", "temperature of the air", "air enters at", "heat through the wall", "parameters"]
    return table(head, map(_model_row, PAPER_MODELS.values()))


def _model_row(model: Model) -> list[str]:
    explicit = model.wall != "none"
    indices = list(dict.fromkeys(str(i).removesuffix(".0") for i in (model.n_V, model.n_in, model.n_out)))
    known = ["n"] * model.has_n + (["k_0" if model.wall == "k_0" else "lambda_0"] if explicit else [])
    which = "indices of volume, inflow, outflow" if indices[1:] else "index"
    by_index = f"by the {which}: {', '.join(map(shown, indices))}"
    return [
        model.name,
        {"constant": "constant", "polytropic": "follows the pressure"}[model.temperature],
        "its own temperature" if model.mixing else "the chamber's temperature",
        shown(model.wall) if explicit else by_index,
        ", ".join(map(shown, known)),
    ]


def fitted_parameters() -> str:
    """The parameters of a fit, from the rows that everything uses."""
    rows = []
    for name, row in PARAMETERS.items():
        if name in STARTS and name not in STARTS_OF_ONE:
            continue
        unit = f"times `{row.times}`" if row.times else row.unit
        if row.times == "A_q0":
            unit = f"W/(m² K) {unit}, the wall's area in mid-stroke"
        bounds = f"{row.low:g} to {row.high:g} {unit}".removesuffix(" 1")
        also = {"configured": "within its uncertainty; freely ", "cause": "", "curve": ""}.get(row.group)
        choice = VALVE_CURVE if row.group == "curve" else name
        fitted = "" if also is None else f"{also}with `--also {choice}`"
        rows.append([f"`{name}`", row.name, bounds, fitted, f"`{row.key}`" if row.key else ""])
    return table(["parameter", "meaning", "searched", "fitted", "key of `fitted.yaml`"], rows)


def record_formats() -> str:
    """The formats of a record."""
    rows = [[form.name, ", ".join(form.suffixes) or "other", form.remark] for form in FORMATS]
    return table(["format", "file ending", "remark"], rows)


def symbols() -> str:
    """The notation of what is stored and drawn."""
    rows = (
        [f"`{name}`", f"${s.latex}$", s.unit.replace("-1", "⁻¹").replace("2", "²"), s.long_name]
        for name, s in SYMBOLS.items()
    )
    return table(["name", "symbol", "unit", "meaning"], rows)


def commands() -> str:
    """Reference of the command line, by typer."""
    group = get_command(app)
    assert isinstance(group, TyperGroup)
    text = get_docs_for_click(obj=group, ctx=group.context_class(group, info_name="pneumo"), name="pneumo")
    return re.sub(r"<(\w[\w\[\]]*)>", r"(\1)", text.partition("## ")[2].join(["## ", ""]))
