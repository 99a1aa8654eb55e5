"""What the README says, checked: commands, folders, table, numbers, picture, code."""

import json
import re

import pytest
import xarray as xr
from checkout import ROOT, between
from typer.testing import CliRunner

from pneumo.cli.commands import app
from pneumo.papers.paper_2006.paper_models import PAPER_MODELS
from pneumo.verdict.judging import STATUSES, read_statuses

PAGE = ROOT / "README.md"
README = PAGE.read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def in_the_checkout(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_make_targets_exist():
    targets = re.findall(r"^make (\w+)", README, re.MULTILINE)
    assert targets == ["reproduce", "test"]
    makefile = (ROOT / "Makefile").read_text()
    assert all(f"\n{target}:" in makefile for target in targets)


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


def test_the_ten_models_are_those_of_the_table():
    """Index, temperature, mixing, wall heat and what has to be known, in words."""
    rows = between(PAGE, "models: a test").splitlines()[2:]
    for row, (name, model) in zip(rows, PAPER_MODELS.items(), strict=True):
        explicit = model.wall != "none"
        indices = list(dict.fromkeys(str(i).removesuffix(".0") for i in (model.n_V, model.n_in, model.n_out)))
        words = "by the index: " if len(indices) == 1 else "by the indices: "
        known = ["n"] * model.has_n + (["k_0" if model.wall == "k_0" else "lambda_0"] if explicit else [])
        cells = [
            name,
            {"constant": "constant", "polytropic": "follows the pressure"}[model.temperature],
            "its own temperature" if model.mixing else "the chamber's temperature",
            model.wall if explicit else words + ", ".join(indices),
            ", ".join(known),
        ]
        assert [cell.strip() for cell in row.strip("|").split("|")] == cells


@pytest.mark.results
def test_table_7_is_the_workflows(results):
    assert between(PAGE, "table7: generated") == (results / "table7.md").read_text(encoding="utf-8").strip()


@pytest.mark.results
@pytest.mark.parametrize("level", ["adiabatic", "typical"])
def test_ratio_of_M8_to_M7(results, level):
    with xr.open_dataset(results / "exact/statistics.nc") as statistics:
        mse = statistics["mse"].sel(level=level)
        assert between(PAGE, f"ratio: {level}") == f"{(mse.sel(model='M8') / mse.sel(model='M7')).item():.2f}"


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


def test_counts_of_the_second_verdict():
    statuses = list(read_statuses(ROOT / "paper" / "2007").values())
    assert between(PAGE, "verdict 2007: items") == str(len(statuses))
    for status in STATUSES:
        assert between(PAGE, f"verdict 2007: {status}") == str(statuses.count(status))


@pytest.mark.results
def test_counts_of_the_verdict(results):
    verdict = json.loads((results / "verdict.json").read_text())
    counts = verdict["counts"]
    headline = {f"headline {basis}": verdict["headline"][basis] for basis in ("measured", "fitted")}
    for numbers in verdict["counts_by_basis"].values():
        del numbers["items"]
    for name, numbers in {"": counts, **verdict["counts_by_basis"], **headline}.items():
        for status, count in numbers.items():
            assert between(PAGE, f"verdict: {name} {status}".replace("  ", " ")) == str(count)
    assert counts.pop("items") == sum(counts.values())
