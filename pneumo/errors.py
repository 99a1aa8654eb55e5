"""Errors that a user can correct, and the form of a user's text in them.

The command line and the jobs of the workflow turn each into one line on standard error and exit code 2.
"""

import reprlib
from pathlib import Path

_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxlist, _REPR.maxdict, _REPR.maxstring, _REPR.maxother = 2, 4, 3, 50, 50


class PneumoError(Exception):
    """Error that the user can correct; its text is one line."""


class ConfigurationError(PneumoError, ValueError):
    """Invalid configuration."""


class InputError(PneumoError, ValueError):
    """Invalid argument or record, or an output file that is not writable or already exists."""


class RunError(PneumoError, ArithmeticError):
    """Simulation that its experiment does not allow, or that failed."""


class ResultError(PneumoError, ValueError):
    """Results file that is missing, damaged or from another study."""


class DamagedError(ResultError):
    """Results file, `path`, whose content has changed since it was written."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path


def printable(text: str, longest: int = 80) -> str:
    """Return a text as one line without control characters, shortened in the middle to `longest`."""
    text = text if len(text) <= longest else f"{text[: longest - 20]}...{text[-17:]}"
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shown(value: object) -> str:
    """Return the representation of a value, shortened for an error message."""
    try:
        return printable(_REPR.repr(value), 200)
    except ValueError:  # Python writes no integers of more than 4300 digits
        return "an enormous number"
