"""The study that the Snakefile plans, checked before any job starts."""

import os
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pneumo.configuration.experiment import Study
from pneumo.configuration.parameters import Sources, read_yaml, study
from pneumo.configuration.plausible_cylinders import checked
from pneumo.configuration.priors import uncertainties
from pneumo.configuration.schema_parts import merged
from pneumo.errors import ConfigurationError, as_lines

BASE = Path("config/paper.yaml")


def find_checkout() -> None:
    """Let the scripts of jobs import `paper.study`, `workflow.jobs` and `paper_verdict` from the checkout."""
    given = filter(None, [os.environ.get("PYTHONPATH")])
    os.environ["PYTHONPATH"] = os.pathsep.join([".", "paper-verdict/src", *given])


def as_written(files: Sequence[Path], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the merged configuration of a run, read as `pneumo` reads files, not by the rules of YAML 1.1.

    If a file cannot be read, ends the process with exit code 2 and one line on standard error.
    """
    content: dict[str, Any] = {}
    try:
        for file in (BASE, *files):
            content = merged(content, read_yaml(Path(os.path.relpath(file))))
    except ConfigurationError as error:
        print(as_lines(error), file=sys.stderr)
        sys.exit(2)
    return merged(content, options)


def without_trust(options: Mapping[str, Any]) -> tuple[dict[str, Any], bool]:
    """Return the ``--config`` options of a run without ``trust``, and whether it is there and true.

    Examples
    --------
    >>> without_trust({"trust": "true", "step_s": 0.002})
    ({'step_s': 0.002}, True)
    """
    trust = str(options.get("trust")).lower() == "true"  # Snakemake reads the word as text
    return {key: value for key, value in options.items() if key != "trust"}, trust


def results_folder(files: Sequence[Path], options: Mapping[str, Any]) -> str:
    """Return the folder that a run fills: `results`, or another one for files or options on top.

    Examples
    --------
    >>> results_folder([], {}), results_folder([Path("my.yaml"), Path("more.yaml")], {})
    ('results', 'results-my-more')
    """
    own = [Path(file) for file in files if Path(file).resolve() != BASE.resolve()]
    names = [re.sub(r"[^\w.-]", "_", file.stem) for file in own] or ["config"] * bool(options)
    return "-".join(["results", *names])


def checked_study(
    config: Mapping[str, Any], files: Sequence[Path], options: Mapping[str, Any], *, trust: bool = False
) -> Study:
    """Return the study of a merged Snakemake configuration.

    `trust` accepts an implausible study. If a value is invalid, ends the process with exit code 2 and
    one line on standard error, which names its source among the `files` and ``--config`` `options` of the
    command line.
    """
    try:
        parts = [(os.path.relpath(file), read_yaml(file)) for file in (BASE, *files)]
        sources = Sources(dict(config), [*parts, ("--config", options)], table=None)
        return study(checked(sources, trust=trust))
    except ConfigurationError as error:
        print(as_lines(error), file=sys.stderr)
        sys.exit(2)


def limits_of_cylinders(config: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return the content of `Uncertain` of each cylinder, from a checked configuration."""
    return {name: list(known) for name, known in uncertainties(Sources(config).validated()).items()}


def user_cylinders(study: Study) -> list[str]:
    """Return the cylinders of a study that has other experiments than the paper's, else an empty list."""
    if set(study.experiments) <= set(read_yaml(BASE)["experiments"]):
        return []
    return list(dict.fromkeys(e.cylinder for e in study.experiments.values()))
