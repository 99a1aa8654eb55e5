"""What the README says, checked: commands, folders, table, numbers, picture, code."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def between(marker: str) -> str:
    """Text of the README between the comment that begins with a marker and the closing one."""
    name = marker.split(":")[0]
    found = re.search(rf"<!-- {re.escape(marker)}[^>]*-->(.*?)<!-- /{name} -->", README, re.DOTALL)
    assert found, f"README has no {marker}"
    return found.group(1).strip()


def test_make_targets_exist():
    targets = re.findall(r"^make (\w+)", README, re.MULTILINE)
    assert targets == ["reproduce", "test"]
    makefile = (ROOT / "Makefile").read_text()
    assert all(f"\n{target}:" in makefile for target in targets)


def test_named_files_and_folders_exist():
    made = ("results/", "site/")  # by the study and by `make docs`
    names = {name for name in re.findall(r"`([\w./]+/[\w./]*)`", README) if not name.startswith(made)}
    assert len(names) >= 9
    assert [name for name in sorted(names) if not (ROOT / name).exists()] == []


def test_links_and_pictures_exist():
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


@pytest.mark.results
def test_table_7_is_the_workflows(results):
    assert between("table7: generated") == (results / "table7.md").read_text(encoding="utf-8").strip()


@pytest.mark.results
@pytest.mark.parametrize("level", ["adiabatic", "typical"])
def test_ratio_of_M8_to_M7(results, level):
    with xr.open_dataset(results / "exact/statistics.nc") as statistics:
        mse = statistics["mse"].sel(level=level)
        assert between(f"ratio: {level}") == f"{(mse.sel(model='M8') / mse.sel(model='M7')).item():.2f}"


@pytest.mark.results
def test_picture_is_the_workflows(results):
    assert (ROOT / "paper/readme/traces.png").read_bytes() == (results / "figures/traces.png").read_bytes()


def test_picture_of_the_report():
    """Made by tests/report_picture.py; its bytes are a browser's."""
    picture = (ROOT / "paper/readme/report.png").read_bytes()
    assert picture[1:4] == b"PNG" and int.from_bytes(picture[16:20], "big") == 1200
    assert len(picture) < 300_000
    assert "(paper/readme/report.png)" in README


def output_of(code: str, *arguments: str) -> str:
    done = subprocess.run([sys.executable, "-c", code, *arguments], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def pneumo(command: str, *more: str) -> str:
    """Output of a command of pneumo."""
    return output_of("from pneumo.cli.commands import main; main()", *command.split(), *more)


def output_of_section(section: str) -> str:
    """Output of a section's Python."""
    code = re.search(rf"^## {section}\n(?:(?!^## ).)*?```python\n(.*?)```", README, re.DOTALL | re.MULTILINE)
    assert code
    return output_of(code.group(1))


@pytest.mark.results
def test_cell_opens(results):
    assert len(output_of_section("Open a cell").strip("[] \n").split()) == 2


def test_use_in_code():
    numbers = re.findall(r"[-\d.e+]+", output_of_section("Use in code"))
    assert len(numbers) == 2 + 4
    assert all(0 < float(mse) < 1e9 for mse in numbers[:2])


def test_export_writes(tmp_path):
    command = re.search(r"`pneumo (export [^`]+)-o m8.c`", README)
    assert command
    pneumo(command.group(1), "-o", str(tmp_path / "m8.c"))
    assert "void M8_dP_dt(" in (tmp_path / "m8.c").read_text()


@pytest.mark.results
def test_named_commands_answer(results):
    commands = re.findall(r"`pneumo ((?:paper )?explain [^`]+)`", README)
    assert len(commands) == 2
    assert all("M8" in pneumo(command) for command in commands)


@pytest.mark.results
def test_counts_of_the_verdict(results):
    counts = json.loads((results / "verdict.json").read_text())["counts"]
    for status, count in counts.items():
        assert between(f"verdict: {status}") == str(count)
    assert counts.pop("items") == sum(counts.values())
