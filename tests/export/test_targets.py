"""Exported code, compiled and run by what it is for, against the right-hand side it was printed from."""

import io
import subprocess
import zipfile

import numpy as np
import pytest
from bad_input import PAPER
from brief import in_brief
from exported_c import C_COMPILER, STRICT, CompiledModel, write
from plain_rates import EVERY, OWN, plain_rate, rate_size

from pneumo import MODELS
from pneumo.equations.system import step, system
from pneumo.errors import InputError
from pneumo.export import TARGETS, exported
from pneumo.physics.valve import limited

N = 1.35


def source(model, plant, target):
    (text,) = exported(model, N, plant, target).values()
    return text.decode()


def difference(computed, model, plant, states):
    """Largest difference from the right-hand side, over the size of its terms."""
    ratios = []
    for (u, x, v, *pressures), pair in zip(states.tolist(), computed, strict=True):
        for side, P, rate in zip("AB", pressures, pair, strict=True):
            state = model, N, plant, limited(u, plant.valve.u_max), x, v, P, side
            ratios.append(abs(rate - plain_rate(*state)) / rate_size(*state))
    return np.max(ratios)


def run_c(model, plant, states, folder):
    compiled = CompiledModel(model, N, plant, folder)
    return np.array([compiled.rates(state[:3], state[3:]) for state in states.tolist()])


UNUSUAL = {
    "laminar": ("valve", {"laminar": 0.05}),
    "leak that carries no heat": ("valve", {"leak": 1e-8, "net_leak": True}),
    "asymmetric, leaking": ("valve", {"exhaust": 0.7, "leak": 1e-8}),
    "elliptic": ("gas", {"elliptic": True, "critical_ratio": 0.3}),
}


COMPILED = [*((model, "") for model in EVERY), *((MODELS["M8"], name) for name in UNUSUAL)]
BRIEF = [(MODELS["M1"], ""), (MODELS["M10"], ""), (OWN, ""), (MODELS["M8"], "elliptic")]


@C_COMPILER
@pytest.mark.parametrize(("model", "unusual"), in_brief(COMPILED, BRIEF))
def test_c(model, unusual, plant, random_states, tmp_path):
    if unusual:
        part, changes = UNUSUAL[unusual]
        plant = plant._replace(**{part: getattr(plant, part)._replace(**changes)})
    assert difference(run_c(model, plant, random_states, tmp_path), model, plant, random_states) < 1e-12


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        *(({"n": 0.0}, "n = 0"), ({"n": 3.5}, "n = 3.5"), ({"n": None}, "n: M8 needs")),
        *(({"model": "M99"}, "M99"), ({"target": "fortran"}, "fortran"), ({"precision": "half"}, "half")),
        ({"target": "matlab", "precision": "float"}, "float"),
        ({"model": OWN._replace(name="my model")}, "my model"),
        *(({"name": name}, "--name '") for name in ("my axis", "2nd", "", "a-b", "größe")),
        ({"name": "left__axis", "target": "st"}, "--name 'left__axis'"),
        ({"target": "matlab", "piston": True}, "--piston"),
        ({"target": "fmu", "fmi": 1}, "--fmi 1"),
        *(({"stem": name}, "#include") for name in ('a"b', "a\nb")),  # would reach the code
    ],
)
def test_bad_exports_are_refused(arguments, words, plant):
    given = {"model": "M8", "n": N, "plant": plant, "target": "c"} | arguments
    with pytest.raises(InputError, match=words):
        exported(**given)


AXES = {"left": 25e-3, "right": 40e-3}  # bore, m
TWO_AXES = """#include <stdio.h>
#include "left.h"
#include "right.h"
int main(void)
{
    double left[left_STATES] = {3e5, 3e5}, right[right_STATES] = {3e5, 3e5};
    const double inputs[left_INPUTS] = {2.0, 0.01, 0.1};
    int failed = left_step(&left_defaults, inputs, inputs, 1e-3, left);
    failed |= right_step(&right_defaults, inputs, inputs, 1e-3, right);
    printf("%.17g %.17g\\n", left[left_P_A], right[right_P_A]);
    return failed;
}
"""


def axis(plant, name):
    """Plant of one of `AXES`."""
    area = np.pi * AXES[name] ** 2 / 4
    return plant._replace(cylinder=plant.cylinder._replace(bore=AXES[name], A_A=area, A_B=area))


