"""Generated blocks of README.md: `make numbers` writes them, `make lint` checks that they are current."""

from collections import Counter
from collections.abc import Mapping

from fragments import ROOT, STATUSES, stored_numbers

from pneumo.verdict.judging import read_statuses


def study_answer() -> str:
    """What `pneumo study` answers for the template's cylinder."""
    return f"```text\n{stored_numbers()['study']['answer']}\n```"


def judged() -> str:
    """How many items of both papers agree."""
    counts, second = stored_numbers()["verdict"]["counts"], read_statuses(ROOT / "paper/2007")
    return (
        f"Of {counts['items']} numbers and statements: {_counted(counts)}.\n"
        f"Of {len(second)} of the sequel of 2007: {_counted(Counter(second.values()))}."
    )


def _counted(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status])
