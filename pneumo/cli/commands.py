"""Command line: ``pneumo ...``, one thin command per function."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    help="Reduced-order thermodynamic models of servo-pneumatic chambers. The study runs with: snakemake -j2",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class Cylinders(StrEnum):
    """What `pneumo identify` works on."""

    D = "D"
    E = "E"
    both = "both"


class Origin(StrEnum):
    """Where positions count from."""

    mid = "mid"
    end = "end"


class Command(StrEnum):
    """What a command does between samples."""

    held = "held"
    linear = "linear"


class Transport(StrEnum):
    """How replays get their signals."""

    published = "published"
    exact = "exact"


class Side(StrEnum):
    """A chamber."""

    A = "A"
    B = "B"


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="configuration, later files override earlier ones")],
):
    """Check a configuration and say what it would run."""
    from pneumo.configuration.parameters import load, study

    result = study(load(*files))
    for name, e in result.experiments.items():
        loop = "closed" if e.drive.closed_loop else "open"
        typer.echo(
            f"{name}  cylinder {e.cylinder}  {loop:6} loop  k_0 = {e.plant.k_0:g} W/K  {e.steps * e.h:g} s,"
            f" step {e.h * 1e3:g} ms"
        )
    typer.echo(f"{result.name}: {len(result.experiments)} experiments, n = {', '.join(map(str, result.n))}")


@app.command()
def init(
    file: Annotated[Path, typer.Argument(help="file to write")] = Path("cylinder.yaml"),
):
    """Write a commented configuration of a cylinder of one's own, to edit for `pneumo study`."""
    from pneumo.engineer.cylinder_template import write_template

    write_template(file)
    typer.echo(f"{file}: written; edit it, then: pneumo study {file}")


