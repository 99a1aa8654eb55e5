"""Command line: ``pneumo ...``, one thin command per function."""

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    help="Reduced-order thermodynamic models of servo-pneumatic chambers. The study runs with: snakemake -j2",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="configuration, later files override earlier ones")],
):
    """Check a configuration and say what it would run."""
    from pneumo.physics.parameters import load, study

    result = study(load(*files))
    for name, e in result.experiments.items():
        loop = "closed" if e.drive.closed_loop else "open"
        typer.echo(
            f"{name}  cylinder {e.cylinder}  {loop:6} loop  k_0 = {e.plant.k_0:g} W/K  {e.steps * e.h:g} s,"
            f" step {e.h * 1e3:g} ms"
        )
    typer.echo(f"{result.name}: {len(result.experiments)} experiments, n = {', '.join(map(str, result.n))}")


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
def cell(
    experiment: Annotated[str, typer.Argument(help="for example E07")],
    model: Annotated[str, typer.Argument(help="M1 ... M10")],
    n: Annotated[float, typer.Argument(help="polytropic index of the grid, for example 1.35")],
    results: Annotated[Path, typer.Option(help="folder of results")] = Path("results"),
):
    """Print one grid cell: error of a model against the full-order run, both transports."""
    from pneumo.store import ResultError, read

    for transport in ("published", "exact"):
        file = results / transport / "replay" / f"{experiment}.nc"
        grid = read(file, "mean_error", "variance", "mse", "status")
        if model not in grid["model"]:
            raise ResultError(f"{file}: model = {model!r}: must be one of {', '.join(grid['model'].values)}")
        if n not in grid["n"]:
            raise ResultError(f"{file}: n = {n:g}: must be one of {', '.join(map(str, grid['n'].values))}")
        for chamber, values in grid.sel(model=model, n=n).groupby("chamber"):
            typer.echo(
                f"{experiment} {model} n = {n:g}  {transport:9}  chamber {chamber}:"
                f"  MSE {values['mse'].item():.4g} Pa^2  mean {values['mean_error'].item():.4g} Pa"
                f"  sigma {values['variance'].item() ** 0.5:.4g} Pa"
            )


def main() -> None:
    """Run the command line; an error that the user can mend is one line and exit code 2."""
    from pneumo.physics.parameters import ConfigurationError
    from pneumo.store import ResultError

    try:
        app()
    except (ConfigurationError, ResultError) as error:
        print(f"pneumo: {error}", file=sys.stderr)
        sys.exit(2)
