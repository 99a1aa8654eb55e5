"""What all pages share: templates and their filters, figures inside a page, the look of a status."""

import base64
import io
import re
from pathlib import Path
from typing import Any, Literal

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from pneumo.publish.style import METADATA, paper_style
from pneumo.publish.text.formatting import percent_text
from pneumo.verdict.claims import UNITS_IN_TEXT

TEMPLATES = Path(__file__).parent / "templates"

STATUS_LOOKS = {  # status -> symbol, which tells it without colour, and what it means
    "exact": ("=", "equal at the printed digits, or true as stated"),
    "close": ("≈", "inside the tolerance class that was set before the results"),
    "explained": (
        "†",
        "differs; one named erratum, or one alternative assumption for the whole study, accounts for it",
    ),
    "contradicted": ("≠", "false: the paper's own formulas or tables refute it as well"),
    "missed": ("!", "differs, and nothing explains it"),
    "unreadable": ("?", "the scan does not show it"),
}


def page_text(template: str, **content: Any) -> str:
    """Fill a template of `TEMPLATES`; whatever is put in is escaped, and a missing name is an error."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    unit = {"unit": lambda unit: UNITS_IN_TEXT.get(unit, unit)}
    environment.filters |= {"math": with_indices, "percent": percent_text} | unit
    return environment.get_template(template).render(**content)


def with_indices(text: str) -> Markup:
    """Escape a text and set its indices, such as that of k_0, low."""
    return Markup(re.sub(r"\b([A-Za-z]|λ)_([A-Za-z0-9]+)", r"\1<sub>\2</sub>", str(escape(text))))


def image_address(fig: Figure, kind: Literal["svg", "png"] = "svg") -> str:
    """Return a figure as a data address, for the source of an image."""
    buffer = io.BytesIO()
    with paper_style():
        fig.savefig(buffer, format=kind, metadata=METADATA[kind])
    return (
        f"data:image/{kind.replace('svg', 'svg+xml')};base64,{base64.b64encode(buffer.getvalue()).decode()}"
    )
