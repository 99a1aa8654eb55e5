"""Result files: what is written comes back, whole or not at all, and reads as CF says without the package."""

import os
import re
import shutil
import sys
import warnings
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from paper_study import STUDY, lasting

import pneumo
from paper.study.averages import statistics
from paper.study.settling_run import settle, settling_dataset
from paper.study.settling_times import settling_table
from paper.study.stored_runs import datum_dataset, read_json, read_study, to_json
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.errors import ResultError
from pneumo.physics.models import MODELS
from pneumo.physics.symbols import SYMBOLS
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.storage.files import attributes, open_grid, read, write, write_text
from pneumo.storage.layout import replay_dataset

NAMES = ["E06", "E13", "E14"]  # short settling runs; both loops
ATTRIBUTES = {"title": "A test", "summary": "of files", "config_sha256": "0" * 64}
KINDS = ["settling/E13.nc", "datum/E06.nc", "exact/replay/E06.nc", "exact/statistics.nc", "settling.nc"]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A folder with every kind of file, from runs of one second."""
    folder = tmp_path_factory.mktemp("results")
    experiments = {name: lasting(name, 1.0) for name in NAMES}
    settled = {name: settling_dataset(e, settle(e)) for name, e in experiments.items()}
    lanes, index = grid_lanes(STUDY.n, 1.4)
    for name, e in experiments.items():
        recording = record(e)
        cells = replay(recording, lanes, EXACT_SAMPLING, e.pressure_stride)
        datasets = {"settling": settled[name], "datum": datum_dataset(e, recording)}
        datasets["exact/replay"] = replay_dataset(e, STUDY.n, index, cells)
        for kind, dataset in datasets.items():
            write(dataset, folder / f"{kind}/{name}.nc", attributes(*ATTRIBUTES.values(), e))
    table = statistics(open_grid(folder / "exact"), STUDY.experiments_by_level)
    write(table, folder / "exact/statistics.nc", ATTRIBUTES)
    write(settling_table(settled, dict.fromkeys(NAMES, 1.0)), folder / "settling.nc", ATTRIBUTES)
    return folder


def small():
    P = np.arange(6.0).reshape(3, 2) * 1e5
    values = {"P": (("t", "chamber"), P), "status": ("t", np.int8([0, 1, 0]))}
    return xr.Dataset(values, {"t": [0.0, 0.001, 0.002], "chamber": ["A", "B"], "experiment": "a"})


def test_what_is_written_comes_back_and_long_traces_are_thinned(tmp_path):
    dataset = small()
    dataset["P"][1, 1] = np.nan
    write(dataset, tmp_path / "deep" / "a.nc", ATTRIBUTES)
    back = read(tmp_path / "deep" / "a.nc")
    xr.testing.assert_equal(back, dataset)
    assert {name: v.dtype for name, v in back.data_vars.items()} == {"P": float, "status": np.int8}
    assert back.attrs["title"] == "A test" and back.attrs["config_sha256"] == "0" * 64
    assert read(tmp_path / "deep" / "a.nc", "status").data_vars.keys() == {"status"}
    assert not dataset["P"].attrs and not dataset.attrs  # what was given is left alone
    assert [file.name for file in (tmp_path / "deep").iterdir()] == ["a.nc"]
    e = STUDY.experiments["E06"]
    run = settle(e)
    long = run._replace(states=np.repeat(run.states, 5, axis=0))
    dataset = settling_dataset(e, long)
    assert 10_000 < dataset.sizes["t"] <= 20_012
    assert np.array_equal(dataset["settling_time"], run.times)
    every = len(long.states) // 20_000 + 1
    assert f"every {every} steps" in dataset["t"].attrs["comment"]
    assert set(long.states[::every, 0]) <= set(dataset["x"].values)
    assert dataset["release_time"] == run.release_step * e.h


@pytest.mark.parametrize("kind", KINDS)
def test_a_rewrite_has_the_same_bytes(results, tmp_path, kind):
    dataset = read(results / kind)
    for name in ("one.nc", "other.nc", "one.nc"):  # at last over a file that is there
        write(dataset, tmp_path / name, dataset.attrs)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "other.nc").read_bytes()


def one_line(path, *variables):
    with pytest.raises(ResultError) as caught:
        read(path, *variables)
    text = str(caught.value)
    assert "\n" not in text and text.startswith(f"{path}: ")
    return text


@pytest.mark.parametrize("content", [b"", b"hello\nworld\n", b"\x89HDF\r\n\x1a\n" + bytes(100)])
def test_a_foreign_file_is_one_line(tmp_path, content):
    (tmp_path / "E01.nc").write_bytes(content)
    assert "not a readable NetCDF-4 file" in one_line(tmp_path / "E01.nc")


def test_other_files_that_cannot_be_used_are_one_line(results, tmp_path):
    assert "snakemake" in one_line(tmp_path / "E01.nc")  # a missing one says what makes it
    shutil.copy(results / "datum/E06.nc", tmp_path / "E07.nc")
    assert "holds experiment E06, not" in one_line(tmp_path / "E07.nc")
    assert "not a readable NetCDF-4 file" in one_line(tmp_path)
    text = one_line(results / "datum/E06.nc", "x", "mse")
    assert "no variable 'mse'" in text and "it has x, v, P, T, u, reference" in text
    path = tmp_path / "parameters.json"
    write_text(to_json(STUDY), path)
    assert read_study(path) == STUDY
    write_text(to_json(STUDY)[:1000], path)
    for reader, words in ((read_study, "does not hold a study"), (read_json, "not a whole JSON file")):
        with pytest.raises(ResultError, match=rf"parameters\.json: {words}; delete it"):
            reader(path)
        path.rename(tmp_path / "away")
        with pytest.raises(ResultError, match="no such file"):
            reader(path)
        (tmp_path / "away").rename(path)
    with pytest.raises(ResultError, match=r"holds no replay/\*\.nc; `snakemake -j2`"):
        open_grid(tmp_path)


@given(st.data())
@settings(max_examples=50, suppress_health_check=list(HealthCheck))
def test_a_truncated_file_is_one_line_wherever_it_ends(results, tmp_path, data):
    content = (results / "exact/replay/E06.nc").read_bytes()
    (tmp_path / "E06.nc").write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    assert "not a readable NetCDF-4 file" in one_line(tmp_path / "E06.nc")


@pytest.mark.parametrize("error", [OSError("no space left"), KeyboardInterrupt()])
@pytest.mark.parametrize("before", [None, b"the result of last week"])
def test_an_interrupted_write_leaves_what_was_there(tmp_path, monkeypatch, error, before):
    path = tmp_path / "a.nc"
    if before:
        path.write_bytes(before)
    whole = xr.Dataset.to_netcdf

    def half(dataset, target, **options):
        whole(dataset, target, **options)
        os.truncate(target, 1000)
        raise error

    monkeypatch.setattr(xr.Dataset, "to_netcdf", half)
    with pytest.raises(type(error)):
        write(small(), path, ATTRIBUTES)
    assert (path.read_bytes() if path.exists() else None) == before
    assert {file.name for file in tmp_path.iterdir()} <= {"a.nc"}
    path.with_name(f".{path.name}.0123.part").write_text("of a process that was killed")
    monkeypatch.undo()
    write(small(), path, ATTRIBUTES)  # the remains are no obstacle
    assert [file.name for file in tmp_path.iterdir()] == ["a.nc"]
    xr.testing.assert_equal(read(path), small())


def test_plain_xarray_finds_a_cell_and_a_grid_holds_every_experiment_with_its_labels(results, tmp_path):
    with xr.open_dataset(results / "exact/replay/E06.nc") as dataset:
        cell = dataset["mse"].sel(model="M8", n=1.35)
        assert cell.dims == ("chamber",) and (cell > 0).all()
        assert dataset["pressure"].dtype == np.float32 and "time" not in dataset.dims
        assert dataset["t"].dtype == float and dataset["t"].attrs["units"] == "s"
    grid = pneumo.open_grid(results / "exact")
    assert dict(grid.sizes) == {"experiment": 3, "model": len(MODELS), "n": 9, "chamber": 2}
    assert grid["experiment"].values.tolist() == NAMES
    labels = {
        "cylinder": ["D"] * 3,
        "loop": ["closed", "open", "closed"],
        "k_0": [STUDY.experiments[name].plant.k_0 for name in NAMES],
    }
    for label, values in labels.items():
        assert (grid[label].dims, grid[label].values.tolist()) == (("experiment",), values)
    assert set(grid.data_vars) == {"mean_error", "variance", "mse", "status", "failure_time"}
    for name in NAMES:
        with xr.open_dataset(results / f"exact/replay/{name}.nc") as dataset:
            assert grid["mse"].sel(experiment=name).equals(dataset["mse"])
    (tmp_path / "replay").mkdir()
    shutil.copy(results / "exact/replay/E13.nc", tmp_path / "replay")  # of one: the same shape
    xr.testing.assert_equal(open_grid(tmp_path), grid.sel(experiment=["E13"]))


@pytest.mark.parametrize("kind", KINDS)
def test_files_describe_themselves_and_neither_machine_nor_moment(results, kind):
    with netCDF4.Dataset(results / kind) as file:
        assert file.Conventions == "CF-1.11, ACDD-1.3"
        names = "title summary keywords license institution source references history libraries"
        for name in names.split():
            assert getattr(file, name).strip()
        assert file.product_version.startswith("pneumo ")
        assert re.fullmatch(r"[0-9a-f]{40}|not a checkout", file.commit)
        assert len(file.config_sha256) == 64
        for name, variable in file.variables.items():
            assert variable.long_name, name
            if variable.dtype is str or "flag_values" in variable.ncattrs():  # labels and codes have no unit
                continue
            assert variable.units, name
            if name in SYMBOLS:
                assert (variable.units, variable.long_name) == (SYMBOLS[name].unit, SYMBOLS[name].long_name)
        # They hold nothing of the machine or the moment.
        holders = [file, *file.variables.values()]
        texts = " ".join(f"{key}={holder.getncattr(key)}" for holder in holders for key in holder.ncattrs())
    for fact in (str(results), str(Path.home()), sys.prefix, os.uname().nodename):
        assert not re.search(rf"(?<!\w){re.escape(fact)}(?!\w)", texts)
    assert not re.search(r"\b20\d\d-\d\d-\d\d\b|\d\d:\d\d:\d\d|date_created", texts)


@pytest.fixture(scope="module")
def suite():
    runner = pytest.importorskip("compliance_checker.runner", reason="it has wheels for Linux on x86-64 only")
    suite = runner.CheckSuite()
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # of checkers not used here
        suite.load_all_available_checkers()
    return suite


# The checker subtracts neighbouring values of every coordinate variable to see that they rise, which text
# does not allow: model, chamber, experiment, level and quantity are labels, which CF permits (sections 5
# and 6.1) and `.sel(model="M8")` needs.
CHECK = "check_coordinate_variables_strict_monotonicity"
STRING_COORDINATES = {CHECK: "unsupported operand type(s) for -: 'str' and 'str'"}
# CF recommends that names differ in more than case; T and t are the paper's. It also recommends a history,
# which is a log of times: a rewrite would change the bytes.
WARNINGS = {
    "Variables are not case sensitive. Duplicate variables named: t",
    "§2.6.2 global attribute history should exist and be a non-empty string",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_compliance_checker_finds_no_error(results, suite, kind):
    with suite.load_dataset(str(results / kind)) as dataset:
        groups, failures = suite.run_all(dataset, ["cf:1.11"])["cf:1.11"]
    assert {name: str(error) for name, (error, _) in failures.items()} == STRING_COORDINATES
    messages = {}
    for group in groups:
        achieved, possible = group.value if isinstance(group.value, tuple) else (bool(group.value), 1)
        if achieved < possible:
            messages.setdefault(group.weight, set()).update(group.msgs)
    assert messages.keys() <= {2, 1}  # 3 is "error", 2 "warning", 1 "information"
    assert set().union(*messages.values()) <= WARNINGS
