"""Sphinx: `make docs` builds the site into site/; neither building nor reading it needs the network."""

import os
import sys
import tempfile
from importlib.metadata import version as version_of
from logging import getLogger
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from nbclient import NotebookClient
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(1, str(Path(__file__).parents[1]))  # paper/study

import fragments

# Read by IPython at a notebook's start. A command that fails ends its cell; none takes it for a terminal.
PROFILE = """
c.IPKernelApp.log_level = 40
c.ScriptMagics.script_magics = ["sh"]
c.ScriptMagics.script_paths = {{"sh": "sh -e"}}
c.InlineBackend.figure_formats = {{"svg"}}
c.InlineBackend.rc = {{"figure.figsize": (7, 3.2), "figure.constrained_layout.use": True}}
c.InteractiveShellApp.exec_lines = ["%cd -q {folder}", "__import__('os').environ.pop('FORCE_COLOR', None);"]
"""

# The folder in which notebooks run; removed when the build ends.
_examples = tempfile.TemporaryDirectory()
examples = Path(_examples.name)
profile = examples / "ipython/profile_default/ipython_kernel_config.py"
profile.parent.mkdir(parents=True)
profile.write_text(PROFILE.format(folder=examples), encoding="utf-8")
os.environ["IPYTHONDIR"] = str(examples / "ipython")
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
os.environ["PYTHONPATH"] = str(Path(__file__).parents[1])  # for `paper`, which is not installed
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # notebooks run side by side: idle threads would wait by computing

project = "pneumo"
author = "pneumo developers"
version = release = version_of("pneumo")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["static"]

myst_enable_extensions = ["colon_fence", "dollarmath", "substitution"]
myst_heading_anchors = 3
myst_substitutions = {
    **fragments.stored_numbers(),
    "errata": fragments.errata(),
    "models": fragments.models(),
    "ten_models": fragments.ten_models(),
    "symbols": fragments.symbols(),
    "fitted_parameters": fragments.fitted_parameters(),
    "record_formats": fragments.record_formats(),
    "commands": fragments.commands(),
}

nb_execution_mode = "inline"
nb_execution_show_tb = True
nb_output_stderr = "remove"  # bars of progress
nb_execution_timeout = 600  # s, of a cell, on a busy machine
NotebookClient.coalesce_streams.default_value = True  # `nb_merge_streams` breaks lines
getLogger("traitlets").setLevel("WARNING")

autodoc_typehints = "none"  # docstrings say what a type means
autodoc_member_order = "bysource"
default_role = "literal"  # of `names` in docstrings
napoleon_google_docstring = False
napoleon_use_param = napoleon_use_rtype = False  # types are plain words, not references
napoleon_custom_sections = [("Attributes", "params_style")]  # several names may share a line
nitpick_ignore_regex = [(r"py:.*", r"(?!pneumo\.).*")]  # Python's own and other packages' names

html_theme = "furo"
html_title = "pneumo"
html_static_path = ["static"]
html_extra_path = ["../pneumo/publish/pages/live.html"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = html_show_copyright = False


def mathml(node: nodes.Element, as_block: bool) -> str:
    """Formula as MathML, which browsers draw by themselves."""
    try:
        return tex2mathml(node.astext(), as_block=as_block)
    except MathError as error:
        logging.getLogger(__name__).warning(str(error), location=node)
        return ""


def inline_formula(self: Any, node: nodes.math) -> None:
    """Write a formula within a line."""
    self.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def formula(self: Any, node: nodes.math_block) -> None:
    """Write a formula on a line of its own, with the equation's number."""
    self.body.append('<div class="formula">')  # the theme's wrapper has the equation's identifier
    self.body.append(f'<span tabindex="0">{mathml(node, as_block=True)}</span>')
    if node["number"]:
        self.body.append(f'<span class="eqno">({get_node_equation_number(self, node)})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append("</div>\n")
    raise nodes.SkipNode


# Commands lose the first line of their cell, which only Jupyter needs. The rest is what axe asks for and the
# theme lacks: level of headings, names of landmarks, scrolling by keyboard.
REPLACED = {
    '<span class="o">%%</span><span class="k">sh</span>\n': "",
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="Pages">',
    '<aside class="toc-drawer': '<aside aria-label="Contents" class="toc-drawer',
    "<pre>": '<pre tabindex="0">',
    '<div class="table-wrapper': '<div tabindex="0" class="table-wrapper',
    '<div class="output text_html': '<div tabindex="0" class="output text_html',
    '<div id="search-results"></div>': '<h1>Search</h1>\n<div id="search-results"></div>',
}


def complete_pages(app: Sphinx, exception: Exception | None) -> None:
    """Complete the finished pages; a page that was not written again stays as it is."""
    for page in [] if exception else app.outdir.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        for old, new in REPLACED.items():
            text = text.replace(old, new)
        page.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Draw formulas as MathML: no script, no font, no other package."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (formula, None))
    app.connect("build-finished", complete_pages)


html_math_renderer = "mathml"
