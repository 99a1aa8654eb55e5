"""Commands of ``pneumo``, for a cylinder of one's own: one thin function each.

Imports stand in the functions: help and errors of usage need none of them.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from pneumo.configuration.experiment import Study

Files = Annotated[list[Path], typer.Argument(help="configuration, later files override earlier ones")]
Config = Annotated[list[Path] | None, typer.Option(help="configuration, may be repeated [config/paper.yaml]")]
ModelName = Annotated[str, typer.Argument(help="M1 to M10")]
IndexOption = Annotated[float | None, typer.Option(help="polytropic index, where the model has one")]
OneCylinder = Annotated[
    str | None, typer.Option("--cylinder", help="name in the configuration [the only one there]")
]
ConductanceOption = Annotated[
    float | None,
    typer.Option("--k0", help="conductance of each chamber's wall, W/K [the only one of the cylinder]"),
]


def _study(files: list[Path] | None) -> "Study":
    from pneumo.configuration.parameters import load, study

    return study(load(*(files or [Path("config/paper.yaml")])))


def init(file: Annotated[Path, typer.Argument(help="file to write")] = Path("cylinder.yaml")) -> None:
    """Write a commented configuration of a cylinder of one's own, to edit for `pneumo study`."""
    from pneumo.engineer.cylinder_template import write_template

    write_template(file)
    typer.echo(f"{file}: written; edit it, then: pneumo study {file}")


def check(files: Files) -> None:
    """Check a configuration and say what it would run."""
    result = _study(files)
    for name, e in result.experiments.items():
        loop = "closed" if e.drive.closed_loop else "open"
        time = f"{e.steps * e.h:g} s, step {e.h * 1e3:g} ms"
        typer.echo(f"{name}  cylinder {e.cylinder}  {loop:6} loop  k_0 = {e.plant.k_0:g} W/K  {time}")
    typer.echo(f"{result.name}: {len(result.experiments)} experiments, n = {', '.join(map(str, result.n))}")


def study(
    files: Files,
    cylinder: Annotated[list[str] | None, typer.Option(help="these cylinders only")] = None,
    experiment: Annotated[list[str] | None, typer.Option(help="these experiments only")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=1000, help="runs of each [run.seeds]")] = None,
    threads: Annotated[int, typer.Option(min=1, help="the result does not depend on it")] = 2,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="folder for study.html and study.nc [study-NAME]")
    ] = None,
) -> None:
    """Rank all models on a cylinder of one's own, with error bars, and say which to take."""
    configured = _study(files)  # before what takes a second to import
    from rich.console import Console
    from rich.progress import Progress

    from pneumo.engineer import own_study
    from pneumo.errors import InputError
    from pneumo.publish.pages.study_page import check_folder, save_study
    from pneumo.publish.text.terminal_tables import study_tables

    configured = configured._replace(seeds=seeds or configured.seeds)
    chosen = own_study.selected(configured, cylinder or (), experiment or ())
    folder = output or Path(f"study-{chosen.name}")
    check_folder(folder)
    console = Console()
    with Progress(console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("full-order runs and replays", total=own_study.simulated_time(chosen))
        cells = own_study.run_study(chosen, threads, lambda seconds: bar.advance(line, seconds))
    rankings = own_study.rankings(cells)
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


def fit(
    measurement: Annotated[Path, typer.Argument(help="CSV or NetCDF: t, u, x, P_A, P_B, optional v and T")],
    cylinder: OneCylinder = None,
    config: Config = None,
    columns: Annotated[Path | None, typer.Option(help="YAML: `P_A: {column: name, unit: kPa}` ...")] = None,
    model: Annotated[list[str] | None, typer.Option(help="M1 to M10, may be repeated [all]")] = None,
    x_from: Annotated[Literal["mid", "end"], typer.Option(help="zero of x: mid-stroke or A's end")] = "mid",
    command: Annotated[Literal["held", "linear"], typer.Option(help="between samples")] = "held",
    part: Annotated[float, typer.Option(min=0.2, max=0.9, help="fraction that is fitted")] = 0.6,
    trust: Annotated[bool, typer.Option("--trust", help="skip the check for swapped columns")] = False,
    closed: Annotated[
        Literal["A", "B"] | None, typer.Option(help="instead: k_0 from the transient of this closed chamber")
    ] = None,
    closed_from: Annotated[float, typer.Option(min=0.0, help="when that is closed, s")] = 0.0,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="folder for fit.html, fit.nc")] = None,
) -> None:
    """Fit models to a measurement: k_0, n, valve coefficient, dead volumes; ranked on a part held out."""
    from rich.console import Console

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

    configured = _study(config)
    plant = configured_plant(configured, cylinder, 1.0)
    names = [model_row(name).name for name in model or MODELS]
    mapping = read_mapping(columns) if columns else None
    measured = read_measurement(measurement, plant, mapping, from_end=x_from == "end")
    for note in measured.notes:
        typer.echo(f"note: {note}", err=True)
    if closed is not None:
        return typer.echo(transient_text(transient(measured, plant, closed, closed_from)))
    held = command == "held"
    if not trust:
        check_columns(measured, plant, held=held)
    fitted = fit_measurement(
        measured, plant, names, held=held, part=part, progress=lambda text: typer.echo(text, err=True)
    )
    Console().print(fit_table(fitted))
    if output is not None:
        save_fit(fitted, configured.config_sha256, output / "fit.nc")
        write_text(fit_page(fitted, measurement.name), output / "fit.html")
        typer.echo(f"written to {output / 'fit.html'} and {output / 'fit.nc'}")
    return None


