"""Commands of ``pneumo``, for a cylinder of one's own: one thin function each.

Imports stand in the functions: help and errors of usage need none of them.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pneumo.fit.fitted_parameters import CAUSES
from pneumo.fit.record.formats import FORMATS

if TYPE_CHECKING:
    from xarray import Dataset

    from pneumo.configuration.experiment import Study
    from pneumo.configuration.schema import Configuration

PAPER = Path("config/paper.yaml")  # in a checkout
READ_FORMATS = ", ".join(form.name for form in FORMATS if form.read)
Files = Annotated[list[Path], typer.Argument(help="configuration, later files override earlier ones")]
Config = Annotated[
    list[Path] | None, typer.Option(help="configuration, may be repeated [in a checkout: the paper's]")
]
ModelName = Annotated[str, typer.Argument(help="one of `pneumo models`")]
IndexOption = Annotated[float | None, typer.Option(help="polytropic index, where the model has one")]
OneCylinder = Annotated[
    str | None, typer.Option("--cylinder", help="name in the configuration [the only one there]")
]
ConductanceOption = Annotated[
    float | None,
    typer.Option("--k0", help="conductance of each chamber's wall, W/K [the only one of the cylinder]"),
]


def _configuration(files: list[Path] | None) -> "Configuration":
    from pneumo.configuration.parameters import load
    from pneumo.errors import InputError

    if not files and not PAPER.exists():
        raise InputError("name a configuration with --config; `pneumo init` writes one")
    return load(*(files or [PAPER]))


def _study(files: list[Path] | None) -> "Study":
    from pneumo.configuration.parameters import study

    return study(_configuration(files))


def init(
    file: Annotated[Path, typer.Argument(help="file to write")] = Path("cylinder.yaml"),
    table: Annotated[bool, typer.Option("--table", help="with a table (CSV) of cylinders beside it")] = False,
    source: Annotated[
        Path | None, typer.Option("--from", help="begin with this one, such as a fit's fitted.yaml")
    ] = None,
) -> None:
    """Write a commented configuration of a cylinder, to edit."""
    from pneumo.errors import InputError
    from pneumo.selection.cylinder_template import TEMPLATE, write_table_template, write_template

    if table and source:
        raise InputError("--table: has no use with --from, whose cylinders are sections")
    if table:
        rows = write_table_template(file)
        return typer.echo(
            f"{file}, {rows}: written; edit them, then, in a checkout: snakemake -j2 --configfile {file}"
        )
    if source:
        _study([source])
    write_template(file, source or TEMPLATE)
    return typer.echo(f"{file}: written; edit it, then: pneumo study {file}")


def check(files: Files) -> None:
    """Check a configuration and say what it would run."""
    from pneumo.selection.plants import catalogue_notes, size_notes

    result = _study(files)
    for name, e in result.experiments.items():
        time = f"{e.duration:g} s, step {e.h * 1e3:g} ms"
        typer.echo(f"{name}  cylinder {e.cylinder}  {e.loop:6} loop  k_0 = {e.plant.k_0:g} W/K  {time}")
    for note in (*size_notes(result), *catalogue_notes(result)):
        typer.echo(note)
    typer.echo(f"{result.name}: {len(result.experiments)} experiments, n = {', '.join(map(str, result.n))}")


def study(
    files: Annotated[
        list[Path] | None, typer.Argument(help="configuration, later files override earlier ones")
    ] = None,
    cylinder: Annotated[list[str] | None, typer.Option(help="these cylinders only")] = None,
    experiment: Annotated[list[str] | None, typer.Option(help="these experiments only")] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=1000, help="runs of each [run.seeds]")] = None,
    threads: Annotated[int, typer.Option(min=1, help="the result does not depend on it")] = 2,
    stored: Annotated[
        Path | None, typer.Option("--from", help="results of a fleet: the page of one `--cylinder` of them")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="folder for study.html and study.nc [study-NAME]")
    ] = None,
) -> None:
    """Rank all models on your cylinder, and say which to take."""
    from pneumo.errors import InputError

    if stored is not None:
        if not cylinder or len(cylinder) > 1 or files or experiment or seeds:
            raise InputError("--from RESULTS takes one --cylinder NAME, no files, experiments or seeds")
        return _stored_study(stored, cylinder[0], output)
    if not files:
        raise InputError("Missing argument 'files': a configuration; `pneumo init` writes one")
    configuration = _configuration(files)  # before what takes a second to import
    from rich.console import Console
    from rich.progress import Progress

    from pneumo.configuration.known_within import known_within
    from pneumo.configuration.parameters import study as in_SI
    from pneumo.publish.pages.study_page import check_folder
    from pneumo.selection import cylinder_ranking as own_study

    configured = in_SI(configuration)
    configured = configured._replace(seeds=seeds or configured.seeds)
    chosen = own_study.selected(configured, cylinder or (), experiment or ())
    folder = output or Path(f"study-{chosen.name}")
    check_folder(folder)
    with Progress(console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("full-order runs and replays", total=own_study.simulated_time(chosen))
        cells = own_study.run_study(
            chosen, threads, lambda seconds: bar.advance(line, seconds), known_within(configuration)
        )
    return _tell(chosen, cells, folder)


def _stored_study(results: Path, cylinder: str, output: Path | None) -> None:
    """Write the page of a cylinder of a fleet from its results."""
    from pneumo.publish.pages.study_page import check_folder
    from pneumo.selection.fleet import stored_cylinder

    folder = output or Path(f"study-{cylinder}")
    check_folder(folder)
    _tell(*stored_cylinder(results, cylinder), folder)


def _tell(chosen: "Study", cells: "Dataset", folder: Path) -> None:
    """Print the rankings of a study, and write its page and cells."""
    from rich.console import Console

    from pneumo.errors import InputError
    from pneumo.publish.pages.study_page import save_study
    from pneumo.publish.text.terminal_tables import study_tables
    from pneumo.selection import cylinder_ranking as own_study
    from pneumo.selection.plants import catalogue_notes, size_notes

    console, rankings = Console(), own_study.rankings(cells)
    for note in (*size_notes(chosen), *catalogue_notes(chosen)):
        console.print(note, markup=False)
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
    measurement: Annotated[
        Path, typer.Argument(help=f"{READ_FORMATS}: t, u, x, P_A, P_B, optional v, T, P_s")
    ],
    cylinder: OneCylinder = None,
    config: Config = None,
    columns: Annotated[Path | None, typer.Option(help="YAML: `P_A: {column: name, unit: kPa}` ...")] = None,
    model: Annotated[list[str] | None, typer.Option(help="a model; may be repeated [all]")] = None,
    x_from: Annotated[Literal["mid", "end"], typer.Option(help="zero of x: mid-stroke or A's end")] = "mid",
    command: Annotated[Literal["held", "linear"], typer.Option(help="between samples")] = "held",
    part: Annotated[float, typer.Option(min=0.2, max=0.9, help="fraction that is fitted")] = 0.6,
    trust: Annotated[bool, typer.Option("--trust", help="skip the check for swapped columns")] = False,
    also: Annotated[
        list[str] | None,
        typer.Option(help=f"possible cause of a poor fit, fitted too: {', '.join(CAUSES)}; may be repeated"),
    ] = None,
    closed: Annotated[
        Literal["A", "B", "both"] | None,
        typer.Option(help="both: thermal laws of closed chambers; A, B: k_0 from this one's transient alone"),
    ] = None,
    closed_from: Annotated[float, typer.Option(min=0.0, help="closed from then on, s")] = 0.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="folder for fit.html, fit.nc, fitted.yaml")
    ] = None,
) -> None:
    """Fit models to a record: k_0, n, valve, dead volumes.

    They are ranked on a part held out. Where no gas flows (u, or m_A and m_B, zero, or `--closed both`):
    thermal laws, k_0, n, leakage.
    """
    from dataclasses import replace

    from rich.console import Console

    from pneumo.catalogue import default_conductance
    from pneumo.configuration.parameters import sonic_conductance, study
    from pneumo.configuration.sampling import HELD, INTERPOLATED
    from pneumo.equations.chamber_rate import model_row
    from pneumo.errors import InputError
    from pneumo.fit.closed.closed_fit import fit_closed
    from pneumo.fit.closed.thermal_time_constant import transient
    from pneumo.fit.estimate import fit_measurement
    from pneumo.fit.fit_result import ClosedChambersResult
    from pneumo.fit.fitted_yaml import fitted_configuration
    from pneumo.fit.mistaken_columns import check_columns
    from pneumo.fit.record.columns import read_mapping
    from pneumo.fit.record.measurement import read_measurement
    from pneumo.physics.models import MODELS
    from pneumo.publish.pages.fit_page import fit_page
    from pneumo.publish.text import terminal_tables as shown
    from pneumo.selection.plants import configured_plant
    from pneumo.storage.files import check_output, write_text

    def say(text: str) -> None:
        typer.echo(text, err=True)

    if output is not None:
        check_output(output)
    configuration = _configuration(config)
    configured = study(configuration)
    plant = configured_plant(configured, cylinder, 1.0)
    names = [model_row(name).name for name in model or MODELS]
    mapping = read_mapping(columns) if columns else None
    measured = read_measurement(
        measurement, plant, mapping, from_end=x_from == "end", closed=closed is not None
    )
    for note in measured.notes:
        say(f"note: {note}")
    if closed is not None and closed != "both":
        return typer.echo(shown.transient_text(transient(measured, plant, closed, closed_from)))
    rule = HELD if command == "held" else INTERPOLATED
    if measured.closed:
        for option in [name for name, given in (("model", model), ("also", also)) if given]:
            raise InputError(f"--{option}: closed chambers are fitted with thermal laws; leave it out")
        fitted = fit_closed(measured.since(closed_from), plant, part=part, check=not trust, progress=say)
        for note in fitted.notes[len(measured.notes) :]:
            say(f"note: {note}")
    else:
        if not trust:
            check_columns(measured, plant, command=rule)
        causes = tuple(dict.fromkeys(also or ()))
        fitted = fit_measurement(measured, plant, names, command=rule, part=part, also=causes, progress=say)
    named = cylinder or next(iter(configured.experiments.values())).cylinder  # the only one
    if configuration.cylinders[named].valve:
        C_per_k_xu = sonic_conductance(plant.valve, plant.gas) / plant.valve.k_xu
        fitted = replace(fitted, C_per_k_xu=C_per_k_xu)
    for table in shown.fit_tables(fitted):
        Console().print(table)
    if isinstance(fitted, ClosedChambersResult):
        typer.echo(shown.wall_text(fitted))
    for text in filter(None, [shown.valve_text(fitted), *(f"warning: {text}" for text in fitted.warnings)]):
        typer.echo(text)
    start = default_conductance(plant.cylinder)
    ends = f"95 % of such cylinders {start.k_0_low:.2g} to {start.k_0_high:.2g}"
    typer.echo(f"k_0 was searched from {start.k_0:.2g} W/K, the catalogue's ({ends})")
    if output is not None:
        fitted.save(configured.config_sha256, output / "fit.nc")
        write_text(fit_page(fitted, measurement.name), output / "fit.html")
        text = fitted_configuration(configuration, named, plant, fitted, measurement.name, T=measured.T)
        write_text(text, output / "fitted.yaml")
        typer.echo(f"{output / 'fit.html'}, {output / 'fit.nc'} and {output / 'fitted.yaml'}: written")
    return None


def linearise(
    model: Annotated[str, typer.Argument(help="one of `pneumo models`, or full for the full order")],
    u: Annotated[float, typer.Option("--u", help="command at the operating point, V")],
    P_A: Annotated[float, typer.Option("--P_A", help="absolute pressure of chamber A there, Pa")],
    P_B: Annotated[float, typer.Option("--P_B", help="absolute pressure of chamber B there, Pa")],
    x: Annotated[float, typer.Option("--x", help="position there, m from mid-stroke")] = 0.0,
    v: Annotated[float, typer.Option("--v", help="velocity there, m/s")] = 0.0,
    T_A: Annotated[float | None, typer.Option("--T_A", help="for full: temperature there, K [T_0]")] = None,
    T_B: Annotated[float | None, typer.Option("--T_B", help="the same of chamber B")] = None,
    states: Annotated[
        Literal["chambers", "actuator"], typer.Option(help="with x and v as inputs, or as states")
    ] = "chambers",
    n: IndexOption = None,
    cylinder: OneCylinder = None,
    k0: ConductanceOption = None,
    config: Config = None,
    as_json: Annotated[bool, typer.Option("--json", help="print A and B as JSON")] = False,
    plot: Annotated[
        Path | None,
        typer.Option(help="draw natural frequency and damping over stroke and pressure: name without suffix"),
    ] = None,
) -> None:
    """Print a linear model of the chambers or actuator at a point."""
    import json

    from pneumo.equations.system import quantity, rate_unit, system
    from pneumo.linear.linear_analysis import natural_modes, operating_range
    from pneumo.linear.linear_model import linearise as linear_model
    from pneumo.selection.plants import configured_plant

    plant = configured_plant(_study(config), cylinder, k0)
    names = system(model, n, plant, piston=states == "actuator")
    least, most = plant.conditions.P_atm, plant.conditions.P_s
    for name, P in (("P_A", P_A), ("P_B", P_B)):
        if P > 0 and not least <= P <= most:
            typer.echo(
                f"note: {name} = {P:g} Pa, not from {least:g} (atmosphere) to {most:g} (supply)", err=True
            )
    linear = linear_model(model, n, plant, u=u, P_A=P_A, P_B=P_B, x=x, v=v, T_A=T_A, T_B=T_B, states=states)
    A, B = ([[float(rate) for rate in row] for row in matrix] for matrix in (linear.A, linear.B))
    if plot is not None:
        from pneumo.publish.figures.modes_figure import modes_figure
        from pneumo.publish.style import save

        save(modes_figure(natural_modes(model, n, plant, *operating_range(plant))), plot)
    if as_json:
        return typer.echo(json.dumps({"states": names.states, "inputs": names.inputs, "A": A, "B": B}))
    heads = [f"{name} ({quantity(name)[0]})" for name in (*names.states, *names.inputs)]
    typer.echo(" " * 18 + "  ".join(f"{head:>14}" for head in heads))
    for state, by_state, by_input in zip(names.states, A, B, strict=True):
        head = f"d{state}/dt ({rate_unit(state)})"
        typer.echo(f"{head:18}" + "  ".join(f"{rate:14.6g}" for rate in by_state + by_input))
    return None


def export(
    model: Annotated[str, typer.Argument(help="one of `pneumo models`, or full for the full order")],
    to: Annotated[str, typer.Option(help="c, matlab (Octave too), casadi (Python) or fmu")],
    n: IndexOption = None,
    cylinder: OneCylinder = None,
    k0: ConductanceOption = None,
    config: Config = None,
    precision: Annotated[str, typer.Option(help="double or, in C, float")] = "double",
    valve: Annotated[bool, typer.Option("--valve/--no-valve", help="else mass flows are inputs")] = True,
    piston: Annotated[bool, typer.Option("--piston/--no-piston", help="else x and v are inputs")] = False,
    fmi: Annotated[Literal["2", "3"], typer.Option(help="version of the FMU")] = "2",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="file [standard output, if there is just one]")
    ] = None,
) -> None:
    """Write a model as C, MATLAB or CasADi source, or as an FMU.

    Chambers with or without valve and piston.
    """
    from pneumo.errors import InputError
    from pneumo.export import exported, write_files
    from pneumo.selection.plants import configured_plant

    suffix = {"c": ".c", "fmu": ".fmu"}.get(to)
    if suffix and (output is None or output.suffix != suffix):
        raise InputError(f"--to {to}: needs --output FILE{suffix}")
    files = exported(
        model,
        n,
        configured_plant(_study(config), cylinder, k0),
        to,
        stem=output.stem if output else None,
        precision=precision,
        valve=valve,
        piston=piston,
        fmi=3 if fmi == "3" else 2,
    )
    if output is None:
        return typer.echo("".join(text.decode() for text in files.values()), nl=False)
    first, *rest = files
    names = {first: output.name} | {name: name for name in rest}
    return write_files({names[name]: content for name, content in files.items()}, output.parent)


def models() -> None:
    """Print the table of models."""
    from rich.console import Console
    from rich.table import Table

    from pneumo.physics.models import MODELS, Model

    table = Table(*(field.replace("_", " ") if field != "n_V" else "n V" for field in Model._fields))
    for model in MODELS.values():
        table.add_row(*(str(cell) for cell in model))
    Console().print(table)
