"""The blocks of a fleet that the Snakefile plans, and what their jobs may need."""

from pathlib import Path

import pytest

from pneumo.configuration.parameters import Sources, load, study
from pneumo.selection.cylinder_template import write_table_template
from workflow.jobs.fleet_plan import checked_fleet

CONFIG = {"cylinders": "fleet.csv"}  # what Snakemake has read


@pytest.fixture
def fleet_of(tmp_path, monkeypatch):
    """Plan a fleet of so many cylinders in the current folder."""
    monkeypatch.chdir(tmp_path)
    write_table_template(Path("fleet.yaml"))
    head, row, _ = Path("fleet.csv").read_text().splitlines()

    def plan(count, options=None, *, check=True):
        rows = [row.replace("first", f"c{i}") for i in range(count)]
        Path("fleet.csv").write_text("\n".join([head, *rows]))
        return checked_fleet(CONFIG, [Path("fleet.yaml").absolute()], options or {}, check=check)

    return plan


def test_blocks_divide_the_rows_and_each_is_a_configuration_of_its_own(fleet_of):
    fleet = fleet_of(7, {"run": {"block_size": 3}})
    assert list(fleet.blocks) == ["000000", "000003", "000006"]
    assert [name for names in fleet.blocks.values() for name in names] == [f"c{i}" for i in range(7)]
    assert list(Sources(fleet.content("000006")).validated().cylinders) == ["c6"]
    whole, parts = study(load("fleet.yaml")).experiments, {}
    for block in fleet.blocks:
        parts |= study(Sources(fleet.content(block)).validated()).experiments
    assert parts == whole
    assert len(fleet_of(101).blocks) == 3  # of 50
    assert checked_fleet({"cylinders": {"mine": {}}}, [], {}, check=True) is None


def test_all_bad_rows_are_named_and_rows_that_cannot_move_unless_they_are_trusted(fleet_of, capsys):
    fleet_of(3)
    table = Path("fleet.csv").read_text()
    files = [Path("fleet.yaml").absolute()]
    for bore, words in (("-25.0", "must be a number greater than 0"), ("0.025", "below 1 mm")):
        text = "\n".join(row.replace(",25.0,", f",{bore},") for row in table.splitlines())
        Path("fleet.csv").write_text(text.replace(",10.0,3.0,", ",0.0,3.0,"))
        with pytest.raises(SystemExit):
            checked_fleet(CONFIG, files, {}, check=True)
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 3 and all(line.startswith("pneumo: fleet.csv: row ") for line in lines)
        assert all(words in line for line in lines)
    fleet = checked_fleet(CONFIG, files, {}, check=True, trust=True)
    assert fleet and len(fleet.blocks) == 1


def test_a_signal_that_cannot_be_read_is_refused_before_the_jobs(fleet_of, capsys):
    signal = {"kind": "csv", "file": "u.csv", "column": "u", "hold_s": 0.1}
    options = {"experiments": {"open": {"signal": signal}}}
    with pytest.raises(SystemExit):
        fleet_of(2, options)
    assert "signal.file = 'u.csv': cannot be read" in capsys.readouterr().err
    Path("u.csv").write_text("u\n1\n-1\n")
    assert fleet_of(2, options).signal_files() == ["u.csv"]
