"""Draw Figures 7 to 11, the time traces and the error over n."""

from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.jobs.wrapper import logged
from pneumo.publish.figures import paper_figures as figures
from pneumo.publish.style import save
from pneumo.storage.files import open_grid, read, read_json
from pneumo.verdict.published import table7, table9


def main(parameters: str, settling: str, datum: str, statistics: list[str], folder: Path) -> None:
    study = from_json(read_json(parameters))
    transports = {Path(file).parent.name: Path(file).parent for file in statistics}
    averages = {name: read(path / "statistics.nc") for name, path in transports.items()}
    replays = {name: read(path / "replay" / Path(datum).name) for name, path in transports.items()}
    grids = {
        name: open_grid(path).sel(experiment=list(study.experiments)) for name, path in transports.items()
    }
    save(figures.fig07(read(settling)), folder / "fig07")
    save(figures.fig08(averages, table7()), folder / "fig08")
    save(figures.fig09(averages, table7()), folder / "fig09")
    save(figures.fig10(averages, table7()), folder / "fig10")
    save(figures.fig11(averages, table9()), folder / "fig11")
    save(figures.traces(read(datum), replays, averages), folder / "traces")
    save(figures.mse_over_n(grids, study.experiments_by_level), folder / "mse_over_n")


if job := globals().get("snakemake"):
    with logged(job):
        files, folder = job.input, Path(job.output[0]).parent
        main(files.parameters, files.settling, files.datum, list(files.statistics), folder)
