"""The command ``paper-verdict``: ``init``, ``check``, ``explain``, ``page``."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from paper_verdict.about import About
from paper_verdict.errors import PaperError, user_traceback
from paper_verdict.facts import NOT_JUDGED, UNEXPLAINED
from paper_verdict.judging import Judge
from paper_verdict.loading import load_paper
from paper_verdict.page import page
from paper_verdict.record import Change, changes, read_record, record_text
from paper_verdict.starting import write_start
from paper_verdict.text import annotation, item_text, verdict_lines

AGREED, CHANGED, WRONG = range(3)  # exit codes


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; exit code 1 where something that agreed no longer does, 2 for input that is wrong."""
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr] - for locales other than UTF-8
    given = _parser().parse_args(arguments)
    run: Callable[[argparse.Namespace], int] = given.run
    try:
        return run(given)
    except PaperError as error:
        return _failed(given, str(error))
    except BrokenPipeError:  # as of `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return AGREED
    except OSError as error:
        return _failed(given, f"{error.filename}: {error.strerror}")
    except Exception as error:  # of the user's functions
        shown = user_traceback(error)
        if not shown:
            raise
        print(shown, end="", file=sys.stderr)
        return _failed(given, f"computations.py failed: {type(error).__name__}; its traceback is above")


def _failed(given: argparse.Namespace, line: str) -> int:
    print(f"paper-verdict: {' '.join(line.split())}", file=sys.stderr)
    if getattr(given, "format", "text") == "github":
        file, _, rest = line.partition(":")
        number, _, _ = rest.partition(":")
        print(annotation("error", f"{file}:{number}" if number.isdigit() else file, "paper-verdict", line))
    return WRONG


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="paper-verdict", description="Judge a paper against a reproduction."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    init = commands.add_parser("init", help="write a commented folder to start from")
    init.add_argument("folder", type=Path)
    init.add_argument(
        "tables", type=Path, nargs="*", help="CSV files of the printed tables; none: an example"
    )
    init.set_defaults(run=_init)

    check = commands.add_parser("check", help="judge; exit code 1 where something that agreed no longer does")
    check.add_argument("folder", type=Path)
    check.add_argument(
        "--strict", action="store_true", help="exit code 1 for every change and unexplained difference"
    )
    check.add_argument("--record", action="store_true", help="accept the statuses: write statuses.csv")
    check.add_argument(
        "--format", choices=["text", "github"], default="text", help="github: annotations of lines"
    )
    check.add_argument("--json", type=Path, metavar="FILE", help="write the whole verdict")

    explain = commands.add_parser("explain", help="all about one number or statement")
    explain.add_argument("folder", type=Path)
    explain.add_argument("item", help="its id, such as T1.water.density")

    write = commands.add_parser("page", help="write the verdict as one HTML file")
    write.add_argument("folder", type=Path)
    write.add_argument("-o", "--output", type=Path, help="the file [FOLDER/verdict.html]")
    for command, run in ((check, _check), (explain, _explain), (write, _page)):
        command.add_argument(
            "--results", type=Path, help="folder of reproduced values [results of paper.yaml]"
        )
        command.set_defaults(run=run)
    for command in (check, write):
        command.add_argument(
            "--verdict", type=Path, metavar="FILE", help="a verdict written before, by check --json"
        )
    return parser


def _judged(given: argparse.Namespace) -> dict[str, Any]:
    """The verdict: judged now, or one that was written before."""
    if given.verdict is None:
        return Judge(load_paper(given.folder), given.results).verdict()
    About.of(given.folder)
    try:
        return json.loads(given.verdict.read_text(encoding="utf-8"))
    except ValueError as error:
        raise PaperError(f"{given.verdict}: is no verdict of check --json: {error}") from None


def _init(given: argparse.Namespace) -> int:
    for line in write_start(given.folder, given.tables):
        print(line)
    return AGREED


def _check(given: argparse.Namespace) -> int:
    judged = _judged(given)
    facts = judged["facts"]
    names = [fact["name"] for fact in facts]
    if given.record:
        _write(given.folder / "statuses.csv", record_text(facts))
    record = read_record(given.folder, names)
    changed = changes(facts, record)
    if given.json:
        _write(given.json, json.dumps(judged, ensure_ascii=False, indent=1, allow_nan=False) + "\n")
    for line in verdict_lines(judged):
        print(line)
    print()
    for line in _change_lines(changed, bool(record)):
        print(line)
    lost = [change for change in changed if change.lost] if record else []
    strict = given.strict and (bool(changed) or any(fact["status"] == UNEXPLAINED for fact in facts))
    if given.format == "github":
        for line in _annotations(given, judged, changed, bool(record)):
            print(line)
    return CHANGED if lost or strict else AGREED


def _change_lines(changed: Sequence[Change], recorded: bool) -> Iterator[str]:
    if not recorded:
        yield "No record yet: --record writes statuses.csv, with which later checks compare."
        return
    if not changed:
        yield "Every fact has its recorded status."
    for change in changed:
        yield f"{'LOST' if change.lost else 'changed'}  {change.text}"
    if changed:
        yield "--record accepts what has changed."


def _annotations(
    given: argparse.Namespace, judged: Mapping[str, Any], changed: Sequence[Change], recorded: bool
) -> Iterator[str]:
    """Annotations for items that differ, at the lines where they were transcribed, and for lost facts."""
    lost = {change.fact["name"] for change in changed if change.lost and recorded}
    for item in judged["items"]:
        off = item["agreement"] is None and item["status"] != NOT_JUDGED
        if item["status"] == UNEXPLAINED or (off and item["fact"] in lost):
            text = f"printed {item['printed']}, reproduced {item['shown'] or 'nothing'}"
            kind = "error" if item["fact"] in lost else "warning"
            source = (given.folder / item["source"]).as_posix()
            yield annotation(kind, source, f"{item['id']} {item['status']}", text)
    for change in changed:
        if change.fact["name"] in lost:
            yield annotation(
                "error", (given.folder / "facts.yaml").as_posix(), change.fact["name"], change.text
            )


def _explain(given: argparse.Namespace) -> int:
    judge = Judge(load_paper(given.folder), given.results)
    item = judge.explain(given.item)
    print(item_text(item, {name: erratum.model_dump() for name, erratum in judge.errata.items()}))
    return AGREED


def _page(given: argparse.Namespace) -> int:
    judged = _judged(given)
    own = given.folder / "findings.html"
    findings = own.read_text(encoding="utf-8") if own.is_file() else ""
    output = given.output or given.folder / "verdict.html"
    _write(output, page(judged, findings))
    print(f"{output}: written")
    return AGREED


def _write(file: Path, text: str) -> None:
    """Write a file whole, or leave the one that is there."""
    part = file.with_name(f"{file.name}.part")
    part.write_text(text, encoding="utf-8")
    part.replace(file)


if __name__ == "__main__":
    sys.exit(main())
