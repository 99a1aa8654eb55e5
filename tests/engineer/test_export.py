"""Exported code, compiled and run by what it is for, against the right-hand side it was printed from."""

import ctypes
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from plain_rates import EVERY, OWN, plain_rate, rate_size

from pneumo import MODELS
from pneumo.cli.commands import main
from pneumo.engineer.export import TARGETS, exported
from pneumo.errors import InputError
from pneumo.physics.valve import limited

N = 1.35
C_COMPILER = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


def difference(found, model, plant, states):
    """Largest difference from the right-hand side, over the size of its terms."""
    ratios = []
    for (u, x, v, *pressures), rates in zip(states.tolist(), found, strict=True):
        for side, P, rate in zip("AB", pressures, rates, strict=True):
            state = model, N, plant, limited(u, plant.valve.u_max), x, v, P, side
            ratios.append(abs(rate - plain_rate(*state)) / rate_size(*state))
    return np.max(ratios)


def run_c(model, plant, states, folder, precision="double"):
    (folder / "model.c").write_text(exported(model, N, plant, "c", precision))
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wno-missing-prototypes", "-Werror"]
    flags = [*strict, "-O1", "-shared", "-fPIC", "-o", "model.so"]
    subprocess.run(["gcc", *flags, "model.c", "-lm"], cwd=folder, check=True)
    real = ctypes.c_double if precision == "double" else ctypes.c_float
    function = getattr(ctypes.CDLL(str(folder / "model.so")), f"{model.name}_dP_dt")
    function.argtypes = [real] * 5 + [ctypes.POINTER(real)] * 2
    function.restype = None
    A, B = real(), real()
    found = np.empty((len(states), 2))
    for i, state in enumerate(states.tolist()):
        function(*state, ctypes.byref(A), ctypes.byref(B))
        found[i] = A.value, B.value
    return found


def run_octave(models, plant, states, folder):
    """Rates by several models in one process."""
    np.savetxt(folder / "states.txt", states, fmt="%.17g")
    lines = ["s = load('states.txt');", "r = zeros(rows(s), 2);"]
    for model in models:
        name = f"{model.name}_dP_dt"
        (folder / f"{name}.m").write_text(exported(model, N, plant, "matlab"))
        call = f"[r(i, 1), r(i, 2)] = {name}(s(i, 1), s(i, 2), s(i, 3), s(i, 4), s(i, 5));"
        write = f"f = fopen('{model.name}.bin', 'w'); fwrite(f, r', 'double'); fclose(f);"
        lines += ["for i = 1:rows(s)", call, "end", write]
    (folder / "compare.m").write_text("\n".join(lines))
    subprocess.run(["octave-cli", "--norc", "--quiet", "compare.m"], cwd=folder, check=True)
    return [np.fromfile(folder / f"{model.name}.bin").reshape(-1, 2) for model in models]


def run_casadi(model, plant, states, folder):
    (folder / "model.py").write_text(exported(model, N, plant, "casadi"))
    function = runpy.run_path(str(folder / "model.py"))[f"{model.name}_dP_dt"]
    return np.hstack([np.asarray(rate).T for rate in function.map(len(states))(*states.T[:, None, :])])


@C_COMPILER
@pytest.mark.parametrize("model", EVERY, ids=lambda model: model.name)
def test_c(model, plant, random_states, tmp_path):
    assert difference(run_c(model, plant, random_states, tmp_path), model, plant, random_states) < 1e-12


@C_COMPILER
def test_c_in_single_precision(plant, random_states, tmp_path):
    states = random_states[:1000]
    found = run_c(MODELS["M10"], plant, states, tmp_path, "float")
    assert 1e-9 < difference(found, MODELS["M10"], plant, states) < 1e-3
    assert "double" not in (tmp_path / "model.c").read_text()


