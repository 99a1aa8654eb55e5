"""Recorded statuses of facts, ``statuses.csv``, and what has changed since."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from paper_verdict.errors import PaperError, nearest
from paper_verdict.facts import AGREES, MISPRINT, SCATTER, STATUSES, UNEXPLAINED
from paper_verdict.files import read_csv

GOOD = (AGREES, SCATTER)


class Record(NamedTuple):
    """What ``statuses.csv`` says of a fact."""

    status: str
    agree: int | None  # items that agreed; older records do not say


class Change(NamedTuple):
    """A fact whose status, or number of agreeing items, is not the recorded one."""

    fact: Mapping[str, Any]
    was: str  # in words
    lost: bool  # whether something that agreed no longer does

    @property
    def text(self) -> str:
        """The change in one line."""
        now = f"{self.fact['status']}, {self.fact['agree']} of {self.fact['items']} items within tolerance"
        return f"{self.fact['name']}: was {self.was}, is {now}"


def read_record(folder: Path, facts: Sequence[str]) -> dict[str, Record]:
    """Recorded statuses by fact; empty without a record; `PaperError` for unknown facts or statuses."""
    file = folder / "statuses.csv"
    if not file.exists():
        return {}
    record: dict[str, Record] = {}
    for row in read_csv(file):
        name = row.get("fact", "")
        status = row.get("status", "")
        remedy = "correct it, or record again with --record"
        if name not in facts:
            raise PaperError(f"{row.place}: {name!r}: no such fact{nearest(name, facts)}; {remedy}")
        if status not in STATUSES:
            raise PaperError(f"{row.place}: {status!r}: no such status{nearest(status, STATUSES)}; {remedy}")
        if name in record:
            raise PaperError(f"{row.place}: {name!r}: is there twice; remove one")
        agree = row.get("agree", "")
        record[name] = Record(status, int(agree) if agree.isdigit() else None)
    return record


def changes(facts: Sequence[Mapping[str, Any]], record: Mapping[str, Record]) -> list[Change]:
    """Facts that differ from their record, or have none."""
    found: list[Change] = []
    for fact in facts:
        known = record.get(fact["name"])
        if known is None:
            found.append(Change(fact, "not recorded", fact["status"] == UNEXPLAINED))
            continue
        fewer = known.agree is not None and fact["agree"] < known.agree
        worse = known.status in GOOD and fact["status"] not in GOOD
        unproved = known.status == MISPRINT and fact["status"] == UNEXPLAINED
        if (
            fewer
            or known.status != fact["status"]
            or (known.agree is not None and known.agree != fact["agree"])
        ):
            was = known.status if known.agree is None else f"{known.status}, {known.agree} items"
            found.append(Change(fact, was, fewer or worse or unproved))
    return found


def record_text(facts: Sequence[Mapping[str, Any]]) -> str:
    """Content of ``statuses.csv``."""
    rows = sorted(f'{fact["name"]},"{fact["status"]}",{fact["agree"]}' for fact in facts)
    return "\n".join(["fact,status,agree", *rows, ""])
