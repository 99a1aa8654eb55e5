"""Pages of the study: report and verdict."""

from pathlib import Path

STUDY_TEMPLATES = Path(__file__).parent / "templates"
