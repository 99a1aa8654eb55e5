"""``pneumo show`` and ``pneumo fit``: a measured record, and models fitted to it.

Modules are imported inside the function, so that help and errors of usage are fast.
"""

from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Option

from pneumo.cli.options import MODELS_OF_FIT, Config, Cylinder, Trust, output_to, read_configuration
from pneumo.fitting.fitted_parameters import ALSO
from pneumo.fitting.record.formats import FORMATS
from pneumo.fitting.settings import FEWEST_SAMPLES, MOST_STEPS

READ_FORMATS = ", ".join(form.name for form in FORMATS if form.read)


RECORD = f"record with t, u, x, P_A, P_B, optionally v, T, P_s: {READ_FORMATS}"
Record = Annotated[Path, Argument(help=RECORD)]
Columns = Annotated[
    Path | None,
    Option(help="YAML file with the columns' names and units: `P_A: {column: name, unit: kPa}` ..."),
]
Origin = Annotated[Literal["mid", "end"], Option(help="where x is zero: in mid-stroke or at chamber A's end")]


def show(
    measurement: Record,
    cylinder: Cylinder = None,
    config: Config = None,
    columns: Columns = None,
    x_from: Origin = "mid",
    trust: Trust = False,
    output: Annotated[Path, output_to("name of the figures, without .svg and .png")] = Path("record"),
) -> None:
    """Draw a record as a fit reads it, and say what is odd in it."""
    from pneumo.configuration.parameters import study
    from pneumo.fitting.mistaken_columns import mistake
    from pneumo.fitting.record.columns import read_mapping
    from pneumo.fitting.record.measurement import read_measurement
    from pneumo.fitting.record.plausibility import above_supply
    from pneumo.publish.figures.fit_figures import record_figure
    from pneumo.publish.style import save
    from pneumo.selection.plants import configured_plant

    plant = configured_plant(study(read_configuration(config, trust)), cylinder, 1.0)
    mapping = read_mapping(columns) if columns else None
    record = read_measurement(measurement, plant, mapping, from_end=x_from == "end")
    odd = "" if trust or record.closed else mistake(record, plant)
    for note in (*record.notes, *above_supply(record, plant), *([odd] if odd else [])):
        typer.echo(f"note: {note}", err=True)
    typer.echo(f"{len(record.u)} samples, {record.period:.4g} s apart, {record.t[-1]:.4g} s")
    for line in record.channels:
        typer.echo(line)
    svg, png = save(record_figure(record), output)
    typer.echo(f"{svg} and {png}: written")


