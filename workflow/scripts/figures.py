"""Draw Figures 7 to 11, the time traces and the error over n; write Table 7."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.papers.paper_2006.printed_tables import table7, table9, traces_of_fig_7, with_percentiles
from pneumo.publish.figures import paper_figures, traces_figure
from pneumo.publish.style import save
from pneumo.publish.text.markdown_tables import table_7
from pneumo.storage.files import open_grid, read, read_study, write_text


def main(parameters: Path, settling: Path, datum: Path, statistics: list[Path], table: Path) -> None:
    study, folder = read_study(parameters), table.with_name("figures")
    transports = {file.parent.name: file.parent for file in statistics}
    averages = {name: read(path / "statistics.nc") for name, path in transports.items()}
    replays = {name: read(path / "replay" / datum.name) for name, path in transports.items()}
    grids = {name: open_grid(path).sel(experiment=[*study.experiments]) for name, path in transports.items()}
    printed = traces_of_fig_7() if settling.stem == "E14" else {}
    save(paper_figures.fig07(read(settling), printed), folder / "fig07")
    save(paper_figures.fig08(averages, table7()), folder / "fig08")
    save(paper_figures.fig09(averages, with_percentiles(table7(), 9)), folder / "fig09")
    save(paper_figures.fig10(averages, with_percentiles(table7(), 10)), folder / "fig10")
    save(paper_figures.fig11(averages, with_percentiles(table9(), 11)), folder / "fig11")
    save(traces_figure.time_traces(read(datum), replays, averages), folder / "traces")
    save(traces_figure.mse_over_n(grids, study.experiments_by_level), folder / "mse_over_n")
    write_text(table_7(averages["published"], table7()), table)


run_job(main, globals())
