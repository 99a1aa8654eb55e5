"""The command line: what it prints, and one line with exit code 2 for what the user can mend."""

import errno
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from brief import in_brief
from checkout import PNEUMO, ROOT

from pneumo import __version__
from pneumo.cli import INTERRUPTED
from pneumo.cli import main as first_main
from pneumo.cli.commands import app, paper
from pneumo.configuration.parameters import load, sonic_conductance, study
from pneumo.linear.linear_model import linearise
from pneumo.physics.models import MODELS
from pneumo.publish.text.formatting import significant
from pneumo.selection.plants import configured_plant
from pneumo.selection.runs import simulate
from pneumo.storage.files import write_json
from pneumo.storage.seal import hashes_without_seal


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


def test_check_says_what_the_catalogues_conductance_is_worth_and_shows_wrong_units(inside, tmp_path):
    inside("init", "mine.yaml")
    code, out, _ = inside("check", "mine.yaml")
    assert code == 0
    origin = "estimated from 3 measured cylinders, 20 and 32 mm bore; 95 % interval 0.099 to 0.73 W/K"
    assert f"mine: k_0 = 0.27 W/K, {origin}; measure it with `pneumo fit" in out and "hardly" not in out
    force = f"{np.pi / 4 * 0.025**2 * (7e5 - 101325):.3g} N"
    line = f"mine: 25 x 160 mm, 3 kg, supply 7 bar absolute: at most {force} and, with its valve, about "
    assert line in out
    assert "exceeds" not in out
    for slip, words in (
        ("closed_loop: {amplitude_mm: 1500}", "closed: its signal of 1.5 m exceeds half the stroke, 0.08 m"),
        ("open_loop: {amplitude_V: 24}", "open: its signal of 24 V exceeds the command's limit, 10 V"),
        (
            "closed_loop: {k_p_V_per_m: 0.1}",
            "closed: a reference of 15 mm opens the valve by 0.0015 V of 10 V",
        ),
        ("open_loop: {amplitude_V: 0.01}", "open: its signal opens the valve by 0.01 V of 10 V only"),
    ):
        (tmp_path / "slip.yaml").write_text(f"cylinders: {{mine: {{{slip}}}}}")
        assert words in inside("check", "mine.yaml", "slip.yaml")[1]


def test_what_check_models_and_version_print(inside):
    code, out, _ = inside("check", ROOT / "config/paper.yaml")
    assert code == 0 and "paper: 16 experiments, n = 1.0, 1.05" in out and "estimated from" not in out
    assert "E03  cylinder E  open   loop  k_0 = 0.02 W/K  1800 s, step 1 ms" in out
    code, out, _ = inside("models")
    assert code == 0 and all(f"M{i} " in out for i in range(1, 11))
    assert inside("--version") == (0, f"{__version__}\n", "")


@pytest.mark.parametrize(("group", "words"), [(app, []), (paper, ["paper"])])
def test_help_names_every_command_and_each_has_its_own(group, words, inside):
    names = [command.callback.__name__.replace("_", "-") for command in group.registered_commands]
    code, out, _ = inside(*words, "--help")
    assert code == 0 and names and all(f"  {name} " in out for name in names)
    assert not re.search(r"^  \w.*\.\.\.$", out, re.MULTILINE)  # typer cuts what is too long for the line
    for name in names:
        code, out, _ = inside(*words, name, "--help")
        assert code == 0 and "Usage" in out


def test_shell_completion_knows_the_commands():
    completion = {"_PNEUMO_COMPLETE": "complete_bash", "COMP_WORDS": "pneumo paper ver", "COMP_CWORD": "2"}
    code = "import sys; sys.argv[0] = 'pneumo'; from pneumo.cli.commands import main; main()"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=os.environ | completion, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.split() == ["verdict", "verify"], done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        *((["chek"], ["No such command"]), ([], ["Missing command"]), (["check"], ["Missing argument"])),
        (["paper", "explain"], ["Missing argument 'what'; see `pneumo paper explain --help`"]),
        (["check", "none.yaml"], ["none.yaml", "cannot be read"]),
        (["check", str(ROOT / "README.md")], ["README.md", "YAML"]),
        (["check", str(ROOT / "config/smoke.yaml")], ["config/smoke.yaml", "gas: missing"]),
        (["paper", "ensemble", "--results", "nowhere"], ["nowhere/ensemble.nc", "snakemake -j2 ensemble"]),
        (["paper", "assumptions", "--results", "nowhere"], ["nowhere/assumptions.nc", "j2 evidence`"]),
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
    assert inside("paper", "verify") == (0, "results: 1 files unchanged since they were written\n", "")
    (folder / "settling.nc").write_text("foreign")
    code, out, err = inside("paper", "verify")
    assert code == 2 and "results/settling.nc: does not end" in out
    assert "pneumo paper verify --remove" in err
    code, out, _ = inside("paper", "verify", "--remove", "results")
    assert code == 0 and "; removed" in out
    assert [file.name for file in folder.iterdir()] == ["parameters.json"]