def fit(
    context: typer.Context,
    measurements: Annotated[
        list[Path],
        Argument(metavar="RECORD...", help=f"{RECORD}; several of one rig are fitted together"),
    ],
    cylinder: Cylinder = None,
    config: Config = None,
    columns: Columns = None,
    model: Annotated[list[str] | None, MODELS_OF_FIT] = None,
    x_from: Origin = "mid",
    command: Annotated[
        Literal["held", "linear"], Option(help="command between two samples: held or linear")
    ] = "held",
    part: Annotated[
        float, Option(min=0.2, max=0.9, help="fraction of the record to fit; the rest is held out")
    ] = 0.6,
    trust: Annotated[
        bool,
        Option(
            "--trust", help="skip the checks for swapped or wrong columns and for units of the configuration"
        ),
    ] = False,
    also: Annotated[
        list[str] | None,
        Option(help=f"fitted too, without prior knowledge: {', '.join(ALSO)}; may be repeated"),
    ] = None,
    closed: Annotated[
        Literal["A", "B", "both"] | None,
        Option(
            help="both: fit thermal laws to closed chambers; A or B: k_0 from one chamber's transient alone"
        ),
    ] = None,
    closed_from: Annotated[float, Option(min=0.0, help="time from which the chambers are closed, s")] = 0.0,
    validate: Annotated[
        Path | None, Option(help="another record of the rig, on which the fitted models are judged")
    ] = None,
    as_json: Annotated[
        bool, Option("--json", help="print the result as JSON, SI units, in place of tables")
    ] = False,
    output: Annotated[Path | None, output_to("folder for fit.html, fit.nc, fitted.yaml")] = None,
) -> None:
    """Fit models to a measured record: k_0, n, valve, dead volumes.

    The models are ranked on the part of the record that is held out. Closed chambers (u, or m_A and m_B,
    zero, or `--closed both`) are fitted with thermal laws instead: k_0, n, leakage.
    """
    import json
    from dataclasses import replace

    from rich.console import Console

    from pneumo.catalogue import default_conductance
    from pneumo.configuration.configured_dynamics import configured_dynamics
    from pneumo.configuration.parameters import accuracy, sonic_conductance, study
    from pneumo.configuration.sampling import HELD, INTERPOLATED
    from pneumo.equations.chamber_rate import model_row
    from pneumo.errors import InputError
    from pneumo.fitting.estimate import at_temperature
    from pneumo.fitting.fit_result import ClosedChambersResult
    from pneumo.fitting.fitted_yaml import fitted_configuration
    from pneumo.fitting.measurement_fit import fit_measurement, fitted_too, validation
    from pneumo.fitting.mistaken_columns import check_columns
    from pneumo.fitting.position_checks import position_shown
    from pneumo.fitting.record.columns import read_mapping
    from pneumo.fitting.record.joined_records import joined
    from pneumo.fitting.record.measurement import read_measurement
    from pneumo.physics.models import MODELS
    from pneumo.publish.pages.fit_page import fit_page
    from pneumo.publish.text import terminal_tables as shown
    from pneumo.selection.plants import configured_plant
    from pneumo.storage.files import output_folder, write_text

    said: list[str] = []

    def say(text: str) -> None:
        said.append(text)
        typer.echo(text, err=True)

    if closed in ("A", "B"):
        choices = {"--json": as_json, "-o": output, "--model": model, "--also": also, "--validate": validate}
        for option in (option for option, given in choices.items() if given):
            raise InputError(
                f"{option}: --closed {closed} only prints k_0 of one chamber's transient; leave {option} out,"
                " or --closed both"
            )
    if output is not None:
        context.with_resource(output_folder(output))
    configuration = read_configuration(config, trust)
    configured = study(configuration)
    plant = configured_plant(configured, cylinder, 1.0)
    named = cylinder or next(iter(configured.experiments.values())).cylinder  # the only one
    names = [model_row(name).name for name in model or MODELS]
    mapping = read_mapping(columns) if columns else None
    from_end = x_from == "end"
    records = [
        read_measurement(file, plant, mapping, from_end=from_end, closed=closed is not None)
        for file in measurements
    ]
    measured, part = joined(records, part, MOST_STEPS)
    record_name = ", ".join(file.name for file in measurements)
    other = read_measurement(validate, plant, mapping, from_end=from_end) if validate else None
    if closed_from and not measured.closed:
        raise InputError(
            f"--closed-from {closed_from:g} s: {record_name} is no record of closed chambers; leave it out,"
            " or --closed A, B or both"
        )
    for note in measured.notes:
        say(f"note: {note}")
    if closed is not None and closed != "both":
        from pneumo.fitting.closed.thermal_time_constant import transient

        still = transient(measured, at_temperature(plant, measured.T), closed, closed_from)
        return typer.echo(shown.transient_text(still))
    rule = HELD if command == "held" else INTERPOLATED
    if measured.closed:
        from pneumo.fitting.closed.closed_fit import fit_closed

        for option in [
            name for name, given in (("model", model), ("also", also), ("validate", other)) if given
        ]:
            raise InputError(f"--{option}: the fit of closed chambers has no such choice; leave it out")
        rest = measured.since(closed_from)
        if len(rest.u) < FEWEST_SAMPLES:
            left = f"leaves {len(rest.u)} samples of {measured.t[-1]:g} s: must be at least {FEWEST_SAMPLES}"
            raise InputError(f"--closed-from {closed_from:g} s: {left}")
        fitted = fit_closed(rest, plant, part=part, check=not trust, progress=say)
    else:
        if not trust:
            for record in records:
                check_columns(record, plant, command=rule)
        causes = fitted_too(also or (), measured, configured_dynamics(configuration, named))
        known = accuracy(configuration, position_shown(measured, plant), named)
        fitted = fit_measurement(
            measured, plant, names, command=rule, part=part, also=causes, known=known, progress=say
        )
    for note in fitted.notes:
        if f"note: {note}" not in said:
            say(f"note: {note}")
    if configuration.cylinders[named].valve:
        C_per_k_xu = sonic_conductance(plant.valve, plant.gas) / plant.valve.k_xu
        fitted = replace(fitted, C_per_k_xu=C_per_k_xu)
    errors = validation(fitted, other, plant, command=rule) if other else {}
    if as_json:
        validated = {name: rms.tolist() for name, rms in errors.items()}
        typer.echo(json.dumps(fitted.summary() | ({"rms_validated": validated} if errors else {}), indent=1))
    for table in [] if as_json else [*shown.fit_tables(fitted), *shown.validation_tables(errors)]:
        Console().print(table)
    if isinstance(fitted, ClosedChambersResult):
        typer.echo(shown.wall_text(fitted), err=as_json)
    for text in fitted.warnings:
        typer.echo(f"warning: {text}", err=as_json)
    start = default_conductance(plant.cylinder)
    ends = f"95 % of such cylinders {start.k_0_low:.2g} to {start.k_0_high:.2g}"
    typer.echo(f"k_0 was searched from {start.k_0:.2g} W/K, the catalogue's ({ends})", err=as_json)
    if output is not None:
        fitted.save(configured.config_sha256, output / "fit.nc")
        write_text(fit_page(fitted, record_name), output / "fit.html")
        text = fitted_configuration(configuration, named, plant, fitted, record_name, T=measured.T)
        write_text(text, output / "fitted.yaml")
        typer.echo(
            f"{output / 'fit.html'}, {output / 'fit.nc'} and {output / 'fitted.yaml'}: written", err=as_json
        )
    return None
