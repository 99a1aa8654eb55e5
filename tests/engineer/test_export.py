"""Exported code, compiled and run by what it is for, against the right-hand side it was printed from."""

import ctypes
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pneumo import MODELS, Model
from pneumo.cli.commands import main
from pneumo.engineer.export import TARGETS, exported
from pneumo.errors import InputError
from pneumo.physics.models import lane
from pneumo.physics.valve import limited
from pneumo.simulation.reference import lane_rate

OWN = Model("own", "n", "gamma", 1.1, "polytropic", True, "lambda_0 A_q")
EVERY = [*MODELS.values(), OWN]
N = 1.35


def expected(model, plant, states):
    """Rates of both chambers, and their size before terms cancel, shape (states, 2) each."""
    row, cylinder = lane(model, N, plant.gas.gamma), plant.cylinder
    rates, sizes = np.empty((len(states), 2)), np.empty((len(states), 2))
    for i, (u, x, v, *pressures) in enumerate(states.tolist()):
        u = limited(u, plant.valve.u_max)
        for side, (sign, area, P) in enumerate(
            zip((1, -1), (cylinder.A_A, cylinder.A_B), pressures, strict=True)
        ):
            V = cylinder.V_d + area * (cylinder.stroke / 2 + sign * x)
            rest = lane_rate(sign * u, sign * x, 0.0, P, area, plant, row)
            rates[i, side] = lane_rate(sign * u, sign * x, sign * v, P, area, plant, row)
            sizes[i, side] = abs(rest) + plant.gas.gamma * P * area * abs(v) / V
    return rates, sizes


def difference(found, model, plant, states):
    """Largest difference from the right-hand side, over the size of its terms."""
    rates, sizes = expected(model, plant, states)
    return float(np.max(np.abs(found - rates) / sizes))


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
        lines += [
            "for i = 1:rows(s)",
            f"[r(i, 1), r(i, 2)] = {name}(s(i, 1), s(i, 2), s(i, 3), s(i, 4), s(i, 5));",
            "end",
            f"f = fopen('{model.name}.bin', 'w'); fwrite(f, r', 'double'); fclose(f);",
        ]
    (folder / "compare.m").write_text("\n".join(lines))
    subprocess.run(["octave-cli", "--norc", "--quiet", "compare.m"], cwd=folder, check=True)
    return [np.fromfile(folder / f"{model.name}.bin").reshape(-1, 2) for model in models]


def run_casadi(model, plant, states, folder):
    (folder / "model.py").write_text(exported(model, N, plant, "casadi"))
    function = runpy.run_path(str(folder / "model.py"))[f"{model.name}_dP_dt"]
    return np.hstack([np.asarray(rate).T for rate in function.map(len(states))(*states.T[:, None, :])])


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
@pytest.mark.parametrize("model", EVERY, ids=lambda model: model.name)
def test_c(model, plant, random_states, tmp_path):
    assert difference(run_c(model, plant, random_states, tmp_path), model, plant, random_states) < 1e-12


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
def test_c_in_single_precision(plant, random_states, tmp_path):
    states = random_states[:1000]
    found = run_c(MODELS["M10"], plant, states, tmp_path, "float")
    assert 1e-9 < difference(found, MODELS["M10"], plant, states) < 1e-3
    assert "double" not in (tmp_path / "model.c").read_text()


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
@pytest.mark.parametrize(
    "unusual", [{"laminar": 0.05}, {"exhaust": 0.7, "leak": 1e-8}, {"elliptic": True, "critical_ratio": 0.3}]
)
def test_c_of_an_unusual_valve(plant, random_states, tmp_path, unusual):
    if "elliptic" in unusual:
        plant = plant._replace(gas=plant.gas._replace(**unusual))
    else:
        plant = plant._replace(valve=plant.valve._replace(**unusual))
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
    for where, port in ((u > 0, c.P_s), (u < 0, c.P_atm)):
        ratio = P[where] / port
        for low, high in ((0, r), (r, 1), (1, 1 / r)):
            if port == c.P_s and low == 1:
                high = 2
            assert np.sum((ratio > low) & (ratio < high)) > 10


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
GOOD = {"model": "M8", "--n": "1.35", "--cylinder": "D", "--k0": "0.5", "--to": "c", "--config": PAPER}


@pytest.fixture
def pneumo(monkeypatch, capsys):
    """Run the command line in this process; returns exit code, output and error text."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["pneumo", *arguments])
        with pytest.raises(SystemExit) as stopped:
            main()
        return stopped.value.code or 0, *capsys.readouterr()

    return run


def command(**changes):
    options = GOOD | {(key if key == "model" else f"--{key}"): value for key, value in changes.items()}
    model = options.pop("model")
    return ["export", model, *(word for pair in options.items() for word in pair)]


def test_command_writes_or_prints_the_source(pneumo, plant, tmp_path):
    file = tmp_path / "m8.c"
    assert pneumo(*command(output=str(file))) == (0, "", "")
    assert file.read_text() == exported("M8", N, plant, "c")
    assert [path.name for path in tmp_path.iterdir()] == ["m8.c"]
    assert pneumo(*command(to="casadi")) == (0, exported("M8", N, plant, "casadi"), "")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"model": "M99"}, "no such model; there are M1, M2"),
        ({"cylinder": "F"}, "there are D, E"),
        ({"k0": "-1"}, "k_0 = -1"),
        ({"to": "fortran"}, "there are c, matlab, casadi"),
        ({"config": "config/none.yaml"}, "config/none.yaml"),
    ],
)
def test_command_refuses_in_one_line(changes, words, pneumo, tmp_path):
    code, out, error = pneumo(*command(**{"output": str(tmp_path / "out.c")} | changes))
    assert (code, out) == (2, "")
    assert error.startswith("pneumo: ")
    assert len(error.splitlines()) == 1
    assert words in error
    assert not list(tmp_path.iterdir())


def test_command_says_where_it_cannot_write(pneumo, tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path, tmp_path / "file" / "out.c"):
        code, out, error = pneumo(*command(output=str(place)))
        assert (code, out, len(error.splitlines())) == (2, "", 1)
        assert str(place) in error
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
