"""Command line: ``pneumo ...`` for engineers, ``pneumo paper ...`` for the reproduction; how errors end."""

import sys
from typing import Annotated

import typer

from pneumo.cli.engineer_commands import check, export, fit, init, linearise, models, study
from pneumo.cli.paper_commands import assumptions, ensemble, explain, identify, verdict, verify

app = typer.Typer(
    help="Reduced-order thermodynamic models of servo-pneumatic chambers. The study runs with: snakemake -j2",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
paper = typer.Typer(help="The reproduction of the paper: its verdict, and what the verdict rests on.")
app.add_typer(paper, name="paper")

for command in (init, check, study, fit, linearise, export, models):
    app.command()(command)
for command in (verdict, explain, assumptions, identify, ensemble, verify):
    paper.command()(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        from pneumo import __version__

        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    """Take the options of `pneumo` itself."""


def main() -> None:
    """Run the command line; an error that the user can mend is one line and exit code 2."""
    from pneumo.errors import PneumoError, printable

    try:
        sys.exit(app(standalone_mode=False))
    except PneumoError as error:
        message = str(error)
    except Exception as error:
        describe = getattr(error, "format_message", None)
        if describe is None:  # not one of typer's errors of usage
            raise
        message = f"{describe().rstrip('.')}; `pneumo --help` lists commands"
    print(f"pneumo: {printable(' '.join(message.split()), 1000)}", file=sys.stderr)
    sys.exit(2)