@app.command()
def study(
    files: Annotated[list[Path], typer.Argument(help="configuration, later files override earlier ones")],
    cylinder: Annotated[list[str] | None, typer.Option(help="these cylinders only")] = None,
    experiment: Annotated[list[str] | None, typer.Option(help="these experiments only")] = None,
    seeds: Annotated[
        int | None, typer.Option(min=1, max=1000, help="runs of each experiment [run.seeds]")
    ] = None,
    threads: Annotated[int, typer.Option(min=1, help="the result does not depend on it")] = 2,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="folder for study.html and study.nc [study-NAME]")
    ] = None,
):
    """Rank all ten models on a cylinder of one's own, with error bars, and say which to take."""
    from pneumo.configuration.parameters import load
    from pneumo.configuration.parameters import study as configured

    given = configured(load(*files))
    # What follows takes a second to import; what is wrong in a configuration is said before.
    from rich.console import Console
    from rich.progress import Progress

    from pneumo.engineer import own_study as task
    from pneumo.errors import InputError
    from pneumo.publish.pages.study_page import check_folder, save_study
    from pneumo.publish.text.terminal_tables import study_tables

    chosen = task.selected(given._replace(seeds=seeds or given.seeds), cylinder or (), experiment or ())
    folder = output or Path(f"study-{chosen.name}")
    check_folder(folder)
    console = Console()
    with Progress(console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("full-order runs and replays", total=task.simulated_time(chosen))
        cells = task.run_study(chosen, threads, lambda seconds: bar.advance(line, seconds))
    rankings = task.rankings(cells)
    for ranking in rankings:
        for table in study_tables(ranking):
            console.print(table)
        for reason in ranking.left_out:
            console.print(f"Left out: {reason}.", markup=False)
        console.print(f"Recommended: {ranking.recommended or 'none'}. {ranking.reason}.", markup=False)
        for advice in ranking.advice:
            console.print(f"- {advice}", markup=False)
    page, stored = save_study(chosen, cells, rankings, folder)
    console.print(f"{page}, {stored}", markup=False, soft_wrap=True)
    for ranking in rankings:
        if not ranking.recommended:
            raise InputError(f"{ranking.cylinder}: {ranking.reason}; {page} tells which")


@app.command()
def models():
    """Print the table of models M1 to M10."""
    from rich.console import Console
    from rich.table import Table

    from pneumo.physics.models import MODELS, Model

    table = Table(*(field.replace("_", " ") if field != "n_V" else "n V" for field in Model._fields))
    for model in MODELS.values():
        table.add_row(*(str(cell) for cell in model))
    Console().print(table)


@app.command()
def explain(
    what: Annotated[
        list[str],
        typer.Argument(help="an item of the verdict (T7.M8.mse), or a cell of the grid (E07 M8 1.35)"),
    ],
    results: Annotated[Path, typer.Option(help="folder of results")] = Path("results"),
):
    """Tell one item of the verdict, or one grid cell: claimed, found, and where the evidence is."""
    from pneumo.errors import ResultError
    from pneumo.papers.paper_2006.paper import PAPER_2006
    from pneumo.publish.text.explain import cell_text, item_text
    from pneumo.verdict.judging import Judge, read_statuses

    if len(what) == 3:
        try:
            n = float(what[2])
        except ValueError:
            raise ResultError(f"n = {what[2][:50]!r}: must be a number, such as 1.35") from None
        return typer.echo(cell_text(results, what[0], what[1], n))
    if len(what) != 1:
        raise ResultError("name one item, such as T7.M8.mse, or one cell, such as E07 M8 1.35")
    judge = Judge(results, PAPER_2006)
    if what[0] not in judge.claims.items:
        near = [name for name in judge.claims.items if name.startswith(what[0].split(".")[0] + ".")]
        there = ", ".join(near[:6] or list(judge.claims.items)[::60])
        raise ResultError(f"{what[0][:50]}: no such item; there are {there} ...")
    errata = {name: erratum._asdict() for name, erratum in judge.errata.items()}
    item = judge.judge(judge.claims.items[what[0]])
    typer.echo(item_text(item, errata, read_statuses().get(what[0])))


@app.command()
def verdict(
    results: Annotated[Path, typer.Option(help="folder of results")] = Path("results"),
    record: Annotated[bool, typer.Option("--record", help="write paper/2006/statuses.csv anew")] = False,
):
    """Judge every claim: counts, and what is missed or contradicted; `--record` accepts the statuses."""
    from pneumo.papers.paper_2006.current_verdict import current_verdict

    found = current_verdict(results)
    for item in found["items"]:
        if item["status"] in ("missed", "contradicted"):
            typer.echo(f"{item['status']:12}  {item['id']:24}  {item['printed']:>10}  {item['reason']}")
    typer.echo(", ".join(f"{number} {name}" for name, number in found["counts"].items()))
    if record:
        from pneumo.storage.files import write_text
        from pneumo.verdict import PAPER_FOLDER
        from pneumo.verdict.judging import statuses_text

        write_text(statuses_text(found["items"]), PAPER_FOLDER / "statuses.csv")


@app.command()
def assumptions(
    results: Annotated[Path, typer.Option(help="folder of results")] = Path("results"),
):
    """Print what each alternative assumption does to Tables 5, 7, 8 and 9."""
    from pneumo.errors import ResultError
    from pneumo.evidence.toggle_effects import toggle_effects
    from pneumo.publish.text.markdown_tables import assumptions_table
    from pneumo.storage.files import read
    from pneumo.verdict.claims import read_claims

    file = results / "assumptions.nc"
    if not file.exists():
        raise ResultError(f"{file}: no such file; `snakemake -j2 evidence` makes it")
    typer.echo(
        assumptions_table(toggle_effects(read(file, "reproduced")["reproduced"], read_claims())), nl=False
    )


@app.command()
def ensemble(
    transport: Annotated[Transport, typer.Option(help="of the table of pairs")] = Transport.exact,
    level: Annotated[str, typer.Option(help="of the table of pairs")] = "overall",
    results: Annotated[Path, typer.Option(help="folder of results")] = Path("results"),
):
    """Print what other seeds say: quotients of errors, which model beats which, which statements stand."""
    import json

    from rich.console import Console

    from pneumo.errors import ResultError
    from pneumo.publish.text.markdown_tables import findings_table
    from pneumo.publish.text.terminal_tables import probability_table, ratio_table
    from pneumo.storage.files import read, read_json

    file = results / "ensemble.nc"
    if not file.exists():
        raise ResultError(f"{file}: no such file; `snakemake -j2 ensemble` makes it")
    found = read(file)
    if level not in found["level"].values:
        raise ResultError(f"level = {level[:50]!r}: must be one of {', '.join(found['level'].values)}")
    console = Console()
    console.print(ratio_table(found))
    console.print(probability_table(found, transport.value, level))
    statements = json.loads(read_json(results / "findings.json"))
    console.print(findings_table(statements, headlines=False), markup=False, soft_wrap=True)


@app.command()
def identify(
    files: Annotated[list[Path] | None, typer.Argument(help="configuration [config/paper.yaml]")] = None,
    cylinder: Annotated[Cylinders, typer.Option(help="amplitudes and transport need both")] = Cylinders.both,
    seed: Annotated[int, typer.Option(min=0, help="of the search's random numbers")] = 0,
    threads: Annotated[int, typer.Option(min=1, help="the result does not depend on it")] = 2,
    output: Annotated[Path, typer.Option("--output", "-o", help="NetCDF file to write")] = Path(
        "results/identification.nc"
    ),
):
    """Find M, k_f, stop, amplitudes and transport from Tables 5, 7 and 9, without a starting hint."""
    import time

    from rich.console import Console

    from pneumo.configuration.parameters import load, study
    from pneumo.evidence.identification import identify as identified
    from pneumo.evidence.identification import save_identification
    from pneumo.publish.text.terminal_tables import identification_tables

    start = time.perf_counter()

    def say(text: str) -> None:
        typer.echo(f"{time.perf_counter() - start:6.0f} s  {text}")

    result = study(load(*(files or [Path("config/paper.yaml")])))
    names = ["D", "E"] if cylinder is Cylinders.both else [cylinder.value]
    found = identified(result, names, seed, threads, say)
    save_identification(found, result, seed, output)
    for table in identification_tables(found):
        Console().print(table)
    say(f"written to {output}")


@app.command()
def export(
    model: Annotated[str, typer.Argument(help="M1 to M10")],
    cylinder: Annotated[str, typer.Option(help="name of a cylinder in the configuration")],
    k0: Annotated[float, typer.Option(help="thermal conductance of each chamber's wall, W/K")],
    to: Annotated[str, typer.Option(help="c, matlab (Octave too) or casadi (Python)")],
    n: Annotated[float | None, typer.Option(help="polytropic index, where the model has one")] = None,
    config: Annotated[list[Path] | None, typer.Option(help="configuration [config/paper.yaml]")] = None,
    precision: Annotated[str, typer.Option(help="double or, in C, float")] = "double",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="file [standard output]")] = None,
):
    """Write a model as source code: rates of both chambers' pressures from u, x, v, P_A and P_B."""
    from pneumo.configuration.parameters import load, study
    from pneumo.engineer.export import exported, write_source
    from pneumo.engineer.plants import configured_plant

    plant = configured_plant(study(load(*(config or [Path("config/paper.yaml")]))), cylinder, k0)
    source = exported(model, n, plant, to, precision)
    if output is None:
        return typer.echo(source, nl=False)
    write_source(source, output)


