"""Errors of those who judge a paper: one line with file, place, what is wrong and what to do."""

import difflib
import traceback
from collections.abc import Iterable
from pathlib import Path

PACKAGE = str(Path(__file__).parent)
MOST_LISTED = 8  # names that a message lists when none is near


class PaperError(ValueError):
    """A file of the paper or of the results is missing or wrong; the text is one line that says where."""


def nearest(name: str, known: Iterable[str]) -> str:
    """End of a message about an unknown name: the nearest known one, or those there are.

    Examples
    --------
    >>> nearest("densty", ["density", "mass"])
    "; did you mean 'density'?"
    >>> nearest("colour", ["density", "mass"])
    '; there are density, mass'
    >>> nearest("colour", [])
    '; there is none'
    """
    names = list(dict.fromkeys(map(str, known)))
    close = difflib.get_close_matches(name, names, 1, 0.6)
    if not close:
        close = [each for each in names if each.casefold() == name.casefold().strip()]
    if close:
        return f"; did you mean {close[0]!r}?"
    if not names:
        return "; there is none"
    more = " ..." if len(names) > MOST_LISTED else ""
    return f"; there are {', '.join(names[:MOST_LISTED])}{more}"


def user_traceback(error: BaseException) -> str:
    """Traceback of an error in a user's code, without the frames of this package, and its notes.

    Empty where no function of the user was called.
    """
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith((PACKAGE, "<frozen"))]
    if all("site-packages" in frame.filename for frame in own):
        return ""
    called = "".join(traceback.format_list(own) + traceback.format_exception_only(error))
    return f"Traceback (most recent call last):\n{called}"
