"""The list of mistakes fits the sources: each can be made, at one place."""

import ast

import pytest
from mutations import LIST, ROOT, source


def modules():
    package = ROOT / "pneumo"
    files = (file.relative_to(package).with_suffix("") for file in package.rglob("*.py"))
    return {".".join(file.parts) for file in files if file.name != "__init__"}


def declares_only(module):
    """Whether there is no function and no value to get wrong."""
    tree = ast.parse(source(ROOT, module).read_text(encoding="utf-8"))
    return not any(isinstance(node, ast.FunctionDef | ast.Lambda | ast.Assign) for node in ast.walk(tree))


def test_every_module_is_listed_and_has_three():
    assert set(LIST) <= modules()
    assert {module for module in modules() - set(LIST) if not declares_only(module)} == set()
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
