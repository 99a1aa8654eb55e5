"""Judge a paper: every printed number and statement against a reproduction, fact by fact.

`load_paper` reads a paper's folder, `verdict` judges it, `page` writes the verdict as HTML. The command
``paper-verdict`` does the same.
"""

from importlib.metadata import PackageNotFoundError, version

from paper_verdict.errors import PaperError
from paper_verdict.facts import headline_text
from paper_verdict.files import half_unit, read_cells
from paper_verdict.findings import Finding, MissingEvidence
from paper_verdict.judging import Judge, Paper, verdict
from paper_verdict.loading import load_paper
from paper_verdict.page import page

__all__ = [
    "Finding",
    "Judge",
    "MissingEvidence",
    "Paper",
    "PaperError",
    "half_unit",
    "headline_text",
    "load_paper",
    "page",
    "read_cells",
    "verdict",
]

try:
    __version__ = version("paper-verdict")
except PackageNotFoundError:  # a checkout that is not installed
    __version__ = "0"
