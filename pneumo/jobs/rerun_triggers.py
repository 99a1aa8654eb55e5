"""Reasons for Snakemake to rerun a rule besides its inputs: imported code, and evidence in results."""

import hashlib
import os
import re
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from pneumo.configuration.experiment import Study
from pneumo.hashing import code_hash, imports_of
from pneumo.storage.kept_evidence import evidence_file


def code_behind(script: str, *modules: str) -> Callable[[object], str]:
    """Return a function for a rule: the SHA-256 of all pneumo modules that a script imports, directly or not.

    Snakemake sees edits of a script but not of what it imports; with the hash as a parameter it runs the rule
    again. `modules` are those that the script imports by name at run time. Snakemake calls the function with
    the wildcards of each job that it plans; rules without such jobs, about half, are never hashed.
    """

    @cache
    def of_script() -> str:
        return code_hash(*imports_of(Path("workflow/scripts", script)), *modules)

    return lambda wildcards: of_script()  # noqa: ARG005 - Snakemake looks at its name


def evidence_for(results: str, study: Study, name: str) -> list[str]:
    """Return the file of evidence that was made from this configuration in a list, which may be empty."""
    file = evidence_file(Path(results), name, study.config_sha256)
    return [] if file is None else [os.path.relpath(file)]


def kept_or_made(results: str, study: Study, name: str) -> str:
    """Return the path of evidence made from this configuration, else where it will be made."""
    return (evidence_for(results, study, name) or [f"{results}/{name}"])[0]


def page_templates(template: str) -> list[str]:
    """Return the file of a page's template and those of all that it includes, each once."""
    folders = (Path("pneumo/publish/pages/templates"), Path("paper/study/pages/templates"))
    names, files = [template], list[Path]()
    for name in names:  # grows while it is read
        files.append(next(folder / name for folder in folders if (folder / name).is_file()))
        text = files[-1].read_text(encoding="utf-8")
        included = re.findall(r'{% (?:extends|include|from) "([^"]+)"(?! ignore missing)', text)
        names += [other for other in included if other not in names]
    return [str(file) for file in files]


def fingerprints(files: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of each file, for a rule that reads files which are not its inputs."""
    return {file: hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files}
