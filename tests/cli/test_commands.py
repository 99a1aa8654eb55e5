"""The command line: what it prints, and one line with exit code 2 for what the user can mend."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pneumo import __version__
from pneumo.cli.commands import app, main, paper
from pneumo.configuration.parameters import load, study
from pneumo.engineer.linear_model import linearise
from pneumo.engineer.plants import configured_plant
from pneumo.engineer.runs import simulate
from pneumo.storage.files import write_json

ROOT = Path(__file__).parents[2]


@pytest.fixture
def inside(tmp_path, monkeypatch, capsys):
    """Run a command in this process and an empty folder; give exit code, output and error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["pneumo", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code or 0, *capsys.readouterr()

    return run


def assert_one_line(done, *words):
    code, out, err = done
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and err.startswith("pneumo: "), err
    assert all(word in err for word in words), err


@pytest.mark.parametrize("arguments", [["--help"], ["models"], ["check", "config/paper.yaml"]])
def test_commands_that_compute_nothing_load_no_numba(arguments):
    code = "import sys; from pneumo.cli.commands import main\ntry: main()\nfinally: print(*sys.modules)"
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert {"typer"} == {"typer", "numba", "scipy", "xarray"} & set(done.stdout.splitlines()[-1].split())


def test_check_lists_the_papers_experiments(inside):
    code, out, _ = inside("check", ROOT / "config/paper.yaml")
    assert code == 0 and "paper: 16 experiments, n = 1.0, 1.05" in out
    assert "E03  cylinder E  open   loop  k_0 = 0.02 W/K  1800 s, step 1 ms" in out


def test_models_prints_every_model(inside):
    code, out, _ = inside("models")
    assert code == 0 and all(f"M{i} " in out for i in range(1, 11))


@pytest.mark.parametrize(("group", "words"), [(app, []), (paper, ["paper"])])
def test_help_names_every_command_and_each_has_its_own(group, words, inside):
    names = [command.callback.__name__ for command in group.registered_commands]
    code, out, _ = inside(*words, "--help")
    assert code == 0 and names and all(f"  {name} " in out for name in names)
    for name in names:
        code, out, _ = inside(*words, name, "--help")
        assert code == 0 and "Usage" in out


def test_version_is_that_of_the_package(inside):
    assert inside("--version") == (0, f"{__version__}\n", "")


def test_shell_completion_knows_the_commands():
    completion = {"_PNEUMO_COMPLETE": "complete_bash", "COMP_WORDS": "pneumo paper ver", "COMP_CWORD": "2"}
    code = "import sys; sys.argv[0] = 'pneumo'; from pneumo.cli.commands import main; main()"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=os.environ | completion, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.split() == ["verdict", "verify"], done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["chek"], ["No such command"]),
        ([], ["Missing command"]),
        (["check"], ["Missing argument"]),
        (["paper", "explain"], ["Missing argument 'what'; `pneumo --help` lists commands"]),
        (["check", "none.yaml"], ["none.yaml", "cannot be read"]),
        (["check", str(ROOT / "README.md")], ["README.md", "YAML"]),
        (["check", str(ROOT / "config/smoke.yaml")], ["config/smoke.yaml", "gas: missing"]),
        (["paper", "ensemble", "--results", "nowhere"], ["nowhere/ensemble.nc", "snakemake -j2 ensemble"]),
        (["paper", "assumptions"], ["results/assumptions.nc", "`snakemake -j2 evidence` makes it"]),
        (["paper", "explain", "E99", "M8", "1"], ["results/published/replay/E99.nc", "no such file"]),
        (["paper", "verify"], ["holds no results"]),
    ],
)
def test_bad_input_is_one_line_and_exit_2(arguments, words, inside):
    assert_one_line(inside(*arguments), *words)


