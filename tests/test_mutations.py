"""The list of mistakes fits the sources: each can be made, at one place, in every module with code."""

import ast

import pytest
from mutations import LIST, ROOT, source

WITHOUT_CODE = {"physics.experiment", "apply.errors"}  # named tuples or an exception alone


def modules():
    package = ROOT / "pneumo"
    files = (file.relative_to(package).with_suffix("") for file in package.rglob("*.py"))
    return {".".join(file.parts) for file in files if file.name != "__init__"} - WITHOUT_CODE


def test_every_module_has_three():
    assert set(LIST) == modules()
    assert all(len(entry["changes"]) >= 3 for entry in LIST.values())


@pytest.mark.parametrize("module", LIST)
def test_every_mistake_can_be_made(module):
    text = source(ROOT, module).read_text(encoding="utf-8")
    for old, new in LIST[module]["changes"]:
        assert text.count(old) == 1, old
        assert old != new
        ast.parse(text.replace(old, new))
    files = [test for test in LIST[module]["tests"] if test.endswith(".py")]
    assert all((ROOT / file).exists() for file in files), files
