"""``pneumo paper``: verdict and evidence of the reproduction.

Modules are imported inside the functions, so that help and errors of usage are fast.
"""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from paper.study.known_papers import PaperName
from pneumo.cli.options import output_to

RESULTS = Path("results")
Results = Annotated[Path, Option(help="folder of results")]
OfPaper = Annotated[PaperName, Option("--paper", help="which paper")]
paper = typer.Typer(help="Reproduction of the paper: verdict and evidence.")


@contextmanager
def _one_line() -> Generator[None]:
    """Show an error in a paper's files as the command line shows all errors."""
    from paper_verdict.errors import PaperError
    from pneumo.errors import InputError

    try:
        yield
    except PaperError as error:
        raise InputError(str(error)) from None


@paper.command()
@_one_line()
def verdict(
    results: Results = RESULTS,
    paper: OfPaper = "2006",
    record: Annotated[
        bool, Option("--record", help="accept the new statuses: overwrite the paper's statuses.csv")
    ] = False,
    runs: Annotated[
        Path | None, Option(help="judge runs of another simulator instead: a folder of E01.csv or E01.nc ...")
    ] = None,
    tool: Annotated[
        str, Option(help="with --runs: name of the simulator, for the page")
    ] = "another simulator",
    output: Annotated[Path | None, output_to("with --runs: folder of the page [RUNS/verdict]")] = None,
) -> None:
    """Judge every claim; print a line for each table and figure, and the facts that differ, worst first."""
    from paper.study.known_papers import current_verdict
    from paper_verdict.text import verdict_lines
    from pneumo.errors import ResultError

    if runs is not None and (record or paper != "2006"):
        raise ResultError("--runs: only for the paper of 2006, and without --record")
    judged = _verdict_on(runs, tool, output or runs / "verdict") if runs else current_verdict(results, paper)
    for line in verdict_lines(judged):
        typer.echo(line)
    if record:
        from paper.study import PAPERS
        from paper_verdict.record import record_text
        from pneumo.storage.files import write_text

        write_text(record_text(judged["facts"]), PAPERS / paper / "statuses.csv")


def _verdict_on(runs: Path, tool: str, out: Path) -> dict[str, Any]:
    """Judge another simulator's runs, write ``verdict.json`` and its page, and return the verdict."""
    import json

    from paper.study import PAPERS
    from paper.study.pages.verdict_page import verdict_page
    from paper.study.paper_2006.other_simulators import verdict_on
    from pneumo.configuration.parameters import load, study
    from pneumo.storage.files import output_folder, write_text

    paper = study(load(PAPERS.parent / "config/paper.yaml"))
    with output_folder(out):
        judged = verdict_on(runs, paper, tool, lambda text: typer.echo(text, err=True))
        text = json.dumps(judged, ensure_ascii=False, indent=1, allow_nan=False)
        write_text(f"{text}\n", out / "verdict.json")
        write_text(verdict_page(judged, PAPERS / "2006"), out / "verdict.html")
    return judged


@paper.command()
@_one_line()
def explain(
    what: Annotated[
        list[str], Argument(help="item of the verdict (T7.M8.mse) or cell of the grid (E07 M8 1.35)")
    ],
    paper: OfPaper = "2006",
    results: Results = RESULTS,
) -> None:
    """Explain an item of the verdict or a cell of the grid."""
    from paper.study import known_papers
    from paper.study.text.explain import cell_text
    from paper_verdict.judging import Judge
    from paper_verdict.text import item_text
    from pneumo.errors import ResultError

    if len(what) == 3:
        try:
            n = float(what[2])
        except ValueError:
            raise ResultError(f"n = {what[2][:50]!r}: must be a number, such as 1.35") from None
        return typer.echo(cell_text(results, what[0], what[1], n))
    if len(what) != 1:
        raise ResultError("name one item, such as T7.M8.mse, or one cell, such as E07 M8 1.35")
    judged = known_papers.paper(paper)
    judge = Judge(judged, results / known_papers.KNOWN[paper].results)
    errata = {name: erratum.model_dump() for name, erratum in judge.errata.items()}
    return typer.echo(item_text(judge.explain(what[0][:50]), errata))


@paper.command()
def verify(results: Annotated[Path, Argument(help="folder of results")] = RESULTS) -> None:
    """Check every result, page and figure against SHA256SUMS, which the workflow writes."""
    from pneumo.errors import ResultError
    from workflow.jobs.checksums import unlike_sums

    listed, unlike = unlike_sums(results)
    for name in unlike:
        typer.echo(f"{results / name}: changed or missing")
    if unlike:
        remedy = "delete them, then `snakemake -j2` makes them again"
        raise ResultError(f"{results}: {len(unlike)} of {listed} files are not as they were made; {remedy}")
    typer.echo(f"{results}: {listed} files as they were made")
