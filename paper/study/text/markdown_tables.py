"""Tables as Markdown."""

from collections.abc import Iterable
from typing import Any


def markdown_table(heads: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Table of cells that are Markdown already; no newline at its end."""
    head, *cells = (f"| {' | '.join(map(str, row))} |" for row in (heads, *rows))
    return "\n".join([head, "| --- " * (head.count(" | ") + 1) + "|", *cells])
