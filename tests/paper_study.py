"""The paper's configuration as the study that most tests use."""

from pathlib import Path

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.parameters import load, study

STUDY = study(load(Path(__file__).parents[1] / "config/paper.yaml"))


def lasting(name: str, seconds: float) -> Experiment:
    """Return an experiment of the paper, but of this duration."""
    e = STUDY.experiments[name]
    return e._replace(steps=round(seconds / e.h))
