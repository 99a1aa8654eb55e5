"""The command line: what it prints, and one line with exit code 2 for what the user can mend."""

import subprocess
import sys
from pathlib import Path

import pytest

from pneumo.cli import main
from pneumo.store import write_json

ROOT = Path(__file__).parents[1]


def pneumo(*arguments: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    code = "from pneumo.cli import main; main()"
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
    commands = ("check", "models", "explain", "verdict", "assumptions", "identify", "verify", "export")
    assert all(command in done.stdout for command in commands)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "config/none.yaml"], ["config/none.yaml", "cannot be read"]),
        (["check", "README.md"], ["README.md", "YAML"]),
        (["check", "config/smoke.yaml"], ["config/smoke.yaml", "gas: missing"]),
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
