"""Decisions are short and listed once; every reference to one finds it."""

import re
from collections import Counter

import pytest
from checkout import ROOT, sources

FOLDER = ROOT / "paper/decisions"
FILES = {file.stem[:4]: file for file in sorted(FOLDER.glob("[0-9]*.md"))}
MOST_LINES = 15  # below the title
NAMED = re.compile(r"\bdecisions/(\d{4})((?:-[a-z0-9]+)*)")
NUMBERED = re.compile(r"\b[Dd]ecisions? (\d+(?:(?:, | and )\d+)*)\b")
BARE = re.compile(r"(?<![\w.])(0[01]\d\d)(?![\w.]*\d)")  # in a decision
HISTORY = ("CHANGELOG.md", "tests/test_decisions.py")  # may name what was folded or never was


def broken_references(text: str, in_decision: bool = False) -> list[str]:
    """References to decisions, in a text, for which there is no file."""
    files = {match[0]: (f"{FILES.get(match[1], '')}", f"{match[2]}.md") for match in NAMED.finditer(text)}
    named = [reference for reference, (file, end) in files.items() if not file.endswith(end)]
    numbers = [f"{int(n):04}" for match in NUMBERED.finditer(text) for n in re.findall(r"\d+", match[1])]
    bare = BARE.findall(text) if in_decision else []
    return named + [number for number in numbers + bare if number not in FILES]


@pytest.mark.parametrize("number", FILES)
def test_a_decision_is_short_and_no_other_has_its_number(number):
    title, *lines = FILES[number].read_text(encoding="utf-8").splitlines()
    assert title.startswith(f"# {int(number)}. ")
    assert sum(map(bool, lines)) <= MOST_LINES
    assert len(list(FOLDER.glob(f"{number}*"))) == 1


def test_the_index_lists_each_decision_once():
    index = (FOLDER / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^- \[(\d{4})\]\((.*)\) (.*)$", index, re.MULTILINE)
    folded = re.findall(r"^- (\d{4}): in (\d{4})$", index, re.MULTILINE)
    assert len(listed) + len(folded) == index.count("\n- ")
    assert set(Counter([entry[0] for entry in (*listed, *folded)]).values()) == {1}
    assert {number for number, *_ in listed} == set(FILES)
    assert not {number for number, _ in folded} & set(FILES) and {into for _, into in folded} <= set(FILES)
    for number, file, title in listed:
        assert file == FILES[number].name
        assert FILES[number].read_text(encoding="utf-8").partition(". ")[2].startswith(title)


@pytest.mark.parametrize(
    "text",
    ["paper/decisions/9999", "decisions/0034-another-name", "decisions 10, 12 and 37", "(Decision 25)"],
)
def test_a_broken_reference_is_noticed(text):
    assert broken_references(text) and not broken_references("0.0012, decisions/0034 and decision 10")


def test_every_reference_finds_its_decision():
    broken = {}
    for name in set(sources()) - set(HISTORY):
        file = ROOT / name
        if file.suffix not in (".nc", ".png", ".csv", ".svg") and not name.endswith("decisions/README.md"):
            text = file.read_text(encoding="utf-8", errors="ignore")
            broken[name] = broken_references(text, in_decision=file.parent == FOLDER)
    assert {name: lines for name, lines in broken.items() if lines} == {}
