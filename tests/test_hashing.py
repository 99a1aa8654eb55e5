"""Hashes of code: what changes them, which steps of the workflow an edit concerns, no stale kernels."""

import hashlib
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


def test_modules_behind_a_module_are_all_it_imports_in_any_form_directly_or_not(tmp_path):
    assert modules_behind("pneumo.physics.symbols") == ["pneumo.physics.symbols"]
    behind = modules_behind("pneumo.simulation.full_order")
    assert behind == sorted(behind)
    assert {f"pneumo.physics.{name}" for name in ("cylinder", "valve")} <= set(behind)
    assert "pneumo.simulation.tableau" in behind and "pneumo.core" in behind
    assert "pneumo.physics.models" not in behind and "pneumo.simulation.reference" not in behind
    together = modules_behind("pneumo.simulation.full_order", "pneumo.physics.models")
    assert together == sorted({*behind, *modules_behind("pneumo.physics.models")})
    file = tmp_path / "script.py"
    lines = ["import numpy, pneumo.storage.files", "import pneumo.simulation.full_order as datum"]
    lines += ["from pneumo.physics import valve", "from pneumo.physics.models import MODELS, lane"]
    lines += ["def later():", "    from pneumo.statistics.averages import statistics", "from os import path"]
    file.write_text("\n".join(lines))
    modules = "storage.files simulation.full_order physics physics.valve physics.models statistics.averages"
    assert imports_of(file) == {f"pneumo.{name}" for name in modules.split()}
    with pytest.raises(ModuleNotFoundError, match=r"no pneumo module 'pneumo\.physics\.nothing'"):
        code_hash("pneumo.physics.nothing")


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


def test_the_hash_ignores_comments_docstrings_and_layout(copy):
    module, file = "pneumo.simulation.full_order", copy / "pneumo/physics/valve.py"
    before = code_hash(module)
    edited(file, "", "\n# edited\n")
    edited(file, '"""Command after the limiter, V: u within -u_max ... u_max."""', '"""Something else."""')
    edited(file, "return min(max(u, -u_max), u_max)", "return min(\n        max(u, -u_max), u_max\n    )")
    assert code_hash(module) == before
    edited(file, "max(u, -u_max)", "max(u, u_max)")
    assert code_hash(module) != before


def test_the_hash_is_the_same_in_every_version_of_python():
    text = "def f(x: float = -0.0, *y) -> None:\n    return {**x, 'a': [1e5, None, (), f'{y!r:>{x}}']} @ x\n"
    tree = hashing._meaning(text)  # written down as Python 3.11, 3.12 and 3.13 give it
    assert hashlib.sha256(tree.encode()).hexdigest()[:16] == "e65e3d54d09b4477"


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
