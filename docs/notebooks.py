"""Where the notebooks among the pages run: a folder like a checkout, with the whole study or a small one."""

import os
import sys
from pathlib import Path

from small_study import EXPERIMENTS, ROOT, small_study

SMALL = "small"  # folder of the small study's results
RESULTS = ROOT / "results"

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
        Empty. It gets links to the checkout's inputs, a small study, and `results`: the whole study's where
        that was made, else the small one's.

    Returns
    -------
    dict
        Variables of the environment with which notebooks start there.
    """
    for name in ("config", "paper", "pneumo"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "replay.c").symlink_to(ROOT / "docs/replay.c")
    small_study(folder / SMALL, folder / "small.yaml")
    (folder / "results").symlink_to(RESULTS if whole_study() else folder / SMALL)
    profile = folder / "ipython/profile_default/ipython_kernel_config.py"
    profile.parent.mkdir(parents=True)
    profile.write_text(PROFILE.format(folder=folder), encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return {"IPYTHONDIR": str(folder / "ipython"), "PATH": path}