def test_verify_finds_a_flipped_byte_in_a_page_or_figure(inside, tmp_path):
    folder = tmp_path / "results"
    (folder / "logs").mkdir(parents=True)
    (folder / "figures").mkdir()
    write_json('{\n "name": "test"\n}\n', folder / "parameters.json")
    made = [Path("results/verdict.html"), Path("results/figures/fig01.svg"), Path("results/parameters.json")]
    for file in made[:2]:
        file.write_text("as it was made")
    (folder / "logs/pages.log").write_text(f"pages: 0.10 s\n{hashes_without_seal(made)}")
    assert inside("paper", "verify") == (0, "results: 3 files unchanged since they were written\n", "")
    (folder / "figures/fig01.svg").write_text("as it Was made")
    code, out, _ = inside("paper", "verify")
    assert code == 2 and out.startswith(
        "results/figures/fig01.svg: damaged: its SHA-256 is not the one in the log"
    )
    assert inside("paper", "verify", "--remove")[0] == 0 and not (folder / "figures/fig01.svg").exists()
    code, out, err = inside("paper", "verify")
    assert code == 2 and out.startswith("results/figures/fig01.svg: missing: the log of its job lists it")
    assert "1 damaged or missing files" in err


def test_verify_names_what_it_cannot_check(inside, tmp_path):
    folder = tmp_path / "results"
    (folder / "logs").mkdir(parents=True)
    write_json('{\n "name": "test"\n}\n', folder / "parameters.json")
    for name in ("README.md", "logs/datum.log", "bench.json", *(f"mine{number}.txt" for number in range(5))):
        (folder / name).write_text("mine")
    code, out, _ = inside("paper", "verify")
    names = "6 files: bench.json, mine0.txt, mine1.txt, mine2.txt, mine3.txt, ..."
    assert code == 0 and out.splitlines()[0].endswith(f"not checked, since they have no SHA-256: {names}")


AT = ["--u", "1", "--P_A", "5e5", "--P_B", "6e5"]


def test_linearise_prints_the_matrices_and_takes_the_only_cylinder_and_conductance(inside, tmp_path):
    inside("init", "mine.yaml")
    code, out, _ = inside("linearise", "M8", "--n", 1.3, *AT, "--config", "mine.yaml", "--json")
    plant = configured_plant(study(load(tmp_path / "mine.yaml")), "mine")
    linear = linearise("M8", 1.3, plant, u=1.0, P_A=5e5, P_B=6e5)
    printed = json.loads(out)
    assert (code, printed["A"], printed["B"]) == (0, linear.A.tolist(), linear.B.tolist())
    given = ["--cylinder", "mine", "--k0", 0.3, "--config", "mine.yaml"]
    linear = linearise("M8", 1.3, plant._replace(k_0=0.3), u=1.0, P_A=5e5, P_B=6e5)
    code, out, _ = inside("linearise", "M8", "--n", 1.3, *AT, *given)
    assert code == 0 and f"{linear.A[0, 0]:.6g}" in out and "u (V)" in out
    low = ["--u", 1, "--P_A", 5e4, "--P_B", 6e5]
    code, _, err = inside("linearise", "M8", "--n", 1.3, *low, *given)
    assert code == 0 and "note: P_A = 50000 Pa, outside 101325 (atmosphere) to 700000 (supply)\n" in err
    assert "note: the point is not an equilibrium: dP_A/dt = " in err and err.count("Pa/s") == 2
    in_bar = ["--u", 1, "--P_A", 5, "--P_B", 6e5]
    assert_one_line(inside("linearise", "M8", "--n", 1.3, *in_bar, *given), "P_A = 5 Pa", "is it in bar?")


