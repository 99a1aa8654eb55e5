"""Templates of all pages and their filters."""

import re
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from pneumo.publish.text.formatting import percent_text

TEMPLATES = Path(__file__).parent / "templates"
LIVE_PAGE = Path(__file__).parent / "live.html"  # made by `make live`


def page_text(template: str, *folders: Path, **content: Any) -> str:
    """Fill a template of `TEMPLATES` or `folders`; inserted text is escaped, a missing name an error."""
    lines: dict[str, Any] = {"trim_blocks": True, "lstrip_blocks": True, "keep_trailing_newline": True}
    loader = FileSystemLoader([TEMPLATES, *folders])
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, **lines)
    environment.filters.update({"math": with_indices, "percent": percent_text})
    return environment.get_template(template).render(**content)


def with_indices(text: str) -> Markup:
    """Escape a text; set indices, as in k_0, as subscripts, and names in backticks as code."""
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text)))
    return Markup(re.sub(r"\b([A-Za-z]|λ)_([A-Za-z0-9]+)\b", r"\1<sub>\2</sub>", text))
