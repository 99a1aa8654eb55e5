"""Hashes of code: what changes them, which steps of the workflow an edit concerns, no stale kernels."""

import re
import subprocess
import sys

import pytest

from pneumo import hashing
from pneumo.hashing import code_hash, imports_of, modules_behind
from pneumo.jobs.rerun_triggers import code_behind
from tests.checkout import ROOT, copy_checkout, edit

STEPS = ["datum.py", "settling.py", "replay.py", "statistics.py"]


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the checkout that the hashes look at."""
    monkeypatch.setattr(hashing, "ROOT", copy_checkout(tmp_path / "checkout") / "pneumo")
    monkeypatch.chdir(tmp_path / "checkout")
    return tmp_path / "checkout"


def edited(file, old="", new="\nEDITED = 1\n"):
    if old:
        edit(file, old, new)
    else:
        file.write_text(file.read_text(encoding="utf-8") + new, encoding="utf-8")


LOADED = """
import sys
for names in {names}:
    for module in [name for name in sys.modules if name.startswith("pneumo")]:
        del sys.modules[module]
    for name in names:
        __import__(name)
    print(*[name for name in sys.modules if name.startswith("pneumo")])
"""


CORE = {
    "pneumo.core._core",
    "pneumo.core._core.lib",
}  # compiled from sources that the hash of `pneumo.core` covers


def test_nothing_is_loaded_that_the_hash_does_not_cover_in_any_form_of_import():
    imported = [sorted(imports_of(ROOT / "workflow" / "scripts" / script)) for script in STEPS]
    program = LOADED.format(names=imported)
    output = subprocess.check_output([sys.executable, "-c", program], cwd=ROOT, text=True)
    rooms = {".".join(file.parent.relative_to(ROOT).parts) for file in (ROOT / "pneumo").rglob("__init__.py")}
    for names, loaded in zip(imported, output.splitlines(), strict=True):
        assert set(loaded.split()) - rooms - CORE <= set(
            modules_behind(*names)
        )  # __init__.py holds a sentence each
    for file in (ROOT / "pneumo").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"^\s*from\s+\.", text, re.MULTILINE), f"{file.name}: relative import"


def test_an_edit_of_an_imported_module_changes_the_hash_and_of_an_unrelated_one_does_not(copy):
    before = code_hash("pneumo.simulation.full_order")
    assert re.fullmatch("[0-9a-f]{64}", before)
    edited(copy / "pneumo/publish/style.py")
    edited(copy / "pneumo/physics/models.py")
    assert code_hash("pneumo.simulation.full_order") == before
    edited(copy / "pneumo/physics/valve.py")
    assert code_hash("pneumo.simulation.full_order") != before
    edited(copy / "pneumo/physics/valve.py", "\nEDITED = 1\n", "")
    assert code_hash("pneumo.simulation.full_order") == before
    # So do two modules that swap their text.
    names = "pneumo.physics.cylinder", "pneumo.physics.chamber"
    before = code_hash(*names)
    files = [copy / f"{name.replace('.', '/')}.py" for name in names]
    for file, text in zip(files, [file.read_text() for file in reversed(files)], strict=True):
        file.write_text(text)
    assert code_hash(*names) != before


@pytest.mark.parametrize(
    ("file", "old", "new", "changed"),
    [
        ("physics/models.py", "1.2,     1.4,     1.0", "1.3,     1.4,     1.0", {"replay.py"}),
        ("simulation/reference.py", "", "\nEDITED = 1\n", set()),
        ("core/rates.h", "1.0 / 5", "1.0 / 6", {"datum.py", "settling.py", "replay.py"}),
        ("simulation/excitation.py", "", "\nEDITED = 1\n", {"datum.py", "settling.py", "replay.py"}),
        ("physics/chamber.py", "", "\nEDITED = 1\n", {"replay.py"}),
        ("statistics/averages.py", "", "\nEDITED = 1\n", {"statistics.py"}),
        ("publish/style.py", "", "\nEDITED = 1\n", set()),
        ("storage/files.py", "", "\nEDITED = 1\n", set()),
        ("storage/layout.py", "", "\nEDITED = 1\n", {"datum.py", "settling.py", "replay.py"}),
    ],
)
def test_which_steps_of_the_workflow_an_edit_concerns(copy, file, old, new, changed):
    before = {step: code_behind(step)(None) for step in STEPS}
    edited(copy / "pneumo" / file, old, new)
    assert {step for step in STEPS if code_behind(step)(None) != before[step]} == changed