def test_an_export_names_its_files_states_and_inputs_and_how_to_test_it(inside, tmp_path):
    inside("init", "mine.yaml")
    code, out, _ = inside("export", "full", "--to", "c", "--config", "mine.yaml", "-o", "full.c")
    assert code == 0 and "full.c, full.h, full_test.c: written\n" in out
    assert "states P_A, T_A, P_B, T_B; inputs u, x, v\n" in out
    command = out.splitlines()[-1].removeprefix("Test it: ")
    assert subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True).returncode == 0  # noqa: S602


def test_the_keys_of_a_configuration_are_printed(inside):
    code, out, _ = inside("init", "--keys")
    assert code == 0 and out == (ROOT / "config/README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["export", "M1", "--n", 1.35, "--to", "matlab"], "--n = 1.35: M1 has no polytropic index"),
        (["linearise", "full", "--n", 1.3, "--u", 1, "--P_A", 5e5, "--P_B", 5e5], "--n = 1.3: full has no"),
        (["export", "m8", "--n", 1.35, "--to", "matlab"], "model 'm8': no such model, perhaps M8"),
        (["fit", "a.csv", "--model", "M7", "--model", "m8"], "model 'm8': no such model, perhaps M8"),
        (["linearise", "Full", *AT], "model 'Full': no such model, perhaps full"),
        (
            ["linearise", "M99", *AT],
            f"no such model; there are {', '.join(MODELS)} and full",
        ),
    ],
)
def test_an_index_without_use_and_a_name_in_small_letters_are_refused(arguments, words, inside):
    inside("init")
    assert_one_line(inside(*arguments, "--config", "cylinder.yaml"), words)


@pytest.mark.parametrize(
    "command",
    [
        ["check", "heavy.yaml"],
        ["init", "copy.yaml", "--from", "heavy.yaml"],
        ["linearise", "M1", *AT, "--config", "heavy.yaml"],
        ["export", "M1", "--to", "casadi", "--config", "heavy.yaml"],
    ],
)
def test_a_piston_that_cannot_move_is_refused_unless_it_is_trusted(command, inside, tmp_path):
    inside("init")
    text = (tmp_path / "cylinder.yaml").read_text(encoding="utf-8")
    assert "load_N: 0.0" in text
    (tmp_path / "heavy.yaml").write_text(text.replace("load_N: 0.0", "load_N: 3e5"), encoding="utf-8")
    words = "heavy.yaml: cylinders.mine.load_N = 300000.0: the piston cannot move back"
    assert_one_line(inside(*command), words, "--trust")
    assert inside(*command, "--trust")[0] == 0


@pytest.mark.parametrize("command", [["study"], ["show", "a.csv", "--config"], ["fit", "a.csv", "--config"]])
def test_trust_goes_on_to_what_comes_next(command, inside, tmp_path):
    inside("init")
    (tmp_path / "heavy.yaml").write_text("{cylinders: {mine: {load_N: 3e5}}, run: {experiments: [none]}}")
    words = "run.experiments = 'none': no such experiment"  # a mistake comes before what is not plausible
    more = ["heavy.yaml"] if command == ["study"] else ["--config", "heavy.yaml"]
    assert_one_line(inside(*command, "cylinder.yaml", *more), words)
    (tmp_path / "heavy.yaml").write_text("{cylinders: {mine: {load_N: 3e5}}}")
    assert_one_line(inside(*command, "cylinder.yaml", *more), "load_N = 300000.0: the piston cannot move")
    only = ["--cylinder", "none"]
    assert_one_line(inside(*command, "cylinder.yaml", *more, "--trust", *only), "there are mine")


def test_all_bad_rows_are_printed_each_in_a_line(inside, tmp_path):
    inside("init", "plant.yaml", "--table")
    table = (tmp_path / "plant.csv").read_text()
    (tmp_path / "plant.csv").write_text(table.replace(",25.0,", ",-25.0,"))
    code, out, err = inside("check", "plant.yaml")
    assert (code, out) == (2, "") and len(err.splitlines()) == 2
    for row, line in enumerate(err.splitlines(), start=2):
        assert line.startswith(f"pneumo: plant.csv: row {row}, column bore_mm = -25.0: must be a number")


