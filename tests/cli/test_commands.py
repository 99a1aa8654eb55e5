"""The command line: what it prints, and one line with exit code 2 for what the user can mend."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pneumo.cli.commands import main
from pneumo.configuration.parameters import load, study
from pneumo.engineer.plants import configured_plant
from pneumo.engineer.runs import simulate
from pneumo.storage.files import write_json

ROOT = Path(__file__).parents[2]


def pneumo(*arguments: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    code = "from pneumo.cli.commands import main; main()"
    return subprocess.run([sys.executable, "-c", code, *arguments], cwd=cwd, capture_output=True, text=True)


def test_check_lists_the_papers_experiments():
    done = pneumo("check", "config/paper.yaml")
    assert done.returncode == 0, done.stderr
    assert "paper: 16 experiments" in done.stdout
    assert "E03  cylinder E  open   loop  k_0 = 0.02 W/K  1800 s, step 1 ms" in done.stdout


def test_models_prints_every_model():
    done = pneumo("models")
    assert done.returncode == 0
    assert all(f"M{i} " in done.stdout for i in range(1, 11))


def test_help_names_every_command():
    done = pneumo("--help")
    assert done.returncode == 0
    commands = (
        "check",
        "models",
        "explain",
        "verdict",
        "assumptions",
        "identify",
        "ensemble",
        "verify",
        "export",
        "init",
        "study",
    )
    assert all(command in done.stdout for command in commands)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "config/none.yaml"], ["config/none.yaml", "cannot be read"]),
        (["check", "README.md"], ["README.md", "YAML"]),
        (["check", "config/smoke.yaml"], ["config/smoke.yaml", "gas: missing"]),
        (["ensemble", "--results", "nowhere"], ["nowhere/ensemble.nc", "snakemake -j2 ensemble"]),
        (
            ["explain", "E99", "M8", "1.35", "--results", "nowhere"],
            ["nowhere/published/replay/E99.nc", "no such file"],
        ),
    ],
)
def test_bad_input_is_one_line_and_exit_2(arguments, words):
    done = pneumo(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("pneumo: ")
    assert all(word in done.stderr for word in words), done.stderr


def test_verify_names_damaged_files_and_removes_them_on_demand(tmp_path):
    write_json('{\n "name": "test"\n}\n', tmp_path / "parameters.json")
    done = pneumo("verify", str(tmp_path))
    assert (done.returncode, done.stdout) == (0, f"{tmp_path}: 1 files as they were written\n")
    (tmp_path / "settling.nc").write_text("foreign")
    done = pneumo("verify", str(tmp_path))
    assert done.returncode == 2 and f"{tmp_path}/settling.nc: does not end" in done.stdout
    assert "pneumo verify --remove" in done.stderr
    done = pneumo("verify", "--remove", str(tmp_path))
    assert done.returncode == 0 and "; removed" in done.stdout
    assert [file.name for file in tmp_path.iterdir()] == ["parameters.json"]


def test_verify_of_nothing_is_an_error(tmp_path):
    done = pneumo("verify", str(tmp_path))
    assert done.returncode == 2 and "holds no results" in done.stderr


def test_usage_errors_exit_2_without_traceback():
    done = pneumo("explain")
    assert done.returncode == 2
    assert done.stderr == "pneumo: Missing argument 'what'; `pneumo --help` lists commands\n"


def test_in_process_check(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["pneumo", "check", str(ROOT / "config" / "paper.yaml")])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    assert "paper: 16 experiments, n = 1.0, 1.05" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["chek"], [], ["check"], ["check", "nowhere.yaml"]])
def test_in_process_errors(arguments, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["pneumo", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


# A cylinder of one's own, as a new user would


@pytest.fixture
def inside(tmp_path, monkeypatch, capsys):
    """Run a command in this process and an empty folder; give exit code, output and error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["pneumo", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code or 0, *capsys.readouterr()

    return run


QUICK = "n: [1.2, 1.3]\nrun: {seeds: 2, duration_limit_s: 0.3}\n"


def test_init_then_study(inside, tmp_path):
    assert inside("init")[:2] == (0, "cylinder.yaml: written; edit it, then: pneumo study cylinder.yaml\n")
    (tmp_path / "quick.yaml").write_text(QUICK)
    code, out, _ = inside("study", "cylinder.yaml", "quick.yaml")
    assert code == 0 and all(f" M{i} " in out for i in range(1, 11))
    assert "mine: open, closed, 2 runs each" in out and "Recommended: M" in out
    assert sorted(file.name for file in (tmp_path / "study-my-cylinder").iterdir()) == [
        "study.html",
        "study.nc",
    ]
    code, out, _ = inside(
        "study", "cylinder.yaml", "quick.yaml", "--experiment", "open", "--seeds", "1", "-o", "one"
    )
    assert code == 0 and "mine: open, 1 runs each" in out and (tmp_path / "one" / "study.nc").exists()


WRONG = {
    "no file": (["study"], "Missing argument 'files'"),
    "absent file": (["study", "none.yaml"], "none.yaml: cannot be read"),
    "a folder": (["study", "."], ".: cannot be read"),
    "no number": (["study", "cylinder.yaml", "--seeds", "many"], "--seeds"),
    "too few seeds": (["study", "cylinder.yaml", "--seeds", "0"], "--seeds"),
    "too few threads": (["study", "cylinder.yaml", "--threads", "0"], "--threads"),
    "unknown option": (["study", "cylinder.yaml", "--seed", "3"], "No such option"),
    "unknown cylinder": (
        ["study", "cylinder.yaml", "--cylinder", "D"],
        "no such cylinder in this study; there are mine",
    ),
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
def test_wrong_use_is_one_line_and_leaves_everything_alone(mistake, inside, tmp_path):
    inside("init")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "study.html").write_text("mine")
    arguments, words = WRONG.get(mistake, (None, None))
    if arguments is None:
        text, words = WRONG_YAML[mistake.removeprefix("in YAML: ")]
        (tmp_path / "wrong.yaml").write_text(text)
        arguments = ["study", "cylinder.yaml", "wrong.yaml"]
    before = {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}
    code, out, err = inside(*arguments)
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and err.startswith("pneumo: ")
    assert words in err, err
    assert {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()} == before


@pytest.mark.parametrize("command", ["init", "study"])
def test_help_of_a_command(command, inside):
    code, out, _ = inside(command, "--help")
    assert code == 0 and "Usage" in out and "--help" in out


def test_when_nothing_runs(inside, tmp_path):
    inside("init")
    (tmp_path / "wild.yaml").write_text(
        f"{QUICK}step_s: 0.03\ncylinders: {{mine: {{mass_kg: 1.0e-6, friction_Ns_per_m: 1000}}}}\n"
    )
    code, out, err = inside("study", "cylinder.yaml", "wild.yaml")
    assert "Left out: open, seed 1: " in out and "Recommended: none" in out
    assert code == 2 and err.splitlines()[-1].startswith("pneumo: mine: no full-order run succeeded")
    assert (tmp_path / "study-my-cylinder" / "study.html").exists()


# A measurement of one's own


def bench(path):
    """Write 1.5 s of the template's cylinder at work, its pressures with noise."""
    plant = configured_plant(study(load(path / "cylinder.yaml")), "mine", 0.3)
    steps = np.arange(1500)
    run = simulate(plant, 1e-3, command=0.8 * np.sign(np.sin(steps / 90) + np.sin(steps / 37)))
    P = np.array([run.P_A, run.P_B]) + np.random.default_rng(1).normal(0.0, 500.0, (2, len(run.t)))
    columns = {"t_s": run.t, "u_V": run.u, "x_mm": 1e3 * run.x, "P_A_kPa": P[0] / 1e3, "P_B_bar": P[1] / 1e5}
    pd.DataFrame(columns).to_csv(path / "bench.csv", index=False)
    return plant


def test_fit_of_a_measurement_in_process(inside, tmp_path):
    inside("init")
    plant = bench(tmp_path)
    called = ["fit", "bench.csv", "--cylinder", "mine", "--config", "cylinder.yaml", "--model"]
    code, out, err = inside(*called, "M6", "--model", "M2", "-o", "fitted")
    assert code == 0, err
    assert "Ranked" in out and "written to fitted/fit.html and fitted/fit.nc" in out
    assert "M6: rms" in err and "M2: rms" in err
    with xr.open_dataset(tmp_path / "fitted" / "fit.nc") as found:
        k = found.sel(model="M6", parameter="k_xu")
        assert k["low"] < k["estimate"] < k["high"]
        # The model without heat is not the truth; the valve's coefficient is what flows, to a tenth.
        assert k["estimate"].item() == pytest.approx(plant.valve.k_xu, rel=0.1)
        ranked = np.sqrt((found["rms_held_out"] ** 2).mean("chamber")).values
        assert ranked[0] < ranked[1]
    (tmp_path / "leak.yaml").write_text("cylinders: {mine: {valve: {leak_dm3_per_sbar: 0.01}}}")
    code, out, err = inside(*called, "M6", "--config", "leak.yaml")
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and "leak_dm3_per_sbar" in err
