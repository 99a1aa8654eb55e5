"""Pages of the study: report and verdict; symbol and meaning of each status."""

from pathlib import Path

STUDY_TEMPLATES = Path(__file__).parent / "templates"
STATUS_LOOKS = {  # status -> symbol, for readers without colour, and meaning
    "exact": ("=", "equal at the printed digits, or true as stated"),
    "close": ("≈", "inside its tolerance class"),
    "explained": (
        "†",
        "differs; one named erratum, or one alternative assumption for the whole study, explains it",
    ),
    "contradicted": ("≠", "false, also by the paper's own formulas or tables"),
    "missed": ("!", "differs, and nothing explains it"),
}
