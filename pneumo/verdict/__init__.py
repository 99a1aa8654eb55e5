"""Judging a paper: claims, published tables, errata, assumptions, comparison with what was reproduced."""

from pathlib import Path

from pneumo.errors import PneumoError


class PaperError(PneumoError, ValueError):
    """A file of the paper is missing, or has an unknown key, a repeated or an unknown name."""


def paper_file(folder: Path, name: str) -> Path:
    """Path of a file in a paper's folder; `PaperError` if there is none."""
    if not (folder / name).is_file():
        raise PaperError(f"{folder / name}: no such file; a source checkout has it beside the package")
    return folder / name
