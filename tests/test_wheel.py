# pyright: standard
"""What `pip install` gives: every engineer's command and the public names, in an empty folder."""

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from checkout import ROOT, sources

import pneumo

pytestmark = pytest.mark.wheel

MOST_MEGABYTES = 480  # without pip and bytecode
QUICK = "n: [1.2, 1.3]\nrun: {seeds: 1, duration_limit_s: 0.3}\n"
RECORD = """
import numpy as np
from pneumo import plant, simulate
from pneumo.configuration.parameters import load, study
from pneumo.selection.plants import configured_plant

steps = np.arange(400)
run = simulate(configured_plant(study(load("cylinder.yaml"))), 1e-3, command=np.sign(np.sin(steps / 30)))
columns = np.column_stack([run.t, run.u, run.x, run.P_A, run.P_B])
np.savetxt("record.csv", columns, delimiter=",", header="t_s,u_V,x_m,P_A_Pa,P_B_Pa", comments="")
"""
AT = "--u 1 --P_A 5e5 --P_B 6e5 --config cylinder.yaml"
COMMANDS = {  # in this order; what each prints or writes
    "init": "cylinder.yaml: written",
    "models": "M10",
    "check cylinder.yaml": "2 experiments",
    "study cylinder.yaml quick.yaml --experiment open -o out": "Next: pneumo export ",
    "fit record.csv --config cylinder.yaml --model M2 -o fitted": "fit.nc",
    f"linearise M8 --n 1.3 {AT} --json": '"states"',
    "export M8 --n 1.3 --to c --config cylinder.yaml -o m8.c": "",
    "export full --to fmu --piston --config cylinder.yaml -o full.fmu": "",
    "export M8 --n 1.3 --to matlab --config cylinder.yaml": "M8_dP_dt",
}


@pytest.fixture(scope="module")
def dist() -> dict[str, Path]:
    """Sdist and the wheel built from it, by suffix."""
    return {file.suffix: file for file in (ROOT / "dist").iterdir()}


def test_the_long_description_has_no_relative_link(dist):
    with zipfile.ZipFile(dist[".whl"]) as wheel:
        (metadata,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
        description = wheel.read(metadata).decode()
    targets = re.findall(r"\]\(([^)]*)\)", description)
    assert "## Reproduce the paper" in description and targets
    assert [target for target in targets if not target.startswith("https://")] == []


def test_the_sdist_holds_the_project_and_the_wheel_the_package_with_its_data_alone(dist):
    with tarfile.open(dist[".gz"]) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    assert set(sources()) - names == set()
    with zipfile.ZipFile(dist[".whl"]) as wheel:
        names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    files = (file for file in (ROOT / "pneumo").rglob("*") if file.is_file())
    assert names == {str(file.relative_to(ROOT)) for file in files if "__pycache__" not in file.parts}


LOCKED = "--constraint", str(ROOT / "requirements.lock")
OLDEST = "--resolution", "lowest-direct", "--requirements", str(ROOT / "pyproject.toml")  # its lower bounds


@pytest.fixture(scope="module", params=[LOCKED, OLDEST], ids=["locked", "oldest"])
def installed(dist, tmp_path_factory, request) -> Path:
    """Programs of an environment that holds the wheel and what it needs, locked or as old as allowed."""
    environment = tmp_path_factory.mktemp("wheel") / "env"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    install = ["uv", "pip", "install", "--quiet", "--python", str(environment / "bin/python")]
    install += [*request.param, str(dist[".whl"])]
    for where in (["--offline"], []):
        if subprocess.run([*install, *where], capture_output=True).returncode == 0:
            return environment / "bin"
    pytest.skip("uv reaches no package index, and has not what the wheel needs in its cache")


def test_an_engineers_commands_run_in_an_empty_folder(installed, tmp_path):
    (tmp_path / "quick.yaml").write_text(QUICK)
    keep = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    environment = keep | {"COLUMNS": "120"}

    def run(*command: str) -> tuple[int, str, str]:
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    program, python = str(installed / "pneumo"), str(installed / "python")
    for command, words in COMMANDS.items():
        if command.startswith("fit"):
            code, _, err = run(python, "-c", RECORD)
            assert code == 0, err
        code, out, err = run(program, *command.split())
        assert code == 0 and words in out, f"{command}: {out} {err}"
        assert "Traceback" not in err
    names = " ".join(pneumo.__all__)
    code, out, err = run(python, "-c", f"import pneumo\nfor n in '{names}'.split(): getattr(pneumo, n)")
    assert (code, out, err) == (0, "", "")
    code, out, err = run(program, "paper", "verdict")  # of a checkout only
    assert (code, out) == (2, "") and err.startswith("pneumo: No such command 'paper'")
    refusal = "--config: missing; name a configuration, `pneumo init` writes one"
    assert run(program, "export", "M1", "--to", "matlab") == (2, "", f"pneumo: {refusal}\n")
    written = {"out", "fitted", "cylinder.yaml", "record.csv", "quick.yaml"}
    written |= {"m8.c", "m8.h", "m8_test.c", "full.fmu"}
    assert {f.name for f in tmp_path.iterdir()} == written


def test_paper_verdict_is_small_and_judges_alone(tmp_path):
    """Its wheel in an empty environment: an example from nothing to a page."""
    (wheel,) = (ROOT / "paper-verdict/dist").glob("*.whl")
    environment = tmp_path / "env"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    python = str(environment / "bin/python")
    install = ["uv", "pip", "install", "--quiet", "--python", python, *LOCKED, str(wheel)]
    for where in (["--offline"], []):
        if subprocess.run([*install, *where], capture_output=True).returncode == 0:
            break
    for command in ("init", "check", "page"):
        done = subprocess.run(
            [environment / "bin/paper-verdict", command, "toy"], cwd=tmp_path, capture_output=True, text=True
        )
        assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "toy/verdict.html").stat().st_size > 10_000
    size = subprocess.check_output(["du", "-sm", "--exclude=*.pyc", str(environment)], text=True)
    assert int(size.split()[0]) <= 60


def test_the_environment_is_of_bearable_size(installed):
    size = subprocess.check_output(["du", "-sm", "--exclude=*.pyc", str(installed.parent)], text=True)
    assert int(size.split()[0]) <= MOST_MEGABYTES
