"""``pneumo init``, ``check`` and ``study``: from a configuration to the ranking of models for a cylinder."""

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from pneumo.cli.options import Threads, Trust, output_to, read_configuration
from pneumo.configuration.experiment import MOST_SEEDS

KEYS = Path(__file__).parents[1] / "configuration/keys.md"


def init(
    file: Annotated[Path, Argument(help="file to write")] = Path("cylinder.yaml"),
    table: Annotated[
        bool, Option("--table", help="put the cylinders in a table: a CSV file of the same name")
    ] = False,
    keys: Annotated[bool, Option("--keys", help="print every key with its range instead")] = False,
) -> None:
    """Write a commented configuration of a cylinder, to edit."""
    if keys:
        return typer.echo(KEYS.read_text(encoding="utf-8"), nl=False)
    from pneumo.selection.cylinder_template import write_table_template, write_template

    if table:
        rows = write_table_template(file)
        then = f"edit them, then, in a checkout: snakemake -j2 --configfile {file}"
        return typer.echo(f"{file}, {rows}: written; {then}")
    write_template(file)
    return typer.echo(f"{file}: written; edit it, then: pneumo study {file}")


def check(
    files: Annotated[list[Path], Argument(help="configuration; later files override earlier ones")],
    trust: Trust = False,
) -> None:
    """Check a configuration and list its experiments."""
    from pneumo.configuration.parameters import study as in_SI
    from pneumo.configuration.priors import conversion_notes, dynamics_notes
    from pneumo.selection.plants import study_notes

    configuration = read_configuration(files, trust)
    study = in_SI(configuration)
    for name, e in study.experiments.items():
        time = f"{e.duration:g} s, step {e.h * 1e3:g} ms"
        typer.echo(f"{name}  cylinder {e.cylinder}  {e.loop:6} loop  k_0 = {e.plant.k_0:.3g} W/K  {time}")
    for note in (*study_notes(study), *conversion_notes(configuration), *dynamics_notes(configuration)):
        typer.echo(note)
    typer.echo(f"{study.name}: {len(study.experiments)} experiments, n = {', '.join(map(str, study.n))}")


def study(
    context: typer.Context,
    files: Annotated[
        list[Path] | None, Argument(help="configuration; later files override earlier ones")
    ] = None,
    cylinder: Annotated[list[str] | None, Option(help="only this cylinder; may be repeated [all]")] = None,
    experiment: Annotated[
        list[str] | None, Option(help="only this experiment; may be repeated [all]")
    ] = None,
    seeds: Annotated[
        int | None,
        Option(min=1, max=MOST_SEEDS, help="runs of each experiment, each with its own seed [run.seeds]"),
    ] = None,
    threads: Threads = 2,
    trust: Trust = False,
    output: Annotated[
        Path | None, output_to("folder for study.html and study.nc [study-, with the files' names]")
    ] = None,
) -> None:
    """Recommend a model for your cylinder, with its error budget and the error after one record."""
    from pneumo.errors import InputError

    if not files:
        raise InputError("Missing argument 'files': a configuration; `pneumo init` writes one")
    configuration = read_configuration(files, trust)  # before slow imports
    from rich.console import Console
    from rich.progress import Progress

    from pneumo.configuration.parameters import study as in_SI
    from pneumo.configuration.priors import conversion_notes, dynamics_notes, uncertainties
    from pneumo.notebook.model_study import ModelStudy
    from pneumo.publish.pages.study_page import check_folder
    from pneumo.selection.cylinder_ranking import run_study, selected, simulated_time
    from pneumo.storage.files import output_folder

    chosen = selected(in_SI(configuration), cylinder or (), experiment or ())
    chosen = chosen._replace(seeds=seeds or chosen.seeds)
    folder = output or Path("-".join(["study", *(file.stem for file in files)]))
    context.with_resource(output_folder(folder))
    check_folder(folder)
    for note in (*conversion_notes(configuration), *dynamics_notes(configuration)):
        typer.echo(f"note: {note}", err=True)
    with Progress(console=Console(stderr=True), transient=True) as bar:
        known = uncertainties(configuration)
        task = bar.add_task("full-order runs and replays", total=simulated_time(chosen, known))
        cells = run_study(chosen, threads, lambda seconds: bar.advance(task, seconds), known)
    result = ModelStudy(chosen, cells, configuration, [str(file) for file in files])
    console = Console()
    typer.echo(result.text(console.width))
    page, cells_file = result.save(folder)
    console.print(f"{page}, {cells_file}: written", markup=False, soft_wrap=True)
    for answer in result.answers:
        if not answer.chosen:
            raise InputError(f"{answer.ranking.cylinder}: {answer.reason}; see {page}")
