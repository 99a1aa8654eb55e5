"""Copies of papers that a test may spoil."""

import shutil
from pathlib import Path

import pytest
from small_papers import EXAMPLES, TOY


@pytest.fixture
def toy(tmp_path) -> Path:
    """The folder of a small paper in which everything agrees."""
    folder = tmp_path / "toy"
    for name, text in TOY.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def example(tmp_path):
    """Copy of an example by name."""
    return lambda name: Path(shutil.copytree(EXAMPLES / name, tmp_path / name))