@C_COMPILER
def test_two_named_axes_run_in_one_program(plant, tmp_path):
    """Linked as objects, and as libraries in either order."""
    inputs, expected = [2.0, 0.01, 0.1], list[float]()
    for name in AXES:
        write(exported("M6", N, axis(plant, name), "c", name=name), tmp_path)
        expected.append(step(system("M6", N, axis(plant, name)), [3e5, 3e5], inputs, inputs, 1e-3)[0])
    assert abs(expected[0] - expected[1]) > 100  # Pa
    (tmp_path / "main.c").write_text(TWO_AXES)
    compiled = ["gcc", *STRICT, "-c", "left.c", "right.c", "main.c"]
    for command in (compiled, *(["ar", "rcs", f"lib{name}.a", f"{name}.o"] for name in AXES)):
        subprocess.run(command, cwd=tmp_path, check=True)
    for linked in (["left.o", "right.o"], ["-lleft", "-lright"], ["-lright", "-lleft"]):
        subprocess.run(["gcc", "main.o", "-o", "program", "-L.", *linked, "-lm"], cwd=tmp_path, check=True)
        said = subprocess.run(["./program"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
        np.testing.assert_allclose([float(text) for text in said.split()], expected, rtol=1e-12)


@C_COMPILER
def test_two_cylinders_of_one_name_do_not_compile(plant, tmp_path):
    """Without the error one would silently run with the parameters of the other."""
    for name in AXES:
        write(exported("M6", N, axis(plant, name), "c", stem=name), tmp_path)
    for other, message in (("left", ""), ("right", "export one again with --name")):
        (tmp_path / "main.c").write_text(f'#include "left.h"\n#include "{other}.h"\n')
        ran = subprocess.run(["gcc", "-c", "main.c"], cwd=tmp_path, capture_output=True, text=True)
        assert bool(ran.returncode) == bool(message) and message in ran.stderr


@pytest.mark.parametrize("target", TARGETS)
def test_a_name_of_one_s_own_replaces_that_of_the_model(target, plant):
    for name, content in exported("M8", N, plant, target, name="left").items():
        texts = [content]
        if target == "fmu":
            files = zipfile.ZipFile(io.BytesIO(content))
            texts = [files.read(file) for file in files.namelist() if not file.startswith("binaries")]
            assert all("M8" not in file for file in files.namelist())
        assert name.startswith("left")
        for text in texts:
            code = text.decode().replace("model M8 at", "").replace("M8 holds near", "")
            assert "M8" not in code and "left" in code


@pytest.fixture
def export(inside, plant):
    """Run `pneumo export M8` in an empty folder; returns exit code, output and error text."""

    def run(**changes):
        options = {"n": "1.35", "cylinder": "D", "k0": repr(plant.k_0), "to": "c", "config": PAPER} | changes
        words = (word for name, value in options.items() for word in (f"--{name}", value))
        return inside("export", "M8", *words)

    return run


def test_command_writes_or_prints_the_source(export, plant, tmp_path):
    code, out, error = export(output="m8.c")
    assert (code, error) == (0, "") and out.startswith("m8.c, m8.h, m8_test.c: written\n")
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert written == exported("M8", N, plant, "c", stem="m8")
    assert sorted(written) == ["m8.c", "m8.h", "m8_test.c"]
    code, out, error = export(to="st", output="m8.st")
    assert (code, error) == (0, "") and "states P_A, P_B; inputs u, x, v\n" in out
    assert {f"m8{end}" for end in (".st", "_test.st", ".xml")} <= {path.name for path in tmp_path.iterdir()}
    assert export(to="matlab") == (0, source("M8", plant, "matlab"), "")
    assert export(output="m8.c", name="left")[0] == 0
    assert {p.name: p.read_bytes() for p in tmp_path.glob("m8*.[ch]")} == exported(
        "M8", N, plant, "c", stem="m8", name="left"
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cylinder": "F"}, "there are D, E"),
        ({"k0": "-1"}, "k_0 = -1"),
        ({"to": "fortran"}, "there are c, st, matlab, fmu"),
        ({"output": "m8.txt"}, "--to c: needs --output FILE.c"),
        ({"to": "fmu"}, "--to fmu: needs --output FILE.fmu"),
        ({"to": "st"}, "--to st: needs --output FILE.st"),
        ({"config": "config/none.yaml"}, "config/none.yaml"),
        ({"to": "matlab", "output": "."}, "--to matlab: needs --output FILE.m"),
        ({"output": "file/out.c"}, "file/out.c: cannot be written"),
    ],
)
def test_command_refuses_in_one_line_and_writes_nothing(changes, words, export, tmp_path):
    (tmp_path / "file").touch()
    code, out, error = export(**{"output": "out.c"} | changes)
    assert (code, out, len(error.splitlines())) == (2, "", 1)
    assert error.startswith("pneumo: ") and words in error
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