def linearise(
    model: ModelName,
    u: Annotated[float, typer.Option("--u", help="command at the operating point, V")],
    P_A: Annotated[float, typer.Option("--P_A", help="pressure of chamber A there, Pa")],
    P_B: Annotated[float, typer.Option("--P_B", help="pressure of chamber B there, Pa")],
    x: Annotated[float, typer.Option("--x", help="position there, m from mid-stroke")] = 0.0,
    v: Annotated[float, typer.Option("--v", help="velocity there, m/s")] = 0.0,
    n: IndexOption = None,
    cylinder: OneCylinder = None,
    k0: ConductanceOption = None,
    config: Config = None,
    as_json: Annotated[bool, typer.Option("--json", help="print A and B as JSON")] = False,
) -> None:
    """Print a linear model of both chambers at an operating point: rates of P_A and P_B."""
    import json

    from pneumo.engineer.linear_model import INPUTS, STATES
    from pneumo.engineer.linear_model import linearise as linear_model
    from pneumo.engineer.plants import configured_plant

    plant = configured_plant(_study(config), cylinder, k0)
    linear = linear_model(model, n, plant, u=u, P_A=P_A, P_B=P_B, x=x, v=v)
    rows = [[*map(float, a), *map(float, b)] for a, b in zip(linear.A, linear.B, strict=True)]
    if as_json:
        matrices = {"A": [row[:2] for row in rows], "B": [row[2:] for row in rows]}
        return typer.echo(json.dumps({"states": STATES, "inputs": INPUTS, **matrices}))
    units = ("1/s", "1/s", "Pa/s per V", "Pa/s per m", "Pa/s per m/s")
    heads = [f"{name} ({unit})" for name, unit in zip((*STATES, *INPUTS), units, strict=True)]
    typer.echo("         " + "  ".join(f"{head:>16}" for head in heads))
    for state, row in zip(STATES, rows, strict=True):
        typer.echo(f"d{state}/dt  " + "  ".join(f"{value:16.6g}" for value in row))
    return None


def export(
    model: ModelName,
    to: Annotated[str, typer.Option(help="c, matlab (Octave too) or casadi (Python)")],
    n: IndexOption = None,
    cylinder: OneCylinder = None,
    k0: ConductanceOption = None,
    config: Config = None,
    precision: Annotated[str, typer.Option(help="double or, in C, float")] = "double",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="file [standard output]")] = None,
) -> None:
    """Write a model as source code: rates of both chambers' pressures from u, x, v, P_A and P_B."""
    from pneumo.engineer.export import exported, write_source
    from pneumo.engineer.plants import configured_plant

    source = exported(model, n, configured_plant(_study(config), cylinder, k0), to, precision)
    if output is None:
        return typer.echo(source, nl=False)
    return write_source(source, output)


def models() -> None:
    """Print the table of models."""
    from rich.console import Console
    from rich.table import Table

    from pneumo.physics.models import MODELS, Model

    table = Table(*(field.replace("_", " ") if field != "n_V" else "n V" for field in Model._fields))
    for model in MODELS.values():
        table.add_row(*(str(cell) for cell in model))
    Console().print(table)
