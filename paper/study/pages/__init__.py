"""Pages of the study: report and verdict; look and meaning of each status of a fact."""

from pathlib import Path

from paper_verdict.facts import AGREES, EXPLAINED, MISPRINT, NOT_JUDGED, SCATTER, UNEXPLAINED

STUDY_TEMPLATES = Path(__file__).parent / "templates"
STATUS_LOOKS = {  # status -> look, symbol for readers without colour, and meaning
    AGREES: ("exact", "=", "equal at the printed digits, within the reading of a figure, or close"),
    SCATTER: ("close", "≈", "differs by no more than other random numbers would change it"),
    MISPRINT: ("explained", "†", "differs; a misprint, proved from the paper alone, accounts for it"),
    EXPLAINED: (
        "explained",
        "≠",
        "differs; the paper's own numbers, or an argument from the results, account for it",
    ),
    UNEXPLAINED: ("missed", "!", "differs, and nothing accounts for it"),
    NOT_JUDGED: ("unknown", "·", "cannot fail, or was not run"),
}
