"""Paths of the repository and dotted names of pneumo in texts, comments and docstrings exist."""

import importlib
import re

from checkout import ROOT, sources

KINDS = (".py", ".md", ".yaml", ".yml", ".smk", ".toml", ".j2", ".cff", ".typ")
TEXTS = {
    name: (ROOT / name).read_text(encoding="utf-8")
    for name in sources()
    if name.endswith((*KINDS, "Makefile", "Snakefile"))
    and name not in ("CHANGELOG.md", "tests/test_references.py")  # history, and names that are absent
}
FOLDERS = "pneumo|workflow|tests|docs|paper|config|benchmarks|data"
SUFFIXES = "py|md|yaml|csv|smk|json|nc|typ|j2|svg|png"
PATH = re.compile(rf"(?<![\w/.{{}}-])(?:{FOLDERS})/[\w./-]*\w\.(?:{SUFFIXES})\b")
NAME = re.compile(r"(?<![\w./-])pneumo(?:\.[A-Za-z_]\w*)+")
ABSENT = {  # on purpose: no such file or name in a test, a file name, a file that locks
    "config/none.yaml",
    "paper/manuscript/wrong.typ",
    "pneumo.egg",
    "pneumo.physics.nothing",
    "pneumo.jobs",
    "pneumo.run",
    "pneumo.simulat",
}


def occurrences(pattern):
    matches = {(name, match) for name, text in TEXTS.items() for match in pattern.findall(text)}
    return sorted(pair for pair in matches if pair[1] not in ABSENT)


def resolves(dotted):
    """Whether a dotted name is a module or something in one."""
    parts = dotted.split(".")
    for length in range(len(parts), 0, -1):
        try:
            value = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            if not hasattr(value, part) and part not in getattr(value, "__annotations__", {}):
                return False
            value = getattr(value, part, None)
        return True
    return False


def test_paths_exist():
    """From the top folder or, in a distribution of its own, from there."""
    missing = [
        (name, path)
        for name, path in occurrences(PATH)
        if not (ROOT / path).exists() and not (ROOT / name).parent.joinpath(path).exists()
    ]
    assert missing == []


def test_dotted_names_exist():
    assert [(name, dotted) for name, dotted in occurrences(NAME) if not resolves(dotted)] == []
