"""The blocks of a fleet that the Snakefile plans, and what their jobs may need."""

from pathlib import Path

import pytest

from pneumo.configuration.parameters import load, read_yaml, study, validated
from pneumo.jobs import fleet_plan
from pneumo.jobs.fleet_plan import checked_fleet, resources
from pneumo.selection.cylinder_template import TEMPLATE, write_table_template

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
    assert list(validated(fleet.content("000006"), []).cylinders) == ["c6"]
    whole, parts = study(load("fleet.yaml")).experiments, {}
    for block in fleet.blocks:
        parts |= study(validated(fleet.content(block), [])).experiments
    assert parts == whole
    assert len(fleet_of(101).blocks) == 3  # of 50
    assert checked_fleet({"cylinders": {"mine": {}}}, [], {}, check=True) is None


def test_a_bad_row_is_refused_once_before_the_jobs(fleet_of, capsys):
    fleet_of(2)
    bad = Path("fleet.csv").read_text().replace("c1,25.0", "c1,-25.0")
    assert "-25" in bad
    Path("fleet.csv").write_text(bad)
    files = [Path("fleet.yaml").absolute()]
    with pytest.raises(SystemExit) as end:
        checked_fleet(CONFIG, files, {}, check=True)
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith("pneumo: fleet.csv: row 3, column bore_mm = -25.0: must be")
    assert checked_fleet(CONFIG, files, {}, check=False)  # as in the jobs


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


def test_a_block_of_no_rows_is_refused(fleet_of, capsys):
    for size in (0, "many"):
        with pytest.raises(SystemExit):
            fleet_of(2, {"run": {"block_size": size}})
        assert "--config: run.block_size = " in capsys.readouterr().err


def test_wrong_rows_of_different_blocks_are_named_together(fleet_of, capsys):
    small = {"run": {"block_size": 2}}
    fleet_of(6, small)
    good, files = Path("fleet.csv").read_text(), [Path("fleet.yaml").absolute()]
    for edits, words in (
        ({"c5,": "C1,"}, ["row 7, column name = 'C1': differs from c1 by case"]),
        ({"c0,25.0": "c0,-25.0", "c5,25.0": "c5,wide"}, ["row 2, column bore_mm", "row 7, column bore_mm"]),
    ):
        bad = good
        for before, after in edits.items():
            assert before in bad
            bad = bad.replace(before, after)
        Path("fleet.csv").write_text(bad)
        with pytest.raises(SystemExit):
            checked_fleet(CONFIG, files, small, check=True)
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == len(words) and all(word in line for word, line in zip(words, lines, strict=True))


def test_a_signal_that_cannot_be_read_is_refused_before_the_jobs(fleet_of, capsys):
    signal = {"kind": "csv", "file": "u.csv", "column": "u", "hold_s": 0.1}
    options = {"experiments": {"open": {"signal": signal}}}
    with pytest.raises(SystemExit):
        fleet_of(2, options)
    assert "signal.file = 'u.csv': cannot be read" in capsys.readouterr().err
    Path("u.csv").write_text("u\n1\n-1\n")
    assert fleet_of(2, options).signal_files() == ["u.csv"]


def test_what_a_job_may_need_follows_the_simulated_seconds(fleet_of):
    def planned(count, **changes):
        return resources(validated(fleet_of(count, changes).content("000000"), []))

    one, two = planned(1), planned(2)
    steps = 2 * 20_000 * 5  # experiments, steps of each, seeds
    assert one.seconds == pytest.approx(fleet_plan.SECONDS_PER_STEP * steps * 9)
    assert two.seconds == pytest.approx(2 * one.seconds)
    assert planned(1, run={"seeds": 10}).seconds == pytest.approx(2 * one.seconds)
    assert planned(1, run={"duration_limit_s": 2.0}).seconds == pytest.approx(one.seconds / 10)
    assert planned(1, step_s=0.0005).bytes_per_thread == pytest.approx(2 * one.bytes_per_thread)
    leaking = read_yaml(TEMPLATE)
    leaking["cylinders"]["mine"]["valve"]["leak_dm3_per_sbar"] = 0.1
    assert resources(validated(leaking, [])).seconds == pytest.approx(fleet_plan.LEAKING * one.seconds)
    assert two.runtime(threads=1, attempt=1) < two.runtime(threads=1, attempt=2)
    assert two.mem_mb(threads=1, attempt=1) < two.mem_mb(threads=4, attempt=1) < two.mem_mb(4, 2)
