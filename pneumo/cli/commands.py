"""Command line: ``pneumo ...`` for a cylinder, ``pneumo paper ...`` for the reproduction; its error lines."""

import os
import sys
from contextlib import suppress
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated

import typer
from typer import Option

from pneumo.cli import BROKEN_PIPE, INTERRUPTED
from pneumo.cli.cylinder_commands import check, init, study
from pneumo.cli.fit_commands import fit, show
from pneumo.cli.model_commands import export, linearise, models
from pneumo.cli.run_commands import live, simulate

app = typer.Typer(
    help="Reduced-order thermodynamic models of servo-pneumatic chambers. Begin with"
    " `pneumo init`. In a checkout, `snakemake -j2` reproduces the paper.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for command in (init, check, simulate, study, show, fit, linearise, export, models, live):
    app.command()(command)

CHECKOUT = Path(__file__).resolve().parents[2]
if (CHECKOUT / "paper/study").is_dir():  # an installed wheel does not reproduce papers
    sys.path.append(str(CHECKOUT))
    from paper.study.commands import paper

    app.add_typer(paper, name="paper")


def _print_version(wanted: bool) -> None:
    if wanted:
        from pneumo import __version__

        typer.echo(__version__)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, Option("--version", callback=_print_version, is_eager=True, help="print the version")
    ] = False,
) -> None:
    """Handle the options of `pneumo` itself."""


def main() -> None:
    """Run the command line; an error that the user can correct is one line and exit code 2."""
    from pneumo.errors import PneumoError, as_lines

    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # for locales other than UTF-8
    try:
        code = app(prog_name="pneumo", standalone_mode=False)
        print(end="", flush=True)
        if code == INTERRUPTED:  # typer's for Ctrl-C
            raise KeyboardInterrupt
        sys.exit(code)
    except PneumoError as error:
        message = as_lines(error)
    except (OSError, SystemExit) as end:  # disk full, not writable, or a closed pipe
        # typer and rich turn a broken pipe into a SystemExit, with the OSError as its context.
        error = end.__context__ if isinstance(end, SystemExit) else end
        if not isinstance(error, OSError):
            raise
        message = as_lines(f"{error.filename or 'output'}: {error.strerror}")
        with suppress(OSError, ValueError):  # else Python tries to write the rest at exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):  # `pneumo study my.yaml | head`
            sys.exit(BROKEN_PIPE)
    except Exception as error:
        describe = getattr(error, "format_message", None)
        if describe is None:  # not an error of usage from typer
            raise
        context = getattr(error, "ctx", None)
        command = context.command_path if context else "pneumo"
        message = as_lines(f"{describe().rstrip('.')}; see `{command} --help`")
    print(message, file=sys.stderr)
    sys.exit(2)
