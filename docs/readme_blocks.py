"""Generated blocks: `judged` of README.md, the others of pages.

`make numbers` writes README's, `make lint` checks that they are current.
"""

from fragments import stored_numbers, table

from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.physics.models import Model

NUMBERS = stored_numbers()


def _model_row(model: Model) -> list[str]:
    explicit = model.wall != "none"
    indices = list(dict.fromkeys(str(i).removesuffix(".0") for i in (model.n_V, model.n_in, model.n_out)))
    known = ["n"] * model.has_n + (["k_0" if model.wall == "k_0" else "lambda_0"] if explicit else [])
    return [
        model.name,
        {"constant": "constant", "polytropic": "follows the pressure"}[model.temperature],
        "its own temperature" if model.mixing else "the chamber's temperature",
        model.wall if explicit else f"by the {'indices' if indices[1:] else 'index'}: {', '.join(indices)}",
        ", ".join(known),
    ]


def ten_models() -> str:
    """Table of the paper's models in words."""
    head = ["model", "temperature of the air", "air enters at", "heat through the wall", "parameters"]
    return table(head, map(_model_row, PAPER_MODELS.values()))


def judged() -> str:
    """How many facts of both papers agree."""
    return f"""\
{verdict()}
The authors' paper of 2007: {NUMBERS["verdict"]["second"]}"""


def table_7() -> str:
    """Table 7 as printed and as reproduced."""
    return NUMBERS["table_7"]["table"]


def verdict() -> str:
    """Headline of the verdict on the paper of 2006."""
    return NUMBERS["verdict"]["headline"]


OF_PAGES = (ten_models, table_7, verdict)
