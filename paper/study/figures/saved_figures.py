"""Figures 7 to 11 and the time traces of a folder of results, drawn and saved."""

from pathlib import Path

from paper.study.figures import paper_figures, traces_figure
from paper.study.labels import STUDY_SAMPLING, shown
from paper.study.paper_2006.printed_tables import table7, table9, traces_of_fig_7, with_percentiles
from paper.study.stored_runs import read_study
from pneumo.publish.style import save
from pneumo.storage.files import read


def save_figures(results: Path) -> None:
    """Draw the figures of a study's `results` into the folder ``figures`` there, each as SVG and PNG."""
    study = read_study(results / "parameters.json")
    settling, datum = (f"{shown(figure, study.experiments)}.nc" for figure in ("fig07", "traces"))
    averages = {name: read(results / name / "statistics.nc") for name in STUDY_SAMPLING}
    replays = {name: read(results / name / "replay" / datum) for name in STUDY_SAMPLING}
    printed = traces_of_fig_7() if settling == "E14.nc" else {}
    figures = {
        "fig07": paper_figures.fig07(read(results / "settling" / settling), printed),
        "fig08": paper_figures.fig08(averages, table7()),
        "fig09": paper_figures.fig09(averages, with_percentiles(table7(), 9)),
        "fig10": paper_figures.fig10(averages, with_percentiles(table7(), 10)),
        "fig11": paper_figures.fig11(averages, with_percentiles(table9(), 11)),
        "traces": traces_figure.time_traces(read(results / "datum" / datum), replays, averages),
    }
    for name, figure in figures.items():
        save(figure, results / "figures" / name)