@pytest.mark.parametrize("command", [["linearise", "M1", *AT], ["export", "M1", "--to", "casadi"]])
def test_a_choice_between_cylinders_or_conductances_is_left_to_the_user(command, inside):
    command = [*command, "--config", ROOT / "config/paper.yaml"]
    assert_one_line(inside(*command), "--cylinder: missing; there are D, E")
    assert_one_line(inside(*command, "--cylinder", "F"), "no such cylinder; there are D, E")
    assert_one_line(inside(*command, "--cylinder", "D"), "--k0: missing; cylinder D has 0.02, 0.0999")
    assert inside(*command, "--cylinder", "D", "--k0", 0.1)[0] == 0


QUICK = "n: [1.2, 1.3]\nrun: {seeds: 2, duration_limit_s: 0.3}\n"


def test_init_then_study(inside, tmp_path):
    assert inside("init")[:2] == (0, "cylinder.yaml: written; edit it, then: pneumo study cylinder.yaml\n")
    (tmp_path / "quick.yaml").write_text(QUICK)
    code, out, _ = inside("study", "cylinder.yaml", "quick.yaml")
    assert code == 0 and all(f" M{i} " in out for i in range(1, 11))
    assert "mine: open, closed, 2 runs each" in out and "Next: pneumo export " in out
    assert "open: thermal " in out and ", exchange " in out and " full order " in out
    files = sorted(file.name for file in (tmp_path / "study-cylinder-quick").iterdir())
    assert files == ["study.html", "study.nc"]
    options = ["--experiment", "open", "--seeds", 1, "-o", "one"]
    code, out, _ = inside("study", "cylinder.yaml", "quick.yaml", *options)
    assert code == 0 and "mine: open, 1 runs each" in out and (tmp_path / "one" / "study.nc").exists()


def test_a_configuration_begins_with_another_as_it_is_if_it_is_one(inside, tmp_path):
    text = "# found\n" + (ROOT / "config/paper.yaml").read_text(encoding="utf-8")
    (tmp_path / "fitted.yaml").write_text(text, encoding="utf-8")
    assert inside("init", "next.yaml", "--from", "fitted.yaml")[0] == 0
    assert (tmp_path / "next.yaml").read_text(encoding="utf-8") == text
    (tmp_path / "fitted.yaml").write_text("cylinders: 3")
    code, _, told = inside("init", "third.yaml", "--from", "fitted.yaml")
    assert code == 2 and "fitted.yaml: " in told and not (tmp_path / "third.yaml").exists()


WRONG = {
    "no file": (["study"], "Missing argument 'files'"),
    "absent file": (["study", "none.yaml"], "none.yaml: cannot be read"),
    "a folder": (["study", "."], ".: cannot be read"),
    "no number": (["study", "cylinder.yaml", "--seeds", "many"], "--seeds"),
    "from, no cylinder": (["study", "--from", "results"], "--from RESULTS needs one --cylinder NAME"),
    "from and files": (["study", "cylinder.yaml", "--from", "results", "--cylinder", "a"], "no files"),
    "from nowhere": (["study", "--from", "results", "--cylinder", "a"], "results/fleet.nc: no such file"),
    "too few seeds": (["study", "cylinder.yaml", "--seeds", "0"], "--seeds"),
    "too few threads": (["study", "cylinder.yaml", "--threads", "0"], "--threads"),
    "unknown option": (["study", "cylinder.yaml", "--seed", "3"], "No such option"),
    "unknown cylinder": (["study", "cylinder.yaml", "--cylinder", "D"], "in this study; there are mine"),
    "unknown experiment": (["study", "cylinder.yaml", "--experiment", "E01"], "there are closed, open"),
    "output is a file": (["study", "cylinder.yaml", "-o", "cylinder.yaml"], "is a file"),
    "foreign page": (["study", "cylinder.yaml", "-o", "foreign"], "study.html: not written by"),
    "init twice": (["init", "cylinder.yaml"], "already exists; not overwritten"),
    "init into a folder": (["init", "foreign"], "already exists; not overwritten"),
    "init from and table": (["init", "a.yaml", "--from", "cylinder.yaml", "--table"], "cannot be combined"),
    "init too much": (["init", "a.yaml", "b.yaml"], "unexpected extra argument"),
    "wrong unit": (["study", "cylinder.yaml", "wrong.yaml"], "cylinders.mine.stroke_cm = 16: unknown key"),
}


