"""The command line: what it prints, and one line with exit code 2 for what the user can mend."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from bad_input import assert_one_line
from brief import in_brief
from checkout import PNEUMO, ROOT

from pneumo.cli import BROKEN_PIPE, INTERRUPTED
from pneumo.cli import main as first_main
from pneumo.configuration.parameters import load, study
from pneumo.linear.linear_model import linearise
from pneumo.physics.models import MODELS
from pneumo.selection.plants import configured_plant
from workflow.jobs.checksums import write_sums

LOADED = "import sys; from pneumo.cli.commands import main\ntry: main()\nfinally: print(*sys.modules)"


@pytest.mark.parametrize("arguments", [["--help"], ["models"], ["check", "config/paper.yaml"]])
def test_commands_that_compute_nothing_load_no_scipy(arguments):
    command = [sys.executable, "-c", LOADED, *arguments]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert {"typer"} == {"typer", "scipy", "xarray"} & set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    ("arguments", "unneeded"),
    [
        (["study", "c.yaml", "--seeds", "1"], {"matplotlib", "sympy", "scipy.stats", "scipy.signal"}),
        (["simulate", "c.yaml"], {"matplotlib", "sympy", "scipy", "xarray", "pandas"}),
    ],
)
def test_commands_load_only_the_large_libraries_that_they_use(arguments, unneeded, inside, tmp_path):
    inside("init", "c.yaml")
    (tmp_path / "quick.yaml").write_text("n: [1.2, 1.3]\nrun: {seeds: 1, duration_limit_s: 0.3}\n")
    command = [sys.executable, "-c", LOADED, *arguments[:2], "quick.yaml", *arguments[2:]]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    assert unneeded & set(done.stdout.splitlines()[-1].split()) == set()


def test_check_names_experiments_that_no_level_of_wall_heat_counts(inside, tmp_path):
    paper = str(ROOT / "config/paper.yaml")
    (tmp_path / "levels.yaml").write_text("levels: {typical: [0.1]}\nrun: {experiments: [E09, E10, E13]}\n")
    _, out, _ = inside("check", paper, "levels.yaml")
    notes = [line for line in out.splitlines() if "no level has" in line]
    assert notes == []  # 0.5 and 2.5 W/K are isothermal
    (tmp_path / "levels.yaml").write_text("levels: {isothermal: [0.5]}\nrun: {experiments: [E09, E13]}\n")
    _, out, _ = inside("check", paper, "levels.yaml")
    assert [line.split(":")[0] for line in out.splitlines() if "no level has" in line] == ["E13"]


def test_check_says_what_the_catalogues_conductance_is_worth_and_shows_wrong_units(inside, tmp_path):
    inside("init", "mine.yaml")
    code, out, _ = inside("check", "mine.yaml")
    assert code == 0
    origin = "estimated from 3 measured cylinders, 20 and 32 mm bore; 95 % interval 0.099 to 0.73 W/K"
    assert f"mine: k_0 = 0.27 W/K, {origin}; measure it with `pneumo fit" in out and "hardly" not in out
    force = f"{np.pi / 4 * 0.025**2 * (7e5 - 101325):.3g} N"
    line = f"mine: 25 x 160 mm, 3 kg, supply 7 bar absolute: at most {force} and, with its valve, about "
    assert line in out
    assert "exceeds" not in out and "a bore of" not in out
    for slip, words in (
        ("bore_mm: 50", "a bore of 50 mm is outside those measured, 20 to 32 mm"),
        ("closed_loop: {amplitude_mm: 150}", "closed: its signal of 0.15 m exceeds half the stroke, 0.08 m"),
        ("open_loop: {amplitude_V: 24}", "open: its signal of 24 V exceeds the command's limit, 10 V"),
        (
            "closed_loop: {k_p_V_per_m: 0.1}",
            "closed: a reference of 15 mm opens the valve by 0.0015 V of 10 V",
        ),
        ("open_loop: {amplitude_V: 0.01}", "open: its signal opens the valve by 0.01 V of 10 V only"),
    ):
        (tmp_path / "slip.yaml").write_text(f"cylinders: {{mine: {{{slip}}}}}")
        assert words in inside("check", "mine.yaml", "slip.yaml")[1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        *((["chek"], ["No such command"]), ([], ["Missing command"]), (["check"], ["Missing argument"])),
        (["paper", "explain"], ["Missing argument '", "see `pneumo paper explain --help`"]),
        (["check", "none.yaml"], ["none.yaml", "cannot be read"]),
        (["check", str(ROOT / "README.md")], ["README.md", "YAML"]),
        (["check", str(ROOT / "config/smoke.yaml")], ["config/smoke.yaml", "gas: missing"]),
        (["paper", "explain", "E99", "M8", "1"], ["results/published/replay/E99.nc", "no such file"]),
        (["paper", "verify"], ["holds no SHA256SUMS"]),
    ],
)
def test_bad_input_is_one_line_and_exit_2(arguments, words, inside):
    assert_one_line(inside(*arguments), *words)


def test_verify_names_what_is_not_as_it_was_made(inside, tmp_path):
    folder = tmp_path / "results"
    for name in ("parameters.json", "figures/fig01.svg", "verdict.html", "logs/figures.log"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("as it was made")
    write_sums(folder)
    assert inside("paper", "verify") == (0, "results: 3 files as they were made\n", "")
    before = (folder / "figures/fig01.svg").stat()
    (folder / "figures/fig01.svg").write_text("as it Was made")
    os.utime(folder / "figures/fig01.svg", ns=(before.st_atime_ns, before.st_mtime_ns))
    (folder / "verdict.html").unlink()
    for _ in range(2):
        code, out, err = inside("paper", "verify")
        lines = ["results/figures/fig01.svg: changed or missing", "results/verdict.html: changed or missing"]
        assert code == 2 and out.splitlines() == lines and "2 of 3 files are not as they were made" in err
        (folder / "verdict.html").write_text("made anew")
        write_sums(folder)
        (folder / "verdict.html").unlink()


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
    code, out, _ = inside("export", "full", "--to", "c", "--config", "mine.yaml", "-o", "new/full.c")
    assert code == 0 and out.startswith("new: new folder\nnew/full.c, new/full.h, new/full_test.c: written\n")
    assert "states P_A, T_A, P_B, T_B; inputs u, x, v\n" in out
    piston = inside("export", "full", "--to", "c", "--config", "mine.yaml", "--piston", "-o", "piston.c")
    assert "states x, v, P_A, T_A, P_B, T_B; inputs u, force\n" in piston[1]
    command = out.splitlines()[-1].removeprefix("Test it: ")
    assert subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True).returncode == 0  # noqa: S602


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["export", "M1", "--n", 1.35, "--to", "matlab"], "--n = 1.35: M1 has no polytropic index"),
        (["linearise", "full", "--n", 1.3, "--u", 1, "--P_A", 5e5, "--P_B", 5e5], "--n = 1.3: full has no"),
        (["export", "M7", "--to", "matlab"], "pneumo: n: M7 needs a polytropic index, above 0"),
        (["linearise", "M7", *AT], "n: M7 needs"),
        (["export", "full", "--to", "simulink", "-o", "full.fmu"], "Simulink imports an FMU: use --to fmu"),
        (["export", "full", "--to", "matlab", "-o", "full.slx"], "Simulink imports an FMU: use --to fmu"),
        (["export", "full", "--to", "matlab", "-o", "full.txt"], "--to matlab: needs --output FILE.m"),
        (["export", "m8", "--n", 1.35, "--to", "matlab"], "model 'm8': no such model; there are M1, M2"),
        (["fit", "a.csv", "--model", "M7", "--model", "m8"], "model 'm8': no such model; there are M1, M2"),
        (["linearise", "Full", *AT], "model 'Full': no such model; there are M1, M2"),
        (["linearise", "M99", *AT], f"no such model; there are {', '.join(MODELS)}, full"),
    ],
)
def test_an_index_without_use_and_a_name_in_small_letters_are_refused(arguments, words, inside):
    inside("init")
    assert_one_line(inside(*arguments, "--config", "cylinder.yaml"), words)


@pytest.mark.parametrize(
    "command",
    [
        ["check", "heavy.yaml"],
        ["linearise", "M1", *AT, "--config", "heavy.yaml"],
        ["export", "M1", "--to", "matlab", "--config", "heavy.yaml"],
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


@pytest.mark.parametrize("command", [["linearise", "M1", *AT], ["export", "M1", "--to", "matlab"]])
def test_a_choice_between_cylinders_or_conductances_is_left_to_the_user(command, inside):
    command = [*command, "--config", ROOT / "config/paper.yaml"]
    assert_one_line(inside(*command), "--cylinder: missing; there are D, E")
    assert_one_line(inside(*command, "--cylinder", "F"), "no such cylinder; there are D, E")
    assert_one_line(inside(*command, "--cylinder", "D"), "--k0: missing; cylinder D has 0.02, 0.0999")
    assert inside(*command, "--cylinder", "D", "--k0", 0.1)[0] == 0


def run_with_output(output, *arguments):
    """Run a command in a process of its own, its standard output led to a file; give exit code and error."""
    done = subprocess.run([*PNEUMO, *arguments], cwd=ROOT, stdout=output, stderr=subprocess.PIPE, text=True)
    return done.returncode, done.stderr


CHECK = ["check", "config/paper.yaml"]


@pytest.mark.parametrize("arguments", in_brief([["--version"], ["models"], CHECK], [CHECK]))
def test_a_full_disk_is_one_line_and_a_pipe_that_nobody_reads_none(arguments):
    with Path("/dev/full").open("w") as full:
        assert run_with_output(full, *arguments) == (2, "pneumo: output: No space left on device\n")
    reader, writer = os.pipe()
    os.close(reader)
    assert run_with_output(writer, *arguments) == (BROKEN_PIPE, "")
    os.close(writer)


def test_what_the_locale_cannot_write_is_escaped(tmp_path):
    environment = os.environ | {"PYTHONIOENCODING": "latin-1", "PYTHONUTF8": "1", "PYTHONPATH": str(ROOT)}
    options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True}
    done = subprocess.run([*PNEUMO, "init", "Kolben-Ω/z.yaml".encode()], **options)
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
