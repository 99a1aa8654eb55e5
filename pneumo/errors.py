"""Errors that a user can correct, and the form of a user's text in them.

The command line and the jobs of the workflow turn each into one line on standard error and exit code 2.
"""

import errno
import reprlib

# Of a disk or of the system's limits, not of a file: full, not writable, failing, gone, too many open files.
SYSTEM = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO, errno.ESTALE),
    *(errno.ETIMEDOUT, errno.EMFILE, errno.ENFILE, errno.ENXIO, errno.ENODEV),
}
MOST_ROWS = 20  # of a table, named in one message
_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxlist, _REPR.maxdict, _REPR.maxstring, _REPR.maxother = 2, 4, 3, 50, 50


class PneumoError(Exception):
    """Error that the user can correct; its text is one line."""


class ConfigurationError(PneumoError, ValueError):
    """Invalid configuration: a line, or one for each of the first `MOST_ROWS` wrong rows of a table."""

    def __str__(self) -> str:
        more = [f"and {len(self.args) - MOST_ROWS} more rows"] if len(self.args) > MOST_ROWS else []
        return "\n".join([*self.args[:MOST_ROWS], *more])


class InputError(PneumoError, ValueError):
    """Invalid argument or record, or an output file that is not writable or already exists."""


class RunError(PneumoError, ArithmeticError):
    """Simulation that its experiment does not allow, or that failed."""


class ResultError(PneumoError, ValueError):
    """Results file that is missing, damaged or from another study."""


class InstallationError(PneumoError, ImportError):
    """Checkout whose core is not compiled."""


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


def as_lines(error: Exception | str) -> str:
    """Return the line for the user; several for wrong rows of a table.

    Examples
    --------
    >>> as_lines(InputError("n = 0: must be  positive"))
    'pneumo: n = 0: must be positive'
    """
    rows = isinstance(error, ConfigurationError) and len(error.args) > 1
    lines = str(error).splitlines() if rows else [str(error)]
    return "\n".join(f"pneumo: {printable(' '.join(line.split()), 1000)}" for line in lines)