@pytest.mark.parametrize("mistake", WRONG)
def test_wrong_use_is_one_line_and_changes_no_file(mistake, inside, tmp_path):
    inside("init")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "study.html").write_text("mine")
    (tmp_path / "wrong.yaml").write_text("cylinders: {mine: {stroke_cm: 16}}")
    arguments, words = WRONG[mistake]
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
    assert (tmp_path / "study-cylinder-wild" / "study.html").exists()


def run_with_output(output, *arguments):
    """Run a command in a process of its own, its standard output led to a file; give exit code and error."""
    done = subprocess.run([*PNEUMO, *arguments], cwd=ROOT, stdout=output, stderr=subprocess.PIPE, text=True)
    return done.returncode, done.stderr


CHECK = ["check", "config/paper.yaml"]


@pytest.mark.parametrize("arguments", in_brief([["--version"], ["models"], CHECK], [CHECK]))
def test_a_full_disk_or_a_pipe_that_nobody_reads_is_one_line(arguments):
    with Path("/dev/full").open("w") as full:
        assert run_with_output(full, *arguments) == (2, "pneumo: output: No space left on device\n")
    reader, writer = os.pipe()
    os.close(reader)
    assert run_with_output(writer, *arguments) == (2, "pneumo: output: Broken pipe\n")
    os.close(writer)


@pytest.mark.parametrize(
    "arguments",
    [
        ["study", "cylinder.yaml", "-o", "there/new/folder"],
        ["fit", "absent.csv", "--config", "cylinder.yaml", "-o", "there"],
        ["paper", "identify", "cylinder.yaml", "-o", "there/new/identification.nc"],
    ],
)
def test_a_folder_that_cannot_be_written_is_refused_before_any_work(arguments, inside, tmp_path, monkeypatch):
    inside("init")
    (tmp_path / "there").mkdir()
    monkeypatch.setattr(os, "access", lambda path, mode: not (mode & os.W_OK))  # read-only, for root too
    assert_one_line(inside(*arguments), "there", "cannot be written; name another folder")
    assert list((tmp_path / "there").iterdir()) == []


def test_a_disk_that_fills_up_is_one_line(inside, tmp_path, monkeypatch):
    def full(*_arguments, **_options):
        raise OSError(errno.ENOSPC, "No space left on device", "study-cylinder-quick/study.nc.part")

    inside("init")
    (tmp_path / "quick.yaml").write_text(QUICK)
    monkeypatch.setattr("pneumo.publish.pages.study_page.save_cells", full)
    code, _, err = inside("study", "cylinder.yaml", "quick.yaml", "--experiment", "open", "--seeds", 1)
    line = "pneumo: study-cylinder-quick/study.nc.part: No space left on device"
    assert (code, err.splitlines()[-1]) == (2, line)


def test_what_the_locale_cannot_write_is_escaped(tmp_path):
    environment = os.environ | {"PYTHONIOENCODING": "latin-1", "PYTHONPATH": str(ROOT)}
    options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True}
    done = subprocess.run([*PNEUMO, "init", "Kolben-Ω/z.yaml"], **options)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Kolben-\\u03a9/z.yaml: written")


