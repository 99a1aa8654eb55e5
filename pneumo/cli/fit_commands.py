"""``pneumo show`` and ``fit``: a measured record, and models fitted to it."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Option

from pneumo.cli.options import MODELS_OF_FIT, Config, Cylinder, Trust, output_to, read_configuration
from pneumo.quantities.table import CHOICES

RECORD = "record with t, u, x, P_A, P_B, optionally T, P_s: text, MATLAB, TDMS, MDF, Excel and more"
Record = Annotated[Path, Argument(help=RECORD)]
Columns = Annotated[
    str | None,
    Option(
        metavar="YAML",
        help="columns' names and units, `{P_A: {column: name, unit: kPa}, ...}`, or a YAML file of them",
    ),
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
    from pneumo.publish.figures.fit_figures import record_figure
    from pneumo.publish.style import save
    from pneumo.selection.plants import configured_plant

    plant = configured_plant(study(read_configuration(config, trust)), cylinder, 1.0)
    mapping = read_mapping(columns) if columns else None
    record = read_measurement(measurement, plant, mapping, from_end=x_from == "end")
    odd = "" if trust or record.closed else mistake(record, plant)
    for note in (*record.notes, *([odd] if odd else [])):
        typer.echo(f"note: {note}", err=True)
    typer.echo(f"{len(record.u)} samples, {record.period:.4g} s apart, {record.t[-1]:.4g} s")
    for line in record.channels:
        typer.echo(line)
    svg, png = save(record_figure(record), output)
    typer.echo(f"{svg} and {png}: written")


def fit(
    context: typer.Context,
    measurements: Annotated[
        list[Path], Argument(metavar="RECORD...", help=f"{RECORD}; several of one rig are fitted together")
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
        Option(help=f"fitted too, without prior knowledge: {', '.join(CHOICES)}; may be repeated"),
    ] = None,
    closed: Annotated[
        Literal["both"] | None, Option(help="fit thermal laws to both chambers, with the valve shut")
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

    from pneumo.catalogue import default_conductance
    from pneumo.fitting.record.columns import read_mapping
    from pneumo.notebook.record_fit import fit as fit_records
    from pneumo.notebook.record_fit import read_record
    from pneumo.publish.text import terminal_tables as shown
    from pneumo.storage.files import output_folder

    said: list[str] = []

    def say(text: str) -> None:
        if text not in said:
            said.append(text)
            typer.echo(text, err=True)

    configuration = read_configuration(config, trust)
    mapping = read_mapping(columns) if columns else None
    if output is not None:
        context.with_resource(output_folder(output))
    other = (
        read_record(validate, configuration, cylinder, columns=mapping, x_from=x_from) if validate else None
    )
    found = fit_records(
        list(measurements),
        configuration,
        cylinder,
        models=model or None,
        columns=mapping,
        x_from=x_from,
        command=command,
        part=part,
        also=also or (),
        trust=trust,
        closed=closed is not None,
        closed_from=closed_from,
        progress=say,
    )
    fitted = found.result
    for note in fitted.notes:
        say(f"note: {note}")
    errors = {str(name): row.to_numpy() for name, row in found.validate(other).iterrows()} if other else {}
    if as_json:
        validated = {name: rms.tolist() for name, rms in errors.items()}
        typer.echo(json.dumps(fitted.summary() | ({"rms_validated": validated} if errors else {}), indent=1))
    for table in [] if as_json else [*shown.fit_tables(fitted), *shown.validation_tables(errors)]:
        shown.print_table(table)
    for text in fitted.warnings:
        typer.echo(f"warning: {text}", err=as_json)
    start = default_conductance(found.plant.cylinder)
    ends = f"95 % of such cylinders {start.k_0_low:.2g} to {start.k_0_high:.2g}"
    typer.echo(f"k_0 was searched from {start.k_0:.2g} W/K, the catalogue's ({ends})", err=as_json)
    if output is not None:
        found.save(output)
        typer.echo(
            f"{output / 'fit.html'}, {output / 'fit.nc'} and {output / 'fitted.yaml'}: written", err=as_json
        )
    return None