@app.command()
def fit(
    measurement: Annotated[Path, typer.Argument(help="CSV or NetCDF: t, u, x, P_A, P_B, optional v and T")],
    cylinder: Annotated[str, typer.Option(help="name of a cylinder in the configuration")],
    config: Annotated[list[Path] | None, typer.Option(help="configuration [config/paper.yaml]")] = None,
    columns: Annotated[Path | None, typer.Option(help="YAML: `P_A: {column: name, unit: kPa}` ...")] = None,
    model: Annotated[list[str] | None, typer.Option(help="M1 to M10, may be repeated [all]")] = None,
    x_from: Annotated[Origin, typer.Option(help="zero of x: mid-stroke or A's end")] = Origin.mid,
    command: Annotated[Command, typer.Option(help="the command between samples")] = Command.held,
    part: Annotated[float, typer.Option(min=0.2, max=0.9, help="fraction that is fitted")] = 0.6,
    trust: Annotated[bool, typer.Option("--trust", help="skip the check for swapped columns")] = False,
    closed: Annotated[
        Side | None, typer.Option(help="instead: k_0 from the transient of this closed chamber")
    ] = None,
    closed_from: Annotated[float, typer.Option(min=0.0, help="when that is closed, s")] = 0.0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="folder for fit.html, fit.nc")] = None,
):
    """Fit models to a measurement: k_0, n, valve coefficient, dead volumes; ranked on a part held out."""
    from rich.console import Console

    from pneumo.configuration.parameters import load, study
    from pneumo.engineer.closed_chamber import transient
    from pneumo.engineer.confused_columns import check_columns
    from pneumo.engineer.estimate import fit_measurement, save_fit
    from pneumo.engineer.model_rate import model_row
    from pneumo.engineer.plants import configured_plant
    from pneumo.engineer.record import read_mapping, read_measurement
    from pneumo.physics.models import MODELS
    from pneumo.publish.pages.fit_page import fit_page
    from pneumo.publish.text.terminal_tables import fit_table, transient_text
    from pneumo.storage.files import write_text

    settings = study(load(*(config or [Path("config/paper.yaml")])))
    plant = configured_plant(settings, cylinder, 1.0)
    names = [model_row(name).name for name in model or MODELS]
    mapping = read_mapping(columns) if columns else None
    measured = read_measurement(measurement, plant, mapping, from_end=x_from is Origin.end)
    for note in measured.notes:
        typer.echo(f"note: {note}", err=True)
    if closed is not None:
        return typer.echo(transient_text(transient(measured, plant, closed.value, closed_from)))
    held = command is Command.held
    if not trust:
        check_columns(measured, plant, held=held)
    found = fit_measurement(
        measured, plant, names, held=held, part=part, progress=lambda text: typer.echo(text, err=True)
    )
    Console().print(fit_table(found))
    if output is not None:
        save_fit(found, settings.config_sha256, output / "fit.nc")
        write_text(fit_page(found, measurement.name), output / "fit.html")
        typer.echo(f"written to {output / 'fit.html'} and {output / 'fit.nc'}")


