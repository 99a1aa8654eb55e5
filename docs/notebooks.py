"""The notebooks among the pages: the folder like a checkout in which they run, and files to download."""

import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nbformat
from jinja2 import Template
from myst_nb.core.read import read_myst_markdown_notebook
from small_study import EXPERIMENTS, ROOT, small_study

SHOWN = ("replay.c",)  # files beside the pages, which they use
RESULTS = ROOT / "results"
DOCS = Path(__file__).parent
HEAD = "---\nfile_format: mystnb\n"
NEEDS = (
    "*A page of pneumo's documentation. It needs pneumo and a shell; where it reads `results/`, run it in a"
    " checkout after `make reproduce`.*"
)
ROLE = re.compile(r"\{[\w:]+\}`([^`<]+?)(?: <([^`>]+)>)?`")  # a link of Sphinx: its text or its target
TITLE = re.compile(r"(?:---\n(?:.*\n)*?---\n)?# (.*)\n")
SHOWN_FILE = re.compile(r"```\{literalinclude\} (\S+)\n(?::.*\n)*```")

# Read by IPython at a notebook's start. A command that fails ends its cell; none takes it for a terminal.
PROFILE = """
c.IPKernelApp.log_level = 40
c.ScriptMagics.script_magics = ["sh"]
c.ScriptMagics.script_paths = {{"sh": "sh -e"}}
c.InlineBackend.figure_formats = {{"svg"}}
c.InlineBackend.rc = {{"figure.figsize": (7, 3.2), "figure.constrained_layout.use": True}}
c.InteractiveShellApp.exec_lines = ["%cd -q {folder}", "__import__('os').environ.pop('FORCE_COLOR', None);"]
"""


def whole_study() -> bool:
    """Whether the checkout's own results are there to be shown."""
    return (RESULTS / "verdict.json").exists()


def kind_of_results() -> str:
    """Sentences of pages about the results that they show."""
    if whole_study():
        return "This page was built with the results of the whole study."
    names = " and ".join(EXPERIMENTS)
    return f"This page was built without results of the whole study: what it shows is one second of {names}."


def prepare(folder: Path) -> dict[str, str]:
    """Fill a folder for the notebooks.

    Parameters
    ----------
    folder : pathlib.Path
        Empty. It gets links to the checkout's inputs and `results`: the whole study's where that was made,
        else those of a small study.

    Returns
    -------
    dict
        Variables of the environment with which notebooks start there.
    """
    for name in ("config", "paper", "pneumo"):
        (folder / name).symlink_to(ROOT / name)
    for name in SHOWN:
        (folder / name).symlink_to(DOCS / name)
    if whole_study():
        (folder / "results").symlink_to(RESULTS)
    else:
        small_study(folder / "results", folder / "small.yaml")
    profile = folder / "ipython/profile_default/ipython_kernel_config.py"
    profile.parent.mkdir(parents=True)
    profile.write_text(PROFILE.format(folder=folder), encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    # Notebooks run side by side: idle threads of linear algebra would wait by computing.
    return {"IPYTHONDIR": str(folder / "ipython"), "PATH": path, "OPENBLAS_NUM_THREADS": "1"}


def pages() -> list[str]:
    """Names of the pages that are notebooks."""
    return [page.stem for page in sorted(DOCS.glob("*.md")) if page.read_text("utf-8").startswith(HEAD)]


def _plain_link(match: re.Match[str]) -> str:
    """Write a link of Sphinx without it: its text, a page's title, or a name of the code."""
    text, page = match[1], DOCS / f"{match[1]}.md"
    if match[2]:
        return text
    title = TITLE.match(page.read_text("utf-8")) if page.is_file() else None
    return f"*{title[1]}*" if title else f"`{text}`"


def _file_cell(match: re.Match[str]) -> str:
    """Write a file that the page shows by a cell, so that the notebook needs no other file."""
    text = (DOCS / match[1]).read_text("utf-8")
    return f"```{{code-cell}}\n%%writefile {match[1]}\n{text}```"


def as_notebook(page: str, substitutions: Mapping[str, Any]) -> nbformat.NotebookNode:
    """Return a page as a Jupyter notebook without outputs, in plain Markdown."""
    text = SHOWN_FILE.sub(_file_cell, (DOCS / f"{page}.md").read_text("utf-8"))
    notebook = read_myst_markdown_notebook(text)
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            cell.source = ROLE.sub(_plain_link, Template(cell.source).render(substitutions))
            cell.source = re.sub(r"^```\{code-block\} ", "```", cell.source, flags=re.MULTILINE)
    notebook.cells[0].source = notebook.cells[0].source.replace("\n\n", f"\n\n{NEEDS}\n\n", 1)
    for number, cell in enumerate(notebook.cells):
        cell.id = f"{page}-{number}"  # the same at every build
    return notebook


def write_notebooks(folder: Path, substitutions: Mapping[str, Any]) -> None:
    """Write every page that is a notebook into a folder, for readers to download."""
    folder.mkdir(parents=True)
    for page in pages():
        nbformat.write(as_notebook(page, substitutions), folder / f"{page}.ipynb")


def with_link(page: str, text: str) -> str:
    """Put a link to the page's notebook below its title."""
    link = f'<a class="notebook" href="notebooks/{page}.ipynb" download>Download this page as a notebook</a>'
    return re.sub(r"^(# .*)$", rf"\1\n\n{link}", text, count=1, flags=re.MULTILINE)
