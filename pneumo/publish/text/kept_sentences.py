"""Sentences of today's advice, for pages of an installed pneumo, which has no evidence beside it.

`make numbers` writes them by `todays_answer.quoted`.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

FILE = Path(__file__).with_name("kept_sentences.json")


class Quoted(NamedTuple):
    """Sentences of the answer for the pages of pneumo."""

    choice: str  #: which model to take, by what is known: two sentences
    in_use: str  #: errors of the full order in an observer and in a controller


@cache
def kept_sentences() -> Quoted:
    """Return the sentences as they were written last."""
    return Quoted(**json.loads(FILE.read_text(encoding="utf-8")))


def keep_sentences(sentences: Quoted) -> None:
    """Write the file that pages quote."""
    FILE.write_text(json.dumps(sentences._asdict(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
