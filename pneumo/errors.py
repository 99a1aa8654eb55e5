"""Errors that a user can mend, and how they show what a user wrote.

The command line and the jobs of the workflow turn each into one line on standard error and exit code 2.
"""

import reprlib
from pathlib import Path

_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxlist, _REPR.maxdict, _REPR.maxstring, _REPR.maxother = 2, 4, 3, 50, 50


class PneumoError(Exception):
    """Something that the user can mend; its text is one line."""


class ConfigurationError(PneumoError, ValueError):
    """A configuration that cannot be used."""


class InputError(PneumoError, ValueError):
    """Something asked for that cannot be done: a bad argument, a bad measurement, a file in the way."""


class RunError(PneumoError, ArithmeticError):
    """A simulation that its experiment does not allow, or that does not come to its end."""


class ResultError(PneumoError, ValueError):
    """A results file that cannot be used."""


class DamagedError(ResultError):
    """A results file, `path`, whose content is not what was once written under its name."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path


def printable(text: str, longest: int = 80) -> str:
    """Return a text on one line, without control characters, cut where it is long."""
    text = text if len(text) <= longest else f"{text[: longest - 20]}...{text[-17:]}"
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shown(value: object) -> str:
    """Return the representation of a value as far as an error message needs it."""
    try:
        return printable(_REPR.repr(value), 200)
    except ValueError:  # Python writes no integers of more than 4300 digits
        return "an enormous number"
