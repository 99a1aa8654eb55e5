"""``pneumo rig``: models fitted to one volume of gas, a chamber behind a valve and a hose or a vessel."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Option

from pneumo.cli.fit_commands import Columns
from pneumo.cli.options import as_spelt, output_to


def rig(
    context: typer.Context,
    file: Annotated[Path, Argument(help="YAML file of the rig: numbers, or [low, high] of what is fitted")],
    record: Annotated[Path, Argument(help="record with t and P_A, for a chamber also x and u; optionally T")],
    columns: Columns = None,
    command: Annotated[
        Literal["column", "edges"], Option(help="the valve's command: column u, or the pressure's own edges")
    ] = "column",
    model: Annotated[list[str] | None, Option(help="model; may be repeated [all]", callback=as_spelt)] = None,
    temperature: Annotated[
        bool, Option("--temperature", help="fit measured gas temperatures too, and their lag")
    ] = False,
    output: Annotated[Path | None, output_to("folder for rig.html, rig.nc")] = None,
) -> None:
    """Fit models to chambers behind an on/off valve, or a vessel.

    One chamber or both, each behind a hose. Models are ranked on pulses, or points, that no fit uses.
    """
    from rich.console import Console

    from pneumo.errors import InputError, printable
    from pneumo.fitting.record.columns import read_mapping
    from pneumo.fitting.rig.rig_file import read_rig
    from pneumo.fitting.rig.rig_fit import judged_models
    from pneumo.fitting.rig.rig_record import read_runs
    from pneumo.fitting.rig.rig_replay import RIG_MODELS
    from pneumo.publish.pages.fit_page import fit_page
    from pneumo.publish.text.terminal_tables import fit_tables
    from pneumo.storage.files import output_folder, write_text

    for name in model or ():
        if name not in RIG_MODELS:
            raise InputError(f"--model {printable(name)}: must be one of {', '.join(RIG_MODELS)}")
    if output is not None:
        context.with_resource(output_folder(output))
    known = read_rig(file)
    runs = read_runs(record, known, read_mapping(columns) if columns else None, from_edges=command == "edges")
    names = tuple(dict.fromkeys(model)) if model else RIG_MODELS
    fit = judged_models(known, runs, names, temperature, lambda text: typer.echo(text, err=True))
    for note in fit.notes:
        typer.echo(f"note: {note}", err=True)
    for table in fit_tables(fit):
        Console().print(table)
    for warning in fit.warnings:
        typer.echo(f"warning: {warning}", err=True)
    if output is not None:
        fit.save("none: a rig has a file of its own", output / "rig.nc")
        write_text(fit_page(fit, record.name), output / "rig.html")
        typer.echo(f"{output / 'rig.html'} and {output / 'rig.nc'}: written")