def test_verify_names_damaged_files_and_removes_them_on_demand(inside, tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    write_json('{\n "name": "test"\n}\n', folder / "parameters.json")
    assert inside("paper", "verify") == (0, "results: 1 files as they were written\n", "")
    (folder / "settling.nc").write_text("foreign")
    code, out, err = inside("paper", "verify")
    assert code == 2 and "results/settling.nc: does not end" in out
    assert "pneumo paper verify --remove" in err
    code, out, _ = inside("paper", "verify", "--remove", "results")
    assert code == 0 and "; removed" in out
    assert [file.name for file in folder.iterdir()] == ["parameters.json"]


# Cylinder and conductance of a configuration

AT = ["--u", "1", "--P_A", "5e5", "--P_B", "6e5"]


def test_linearise_prints_the_matrices_and_takes_the_only_cylinder_and_conductance(inside, tmp_path):
    inside("init", "mine.yaml")
    code, out, _ = inside("linearise", "M8", "--n", 1.3, *AT, "--config", "mine.yaml", "--json")
    plant = configured_plant(study(load(tmp_path / "mine.yaml")), "mine", 0.3)
    linear = linearise("M8", 1.3, plant, u=1.0, P_A=5e5, P_B=6e5)
    printed = json.loads(out)
    assert (code, printed["A"], printed["B"]) == (0, linear.A.tolist(), linear.B.tolist())
    given = ["--cylinder", "mine", "--k0", 0.3, "--config", "mine.yaml"]
    code, out, _ = inside("linearise", "M8", "--n", 1.3, *AT, *given)
    assert code == 0 and f"{linear.A[0, 0]:.6g}" in out and "u (Pa/s per V)" in out


@pytest.mark.parametrize("command", [["linearise", "M8", "--n", 1.3, *AT], ["export", "M1", "--to", "c"]])
def test_a_choice_between_cylinders_or_conductances_is_left_to_the_user(command, inside):
    command = [*command, "--config", ROOT / "config/paper.yaml"]
    assert_one_line(inside(*command), "name one with --cylinder; there are D, E")
    assert_one_line(inside(*command, "--cylinder", "F"), "no such cylinder; there are D, E")
    assert_one_line(inside(*command, "--cylinder", "D"), "choose one with --k0; cylinder D has 0.02, 0.1")
    assert inside(*command, "--cylinder", "D", "--k0", 0.1)[0] == 0


# A cylinder of one's own, as a new user would

QUICK = "n: [1.2, 1.3]\nrun: {seeds: 2, duration_limit_s: 0.3}\n"


def test_init_then_study(inside, tmp_path):
    assert inside("init")[:2] == (0, "cylinder.yaml: written; edit it, then: pneumo study cylinder.yaml\n")
    (tmp_path / "quick.yaml").write_text(QUICK)
    code, out, _ = inside("study", "cylinder.yaml", "quick.yaml")
    assert code == 0 and all(f" M{i} " in out for i in range(1, 11))
    assert "mine: open, closed, 2 runs each" in out and "Recommended: M" in out
    files = sorted(file.name for file in (tmp_path / "study-my-cylinder").iterdir())
    assert files == ["study.html", "study.nc"]
    options = ["--experiment", "open", "--seeds", 1, "-o", "one"]
    code, out, _ = inside("study", "cylinder.yaml", "quick.yaml", *options)
    assert code == 0 and "mine: open, 1 runs each" in out and (tmp_path / "one" / "study.nc").exists()


WRONG = {
    "no file": (["study"], "Missing argument 'files'"),
    "absent file": (["study", "none.yaml"], "none.yaml: cannot be read"),
    "a folder": (["study", "."], ".: cannot be read"),
    "no number": (["study", "cylinder.yaml", "--seeds", "many"], "--seeds"),
    "too few seeds": (["study", "cylinder.yaml", "--seeds", "0"], "--seeds"),
    "too few threads": (["study", "cylinder.yaml", "--threads", "0"], "--threads"),
    "unknown option": (["study", "cylinder.yaml", "--seed", "3"], "No such option"),
    "unknown cylinder": (["study", "cylinder.yaml", "--cylinder", "D"], "in this study; there are mine"),
    "unknown experiment": (["study", "cylinder.yaml", "--experiment", "E01"], "there are closed, open"),
    "output is a file": (["study", "cylinder.yaml", "-o", "cylinder.yaml"], "is a file"),
    "foreign page": (["study", "cylinder.yaml", "-o", "foreign"], "study.html: not written by"),
    "init twice": (["init", "cylinder.yaml"], "is there already"),
    "init into a folder": (["init", "foreign"], "is there already"),
    "init too much": (["init", "a.yaml", "b.yaml"], "unexpected extra argument"),
}
WRONG_YAML = {
    "negative bore": ("cylinders: {mine: {bore_mm: -25}}", "cylinders.mine.bore_mm = -25: must be"),
    "text for a number": ("cylinders: {mine: {mass_kg: 3 kg}}", "cylinders.mine.mass_kg = '3 kg': must be"),
    "wrong unit": ("cylinders: {mine: {stroke_cm: 16}}", "cylinders.mine.stroke_cm = 16: unknown key"),
    "gauge pressure": ("supply: {P_s_Pa: 6}", "supply.P_s_Pa = 6.0: must exceed P_atm_Pa"),
    "rod as thick as the bore": ("cylinders: {mine: {rod_mm: 25}}", "rod_mm = 25.0: must be below bore_mm"),
    "two valves": ("cylinders: {mine: {k_x_k_u_m2_per_V: 1.0e-7}}", "give one of the two"),
    "b above 1": ("cylinders: {mine: {valve: {b: 1.2}}}", "cylinders.mine.valve.b = 1.2: must be"),
    "two conductances": ("experiments: {open: {lambda_0_W_per_m2K: 40}}", "stands beside k_0_W_per_K"),
    "unknown cylinder": ("experiments: {open: {cylinder: yours}}", "must be one of mine"),
    "unknown experiment": ("run: {experiments: [half]}", "no such experiment; there are open, closed"),
    "half a sweep": ("experiments: {open: {signal: {kind: sweep, from_Hz: 1}}}", "signal.to_Hz: missing"),
    "no loop": ("cylinders: {mine: {open_loop: null}}", "needs the section cylinders.mine.open_loop"),
    "no such CSV": (
        "experiments: {open: {signal: {kind: csv, file: no.csv, column: u, hold_s: 0.1}}}",
        "experiments.open.signal.file = 'no.csv': cannot be read",
    ),
    "not YAML": ("cylinders: [", "not valid YAML"),
}


@pytest.mark.parametrize("mistake", [*WRONG, *(f"in YAML: {name}" for name in WRONG_YAML)])
def test_wrong_use_is_one_line_and_changes_no_file(mistake, inside, tmp_path):
    inside("init")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "study.html").write_text("mine")
    arguments, words = WRONG.get(mistake, (None, None))
    if arguments is None:
        text, words = WRONG_YAML[mistake.removeprefix("in YAML: ")]
        (tmp_path / "wrong.yaml").write_text(text)
        arguments = ["study", "cylinder.yaml", "wrong.yaml"]
    before = {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}
    assert_one_line(inside(*arguments), words)
    assert {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()} == before


