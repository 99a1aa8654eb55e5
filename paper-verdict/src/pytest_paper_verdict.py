"""Plug-in of pytest: ``pytest --paper FOLDER`` runs each fact of a paper as a test.

A fact fails if something in it agreed when it was recorded and no longer does, or, without a record, if it
differs and nothing explains it. One that was recorded as unexplained is an expected failure. It imports
`paper_verdict` only when a paper is asked for, so that other test runs do not wait for it.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("paper-verdict")
    group.addoption(
        "--paper", action="append", type=Path, metavar="FOLDER", help="judge a paper, each fact a test"
    )
    group.addoption("--paper-results", type=Path, metavar="FOLDER", help="folder of its reproduced values")


def pytest_configure(config: pytest.Config) -> None:
    """Collect the papers, alone if nothing else is named."""
    folders = config.getoption("--paper") or []
    files = [str(folder / "claims.yaml") for folder in folders]
    if not files:
        return
    if config.args_source is not pytest.Config.ArgsSource.ARGS:  # nothing named: the papers alone
        config.args[:] = []
    config.args += files


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> "PaperFile | None":
    """Collect the facts of a paper from its ``claims.yaml``."""
    for folder in parent.config.getoption("--paper") or []:
        if file_path == (folder / "claims.yaml").resolve():
            return PaperFile.from_parent(parent, path=file_path, name=str(folder))
    return None


class PaperFile(pytest.File):
    """The facts of a paper."""

    def collect(self) -> Iterator["FactItem"]:
        """Judge the paper, and yield a test for each of its facts."""
        from paper_verdict.errors import PaperError
        from paper_verdict.judging import Judge
        from paper_verdict.loading import load_paper
        from paper_verdict.record import read_record

        folder = self.path.parent
        try:
            judged = Judge(load_paper(folder), self.config.getoption("--paper-results")).verdict()
            record = read_record(folder, [fact["name"] for fact in judged["facts"]])
        except PaperError as error:
            raise self.CollectError(str(error)) from None
        for fact in judged["facts"]:
            items = [item for item in judged["items"] if item["fact"] == fact["name"]]
            yield FactItem.from_parent(self, name=fact["name"], fact=fact, items=items, record=record)


class Lost(Exception):
    """A fact that agreed, or was explained, and does not any more."""


class FactItem(pytest.Item):
    """One fact as a test."""

    def __init__(
        self, *, fact: dict[str, Any], items: list[Any], record: dict[str, Any], **given: Any
    ) -> None:
        super().__init__(**given)
        self.fact = fact
        self.items = items
        self.record = record

    def runtest(self) -> None:
        """Compare the fact with its record."""
        from paper_verdict.facts import NOT_JUDGED, UNEXPLAINED
        from paper_verdict.record import changes

        (change,) = changes([self.fact], self.record) or [None]
        if change is not None and change.lost:
            raise Lost(self._text(change.text))
        if self.fact["status"] == NOT_JUDGED:
            pytest.skip(f"not judged: {self.items[0]['reason'] if self.items else 'no items'}")
        if self.fact["status"] == UNEXPLAINED:
            pytest.xfail(f"recorded: {UNEXPLAINED}")

    def _text(self, first: str) -> str:
        """The change, and the items that differ with the lines of their prints."""
        lines = [first]
        for item in self.items:
            if item["agreement"] is None:
                shown = item["shown"] or "nothing"
                lines.append(
                    f"{self.path.parent / item['source']}: {item['id']}: printed {item['printed']},"
                    f" reproduced {shown}"
                )
        return "\n".join(lines)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The lines above instead of a traceback."""
        if isinstance(excinfo.value, Lost):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where the fact is, and what it says."""
        return self.path.with_name("facts.yaml"), 0, f"{self.name}: {self.fact['says']}"
