"""The study that the Snakefile plans, checked before any job starts."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pneumo.configuration.experiment import Study
from pneumo.configuration.known_within import known_within
from pneumo.configuration.parameters import merged, read_yaml, study, validated
from pneumo.errors import ConfigurationError

BASE = Path("config/paper.yaml")


def as_written(files: Sequence[Path], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the merged configuration of a run, read as `pneumo` reads files, not by the rules of YAML 1.1.

    If a file cannot be read, ends the process with exit code 2 and one line on standard error.
    """
    content: dict[str, Any] = {}
    try:
        for file in (BASE, *files):
            content = merged(content, read_yaml(Path(os.path.relpath(file))))
    except ConfigurationError as error:
        print(f"pneumo: {error}", file=sys.stderr)
        sys.exit(2)
    return merged(content, options)


def checked_study(config: Mapping[str, Any], files: Sequence[Path], options: Mapping[str, Any]) -> Study:
    """Return the study of a merged Snakemake configuration.

    If a value is invalid, ends the process with exit code 2 and one line on standard error, which names its
    source among the `files` and ``--config`` `options` of the command line.
    """
    try:
        sources = [(os.path.relpath(file), read_yaml(file)) for file in (BASE, *files)]
        return study(validated(config, [*sources, ("--config", options)]))
    except ConfigurationError as error:
        print(f"pneumo: {error}", file=sys.stderr)
        sys.exit(2)


def k_0_factors(config: Mapping[str, Any]) -> dict[str, float]:
    """Return the factor within which k_0 is known, by cylinder, from a checked configuration."""
    return known_within(validated(config, []))


def user_cylinders(study: Study) -> list[str]:
    """Return the cylinders of a study that has other experiments than the paper's, else an empty list."""
    if set(study.experiments) <= set(read_yaml(BASE)["experiments"]):
        return []
    return list(dict.fromkeys(e.cylinder for e in study.experiments.values()))
