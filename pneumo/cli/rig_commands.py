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

    from pneumo.fitting.record.columns import read_mapping
    from pneumo.notebook import rig as fit_rig
    from pneumo.publish.text.terminal_tables import fit_tables
    from pneumo.storage.files import output_folder

    if output is not None:
        context.with_resource(output_folder(output))
    fit = fit_rig(
        file,
        record,
        models=model,
        columns=read_mapping(columns) if columns else None,
        command=command,
        temperature=temperature,
        progress=lambda text: typer.echo(text, err=True),
    )
    for note in fit.notes:
        typer.echo(f"note: {note}", err=True)
    for table in fit_tables(fit.result):
        Console().print(table)
    for warning in fit.warnings:
        typer.echo(f"warning: {warning}", err=True)
    if output is not None:
        fit.save(output)
        typer.echo(f"{output / 'rig.html'} and {output / 'rig.nc'}: written")
