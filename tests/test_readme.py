"""README: length, links, picture, generated blocks and commands; test_docs.py has its `make` targets."""

import re

import numpy as np
import pandas as pd
import pytest
from checkout import ROOT
from hypothesis import Phase, settings
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.configuration.parameters import load, study
from pneumo.publish.style import save
from pneumo.runs import simulate
from pneumo.selection.plants import configured_plant

README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = r"<!--generated: print\((\w+)\(\)\) -->\n(.*?)\n<!--end-->"


@pytest.fixture(autouse=True)
def in_the_checkout(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_links_and_the_picture_exist():
    targets = re.findall(r"\]\((?!https?:)([^)#]+)\)", README)
    assert len(targets) >= 12
    assert [target for target in targets if not (ROOT / target).is_file()] == []
    assert re.findall(r"!\[[^]]+\]\((.*)\)", README) == ["paper/readme/verdict.png"]


def test_generated_blocks_are_current(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import readme_blocks

    blocks = dict(re.findall(BLOCK, README, re.DOTALL))
    assert README.count("<!--") == 2 * len(blocks) == 6
    for name, text in blocks.items():
        assert text == getattr(readme_blocks, name)(), "run: make numbers"


@pytest.mark.results
@pytest.mark.slow
def test_picture_is_of_these_results(results, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import opening_picture

    _, drawn = save(opening_picture.verdict_figure(results), tmp_path / "verdict")
    # Not compared in the assertion: pytest would look for the difference of two pictures for minutes.
    same = opening_picture.PICTURE.read_bytes() == drawn.read_bytes()
    assert same, "run: make numbers"


def python_of_readme(word: str) -> str:
    """Return the block of Python in which a word occurs."""
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", README, re.DOTALL) if word in block)
    return code


@pytest.mark.results
def test_look_at_the_results_prints_what_is_shown(capsys):
    exec(python_of_readme("open_grid"), {})  # noqa: S102
    assert f"```text\n{capsys.readouterr().out.rstrip()}\n```" in README, "run: make numbers"


def test_property_test_runs_and_notices_a_wrong_index():
    names: dict = {}
    code = python_of_readme("hypothesis")
    exec(code, names)  # noqa: S102
    names["test_M7_without_wall_heat_is_M5"]()
    assert code.count("k_0=0.0") == 1
    exec(code.replace("k_0=0.0", "k_0=1.0"), names)  # noqa: S102
    wrong = settings(phases=[Phase.generate])(names["test_M7_without_wall_heat_is_M5"])  # not simplified
    with pytest.raises(AssertionError):
        wrong()


def bench_record(configuration: str, record: str) -> None:
    """Write the record of a simulated run of a configuration's cylinder."""
    plant = configured_plant(study(load(configuration)))
    steps = np.arange(1000)
    run = simulate(plant, 1e-3, command=1.5 * np.sign(np.cos(steps / 60) + np.cos(steps / 23)) - 0.2)
    noise = np.random.default_rng(1).normal(0.0, 500.0, (2, len(run.t)))
    columns = {"t_s": run.t, "u_V": run.u, "x_mm": 1e3 * run.x}
    columns |= {"P_A_Pa": run.P_A + noise[0], "P_B_Pa": run.P_B + noise[1]}
    pd.DataFrame(columns).to_csv(record, index=False)


@pytest.mark.slow
def test_commands_run_in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"^pneumo ([^#\n]+)", README, re.MULTILINE)
    assert [command.split()[0] for command in commands] == ["init", "study", "fit", "export"]
    printed = ""
    for command in commands:
        if command.startswith("fit"):
            bench_record("my.yaml", "bench.csv")
        done = CliRunner().invoke(app, command.split())
        assert done.exit_code == 0, f"{command}: {done.output}"
        assert not command.startswith("study") or len(done.stdout.splitlines()) < 24  # a terminal's lines
        printed += done.stdout
    shown = dict(re.findall(BLOCK, README, re.DOTALL))["study_answer"].strip("`").removeprefix("text\n")
    for part in shown.split("\n...\n"):  # the table is left out
        assert " ".join(part.split()) in " ".join(printed.split()), "run: make numbers"
    assert (tmp_path / "study-my/study.html").is_file() and (tmp_path / "study-my/study.nc").is_file()
    assert "int full_step(" in (tmp_path / "full.c").read_text()
