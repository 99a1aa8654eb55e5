"""What all pages share: templates and their filters, and the look of a status."""

import math
import re
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from pneumo.publish.text.formatting import percent_text
from pneumo.verdict.claims import UNITS_IN_TEXT

TEMPLATES = Path(__file__).parent / "templates"

STATUS_LOOKS = {  # status -> symbol, which tells it without colour, and what it means
    "exact": ("=", "equal at the printed digits, or true as stated"),
    "close": ("≈", "inside its tolerance class"),
    "explained": (
        "†",
        "differs; one named erratum, or one alternative assumption for the whole study, accounts for it",
    ),
    "contradicted": ("≠", "false: the paper's own formulas or tables refute it as well"),
    "missed": ("!", "differs, and nothing explains it"),
}


def page_text(template: str, folder: Path | None = None, **content: Any) -> str:
    """Fill a template of `TEMPLATES`; whatever is put in is escaped, and a missing name is an error.

    A template may include others of a `folder`.
    """
    lines: dict[str, Any] = {"trim_blocks": True, "lstrip_blocks": True, "keep_trailing_newline": True}
    loader = FileSystemLoader([TEMPLATES, folder] if folder else TEMPLATES)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, **lines)
    filters: dict[str, Any] = {"math": with_indices, "percent": percent_text, "on_log_axis": share_of_axis}
    filters["unit"] = lambda unit: UNITS_IN_TEXT.get(unit, unit)
    environment.filters.update(filters)
    return environment.get_template(template).render(**content)


def share_of_axis(value: float, lowest: float, highest: float) -> float:
    """Where a value stands on a logarithmic axis: 0 at its lowest, 1 at its highest value, and not beyond."""
    return min(max(math.log(value / lowest) / math.log(highest / lowest), 0.0), 1.0)


def with_indices(text: str) -> Markup:
    """Escape a text and set its indices, such as that of k_0, low."""
    return Markup(re.sub(r"\b([A-Za-z]|λ)_([A-Za-z0-9]+)", r"\1<sub>\2</sub>", str(escape(text))))
