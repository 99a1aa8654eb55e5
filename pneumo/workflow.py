"""What the Snakefile needs from the package: a checked configuration and hashes of code."""

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pneumo.physics.experiment import Study
from pneumo.physics.parameters import ConfigurationError, read_yaml, study, validated
from pneumo.provenance import code_hash, imports_of

BASE = Path("config/paper.yaml")


def checked_study(config: Mapping[str, Any], files: Sequence[Path], options: Mapping[str, Any]) -> Study:
    """Return the study that a merged Snakemake configuration describes.

    Ends the process with exit code 2 and one line on standard error if it describes none.

    Parameters
    ----------
    config : mapping
        The merged configuration.
    files : sequence of pathlib.Path
        Configuration files given on the command line.
    options : mapping
        Values given on the command line with ``--config``.
    """
    try:
        sources = [(os.path.relpath(file), read_yaml(file)) for file in (BASE, *files)]
        return study(validated(config, [*sources, ("--config", options)]))
    except ConfigurationError as error:
        print(f"pneumo: {error}", file=sys.stderr)
        sys.exit(2)


def code_behind(script: str) -> str:
    """SHA-256 of every pneumo module that a workflow script imports, directly or not.

    Snakemake sees edits of a script but not of what it imports; as a rule's parameter this makes
    it rerun the rule.
    """
    return code_hash(*imports_of(Path("workflow/scripts", script)))
