"""Judging a paper: claims, published tables, errata, assumptions, comparison with what was reproduced."""

from pathlib import Path

from pneumo.errors import PneumoError


class PaperError(PneumoError, ValueError):
    """A file of the paper that is missing, has an unknown key, a name twice, or a name of nothing."""


def paper_file(folder: Path, name: str) -> Path:
    """Path of a file in a paper's folder; `PaperError` if there is none."""
    if not (folder / name).is_file():
        raise PaperError(f"{folder / name}: no such file; it stands beside the package in a source checkout")
    return folder / name