def test_a_study_whose_runs_all_fail_says_so_and_writes_its_page(inside, tmp_path):
    inside("init")
    light = "cylinders: {mine: {mass_kg: 1.0e-6, friction_Ns_per_m: 1000}}\n"
    (tmp_path / "wild.yaml").write_text(f"{QUICK}step_s: 0.03\n{light}")
    code, out, err = inside("study", "cylinder.yaml", "wild.yaml")
    assert "Left out: open, seed 1: " in out and "Recommended: none" in out
    assert code == 2 and err.splitlines()[-1].startswith("pneumo: mine: no full-order run succeeded")
    assert (tmp_path / "study-my-cylinder" / "study.html").exists()


# A measurement of one's own


def write_measurement(path):
    """Write 1.5 s of the template's cylinder at work, its pressures with noise."""
    plant = configured_plant(study(load(path / "cylinder.yaml")))
    steps = np.arange(1500)
    run = simulate(plant, 1e-3, command=0.8 * np.sign(np.sin(steps / 90) + np.sin(steps / 37)))
    P = np.array([run.P_A, run.P_B]) + np.random.default_rng(1).normal(0.0, 500.0, (2, len(run.t)))
    columns = {"t_s": run.t, "u_V": run.u, "x_mm": 1e3 * run.x, "P_A_kPa": P[0] / 1e3, "P_B_bar": P[1] / 1e5}
    pd.DataFrame(columns).to_csv(path / "bench.csv", index=False)
    return plant


def test_fit_of_a_measurement_of_the_only_cylinder(inside, tmp_path):
    inside("init")
    plant = write_measurement(tmp_path)
    called = ["fit", "bench.csv", "--config", "cylinder.yaml", "--model"]
    code, out, err = inside(*called, "M6", "--model", "M2", "-o", "fitted")
    assert code == 0, err
    assert "Ranked" in out and "written to fitted/fit.html and fitted/fit.nc" in out
    assert "M6: rms" in err and "M2: rms" in err
    with xr.open_dataset(tmp_path / "fitted" / "fit.nc") as fit:
        k = fit.sel(model="M6", parameter="k_xu")
        assert k["low"] < k["estimate"] < k["high"]
        # The model without heat is not the truth; the valve's coefficient is what flows, to a tenth.
        assert k["estimate"].item() == pytest.approx(plant.valve.k_xu, rel=0.1)
        ranked = np.sqrt((fit["rms_held_out"] ** 2).mean("chamber")).values
        assert ranked[0] < ranked[1]
    (tmp_path / "leak.yaml").write_text("cylinders: {mine: {valve: {leak_dm3_per_sbar: 0.01}}}")
    assert_one_line(inside(*called, "M6", "--config", "leak.yaml"), "leak_dm3_per_sbar")