def test_ctrl_c_is_one_line_at_work_and_while_pneumo_still_imports(inside, tmp_path, monkeypatch, capsys):
    line = "pneumo: interrupted\n"
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt")  # what is imported first
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    done = subprocess.run([*PNEUMO, "models"], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (INTERRUPTED, line)

    def interrupted(*_files):
        raise KeyboardInterrupt

    monkeypatch.setattr("pneumo.configuration.parameters.read_sources", interrupted)
    monkeypatch.setattr(sys, "argv", ["pneumo", "check", "a.yaml"])
    with pytest.raises(SystemExit) as end:
        first_main()
    assert end.value.code == INTERRUPTED and capsys.readouterr().err.endswith(line)


@pytest.mark.parametrize("side", ["both", "A"])
def test_chambers_closed_after_the_end_of_the_record_are_refused(side, inside, tmp_path):
    inside("init")
    write_measurement(tmp_path)
    options = ["--config", "cylinder.yaml", "--trust", "--closed", side]
    code, _, err = inside("fit", "bench.csv", *options, "--closed-from", 10)
    assert code == 2 and "pneumo: --closed-from 10 s: leaves 0 samples" in err


def write_measurement(path):
    """Write 1.5 s of the template's cylinder at work, off its stops, its pressures with noise."""
    plant = configured_plant(study(load(path / "cylinder.yaml")))
    steps = np.arange(1500)
    run = simulate(plant, 1e-3, command=1.5 * np.sign(np.cos(steps / 60) + np.cos(steps / 23)) - 0.2)
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
    assert "Ranked" in out and "fitted/fit.html, fitted/fit.nc and fitted/fitted.yaml: written" in out
    assert "M6: rms" in err and "M2: rms" in err
    with xr.open_dataset(tmp_path / "fitted" / "fit.nc") as fit:
        k = fit.sel(model="M6", parameter="k_xu")
        assert k["low"] < k["estimate"] < k["high"]
        # The model without heat is not the truth; the valve's coefficient is what flows, to a tenth.
        assert k["estimate"].item() == pytest.approx(plant.valve.k_xu, rel=0.1)
        ranked = np.sqrt((fit["rms_held_out"] ** 2).mean("chamber")).values
        assert ranked[0] < ranked[1]
        C = sonic_conductance(plant.valve, plant.gas) * k["estimate"].item() / plant.valve.k_xu
    assert "(dm³/(s bar))" in out and "k_x k_u" not in out  # as the template has the valve
    assert f"{significant(C)} (" in out
    (tmp_path / "leak.yaml").write_text("cylinders: {mine: {valve: {leak_dm3_per_sbar: 0.01}}}")
    assert_one_line(inside(*called, "M6", "--config", "leak.yaml"), "leak_dm3_per_sbar")


@pytest.mark.slow
def test_what_was_fitted_is_studied_linearised_and_exported(inside, tmp_path):
    inside("init")
    plant = write_measurement(tmp_path)
    code, _, err = inside("fit", "bench.csv", "--config", "cylinder.yaml", "--model", "M7", "-o", ".")
    assert code == 0, err
    with xr.open_dataset("fit.nc") as fit:
        of_full = fit["estimate"].sel(model="full")
        estimates = {name: of_full.sel(parameter=name).item() for name in ("k_0", "k_xu")}
        n, k_0 = (fit["estimate"].sel(model="M7", parameter=name).item() for name in ("n", "k_0"))
    # The rig's own: intervals are within 3 %.
    assert estimates == pytest.approx({"k_0": plant.k_0, "k_xu": plant.valve.k_xu}, rel=0.05)
    (tmp_path / "quick.yaml").write_text("run: {seeds: 1, duration_limit_s: 0.3}\n")
    code, out, err = inside("study", "fitted.yaml", "quick.yaml")
    assert code == 0, err
    with xr.open_dataset("study-fitted-quick/study.nc") as cells:
        assert cells["k_0"].values == pytest.approx(estimates["k_0"], rel=1e-5)  # six digits are written
    code, out, err = inside("check", "fitted.yaml")
    assert code == 0 and f"k_0 = {estimates['k_0']:.6g} W/K" in out, err
    at = ["--u", "0.1", "--P_A", "5e5", "--P_B", "5e5"]
    options = ["--n", f"{n:.6g}", "--k0", f"{k_0:.6g}"]
    assert f"M7 {' '.join(options)}" in (tmp_path / "fitted.yaml").read_text(encoding="utf-8")
    code, _, err = inside("linearise", "M7", *options, "--config", "fitted.yaml", *at)
    assert code == 0, err
    code, out, err = inside("export", "M7", *options, "--to", "matlab", "--config", "fitted.yaml")
    assert code == 0, err
    k_xu = next(line for line in out.splitlines() if line.strip().startswith("k_xu"))
    assert float(k_xu.split("=")[1].split(";")[0]) == pytest.approx(estimates["k_xu"], rel=1e-5)
