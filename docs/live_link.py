"""The pages of a cylinder in the browser, and their links on the front page."""

from pathlib import Path

from fragments import ROOT

from pneumo.configuration.parameters import load, study
from pneumo.export.live import installed, live_page, typical_plants
from pneumo.publish.model_looks import colours
from pneumo.selection.browser_study import browser_study

N = 1.35
LINKS = {"": "Move the cylinder", "#record": "drop a record of your own"}  # place on the page -> text


def live(folder: Path) -> str:
    """Links to both pages, which are written into a folder; how to make one where clang is not installed."""
    if not installed():
        return "`snakemake -j2 live` writes this page, `results/live.html`; it needs clang and lld."
    study_of_2006 = study(load(ROOT / "config/paper.yaml"))
    page = live_page(typical_plants(study_of_2006), N, ROOT / "docs/live", colours())
    (folder / "live.html").write_text(page, encoding="utf-8")
    (folder / "your-cylinder.html").write_text(browser_study(ROOT / "docs/live"), encoding="utf-8")
    move, drop = (f'<a href="live.html{place}">{text}</a>' for place, text in LINKS.items())
    return (
        f"{move}, or {drop}: all models and the full order are replayed on it in the browser,"
        ' nothing is uploaded. <a href="your-cylinder.html">Rank the models on your own cylinder</a>:'
        " `pneumo study` without an installation."
    )
