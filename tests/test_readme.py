"""README: named files, generated blocks, pictures, code and commands; test_docs.py has its `make` targets."""

import re

import pytest
from checkout import ROOT
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.verdict.judging import AGREEING, read_statuses

README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCK = r"<!--generated: print\((\w+)\(\)\) -->\n(.*?)\n<!--end-->"


@pytest.fixture(autouse=True)
def in_the_checkout(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_named_files_and_folders_links_and_pictures_exist():
    made = ("results/", "site/")  # by the study and by `make docs`
    names = {name for name in re.findall(r"`([\w./]+/[\w./]*)`", README) if not name.startswith(made)}
    assert len(names) >= 9
    assert [name for name in sorted(names) if not (ROOT / name).exists()] == []
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target
    # Made by tests/readme_pictures.py; their bytes are a browser's.
    for name in ("report", "live"):
        picture = (ROOT / f"paper/readme/{name}.png").read_bytes()
        assert picture[1:4] == b"PNG" and int.from_bytes(picture[16:20], "big") == 1200
        assert len(picture) < 300_000
        assert f"(paper/readme/{name}.png)" in README


def test_generated_blocks_are_current(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import readme_blocks

    blocks = dict(re.findall(BLOCK, README, re.DOTALL))
    assert README.count("<!--") == 2 * len(blocks) <= 8  # so no tag stands inside a sentence
    for name, text in blocks.items():
        assert text == getattr(readme_blocks, name)(), "run: make numbers"


@pytest.mark.results
def test_picture_is_the_workflows(results):
    assert (ROOT / "paper/readme/traces.png").read_bytes() == (results / "figures/traces.png").read_bytes()


def pneumo(command: str, *more: str) -> str:
    """Output of a command of pneumo."""
    done = CliRunner().invoke(app, [*command.split(), *more])
    assert done.exit_code == 0, done.output
    return done.output


def output_of_section(section: str, capsys) -> str:
    """Output of a section's Python."""
    code = re.search(rf"^## {section}\n(?:(?!^## ).)*?```python\n(.*?)```", README, re.DOTALL | re.MULTILINE)
    assert code
    exec(code.group(1), {"__name__": "__main__"})  # noqa: S102 - the project's own page
    return capsys.readouterr().out


@pytest.mark.results
def test_cell_opens(results, capsys):
    assert len(output_of_section("Open a cell", capsys).strip("[] \n").split()) == 2


def test_use_in_code_and_export(capsys, tmp_path, monkeypatch):
    numbers = re.findall(r"[-\d.e+]+", output_of_section("Use in code", capsys))
    assert len(numbers) == 2 + 4
    assert all(0 < float(mse) < 1e9 for mse in numbers[:2])
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"(?:^|`)pneumo ((?:init my|linearise|export)[^#`]+)[#`]", README, re.MULTILINE)
    assert [command.split()[0] for command in commands] == ["init", "linearise", "export"]
    for command in commands:
        pneumo(command)
    assert "int M8_step(" in (tmp_path / "m8.c").read_text()


@pytest.mark.results
def test_named_commands_answer(results):
    commands = re.findall(r"`pneumo ((?:paper )?explain [^`]+)`", README)
    assert len(commands) == 2
    assert all("M8" in pneumo(command) for command in commands)
    shown = commands[0].split()[-1]
    assert read_statuses(ROOT / "paper/2006")[shown] in AGREEING, "README shows an item that agrees"
