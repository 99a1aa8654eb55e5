"""The paper's configuration as the study that most tests use."""

from pathlib import Path

from pneumo.configuration.parameters import load, study

STUDY = study(load(Path(__file__).parents[1] / "config/paper.yaml"))