@app.command()
def verify(
    results: Annotated[Path, typer.Argument(help="folder of results")] = Path("results"),
    remove: Annotated[
        bool, typer.Option("--remove", help="remove what is damaged, so that the next run makes it again")
    ] = False,
):
    """Check every NetCDF and JSON file against the SHA-256 at its end."""
    from pneumo.errors import ResultError
    from pneumo.storage.files import damaged, sealed_files

    files, found = sealed_files(results), damaged(results)
    if not files:
        raise ResultError(f"{results}: holds no results; `snakemake -j2` makes them")
    for error in found:
        typer.echo(f"{error}{'; removed' if remove else ''}")
        if remove:
            error.path.unlink()
    if found and not remove:
        raise ResultError(f"{len(found)} damaged; `pneumo verify --remove`, then `snakemake -j2`, mends them")
    typer.echo(f"{results}: {len(files) - len(found)} files as they were written")


def main() -> None:
    """Run the command line; an error that the user can mend is one line and exit code 2."""
    from pneumo.errors import PneumoError, printable

    try:
        sys.exit(app(standalone_mode=False))
    except PneumoError as error:
        message = str(error)
    except Exception as error:
        if not hasattr(error, "format_message"):  # typer's errors of usage
            raise
        message = f"{error.format_message().rstrip('.')}; `pneumo --help` lists commands"  # type: ignore[attr-defined]
    print(f"pneumo: {printable(' '.join(message.split()), 1000)}", file=sys.stderr)
    sys.exit(2)