@C_COMPILER
@pytest.mark.parametrize(
    ("part", "unusual"),
    [
        ("valve", {"laminar": 0.05}),
        ("valve", {"exhaust": 0.7, "leak": 1e-8}),
        ("gas", {"elliptic": True, "critical_ratio": 0.3}),
    ],
)
def test_c_of_an_unusual_valve(plant, random_states, tmp_path, part, unusual):
    plant = plant._replace(**{part: getattr(plant, part)._replace(**unusual)})
    found = run_c(MODELS["M8"], plant, random_states, tmp_path)
    assert difference(found, MODELS["M8"], plant, random_states) < 1e-12


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="GNU Octave is not installed")
def test_matlab(plant, random_states, tmp_path):
    models = [MODELS["M4"], MODELS["M10"]]
    for model, found in zip(models, run_octave(models, plant, random_states, tmp_path), strict=True):
        assert difference(found, model, plant, random_states) < 1e-12


@pytest.mark.parametrize("model", EVERY, ids=lambda model: model.name)
def test_casadi(model, plant, random_states, tmp_path):
    pytest.importorskip("casadi", reason="CasADi is not installed")
    assert difference(run_casadi(model, plant, random_states, tmp_path), model, plant, random_states) < 1e-12


def test_states_take_every_branch(plant, random_states):
    u, _, _, P, _ = random_states.T
    c, r = plant.conditions, plant.gas.critical_ratio
    assert min(np.sum(u < -plant.valve.u_max), np.sum(u > plant.valve.u_max)) > 100
    for where, port, highest in ((u > 0, c.P_s, 2), (u < 0, c.P_atm, 1 / r)):
        counts, _ = np.histogram(P[where] / port, [0, r, 1, highest])
        assert counts.min() > 10


@pytest.mark.parametrize("target", TARGETS)
def test_source_names_model_units_and_equations(target, plant):
    text = exported("M8", N, plant, target)
    for words in ("M8", "n = 1.35", "10.1243/09596518JSCE203", "eq (6)", "eqs (1), (2)", "Pa/s", "eq (13)"):
        assert words in text
    assert "1.3999999999999999" in text  # 17 digits
    assert "area_ratio" not in text  # only what the model needs
    assert text.isascii()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"model": "M99"}, "M99"),
        ({"n": 0.0}, "n = 0"),
        ({"n": 3.5}, "n = 3.5"),
        ({"n": None}, "n: M8 needs"),
        ({"target": "fortran"}, "fortran"),
        ({"precision": "half"}, "half"),
        ({"target": "matlab", "precision": "float"}, "float"),
        ({"model": OWN._replace(name="my model")}, "my model"),
    ],
)
def test_bad_exports_are_refused(arguments, words, plant):
    given = {"model": "M8", "n": N, "plant": plant, "target": "c", "precision": "double"} | arguments
    with pytest.raises(InputError, match=words):
        exported(**given)


# The command

PAPER = str(Path(__file__).parents[2] / "config/paper.yaml")


@pytest.fixture
def export(monkeypatch, capsys):
    """Run `pneumo export M8` in this process; returns exit code, output and error text."""

    def run(**changes):
        options = {"n": "1.35", "cylinder": "D", "k0": "0.5", "to": "c", "config": PAPER} | changes
        words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
        monkeypatch.setattr(sys, "argv", ["pneumo", "export", "M8", *words])
        with pytest.raises(SystemExit) as stopped:
            main()
        return stopped.value.code or 0, *capsys.readouterr()

    return run


def test_command_writes_or_prints_the_source(export, plant, tmp_path):
    file = tmp_path / "m8.c"
    assert export(output=file) == (0, "", "")
    assert file.read_text() == exported("M8", N, plant, "c")
    assert [path.name for path in tmp_path.iterdir()] == ["m8.c"]
    assert export(to="casadi") == (0, exported("M8", N, plant, "casadi"), "")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cylinder": "F"}, "there are D, E"),
        ({"k0": "-1"}, "k_0 = -1"),
        ({"to": "fortran"}, "there are c, matlab, casadi"),
        ({"config": "config/none.yaml"}, "config/none.yaml"),
        ({"output": "."}, ": is a folder"),
        ({"output": "file/out.c"}, "file/out.c: cannot be written"),
    ],
)
def test_command_refuses_in_one_line_and_writes_nothing(changes, words, export, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    code, out, error = export(**{"output": "out.c"} | changes)
    assert (code, out, len(error.splitlines())) == (2, "", 1)
    assert error.startswith("pneumo: ") and words in error
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
