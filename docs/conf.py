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

import fragments
import notebooks

# A folder like a checkout, in which notebooks run; removed when the build ends.
_examples = tempfile.TemporaryDirectory()
examples = Path(_examples.name)
os.environ |= notebooks.prepare(examples)

project = "pneumo"
author = "pneumo developers"
version = release = version_of("pneumo")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["static", "decisions/README.md"]

myst_enable_extensions = ["colon_fence", "dollarmath", "substitution"]
myst_heading_anchors = 3
myst_substitutions = {
    "decisions": fragments.decisions(),
    **fragments.stored_numbers(),
    "errata": fragments.errata(),
    "models": fragments.models(),
    "symbols": fragments.symbols(),
    "fitted_parameters": fragments.fitted_parameters(),
    "record_formats": fragments.record_formats(),
    "rig_quantities": fragments.rig_quantities(),
    "files": fragments.files(examples / notebooks.SMALL),
    "results": notebooks.kind_of_results(),
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
    self.body.append(self.starttag(node, "div", CLASS="formula"))
    self.body.append(f"<span>{mathml(node, as_block=True)}</span>")
    if node["number"]:
        self.body.append(f'<span class="eqno">({get_node_equation_number(self, node)})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Draw formulas as MathML: no script, no font, no other package."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (formula, None))


html_math_renderer = "mathml"
