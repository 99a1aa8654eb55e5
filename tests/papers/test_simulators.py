"""Runs of other simulators, such as the independent implementation and the FMU: read, replayed, judged."""

import subprocess
import sys
from itertools import islice
from pathlib import Path

import independent_simulator as independent
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from exported_c import C_COMPILER
from paper_study import STUDY, lasting

from paper.study.pages.verdict_page import verdict_page
from paper.study.paper_2006 import other_simulators as other
from pneumo.errors import ResultError
from pneumo.simulation.excitation import normal_deviates
from pneumo.simulation.full_order import record
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.storage.layout import replayed_grid

NAMES = ("x", "v", "P_A", "T_A", "P_B", "T_B")
SCALE = np.array([0.1, 1.0, 1e5, 300.0, 1e5, 300.0])
BRIEF = STUDY._replace(experiments={name: lasting(name, 0.3) for name in ("E13", "E16")})


@pytest.fixture(scope="module")
def recordings():
    return {name: record(e) for name, e in BRIEF.experiments.items()}


def table_of(recording) -> pd.DataFrame:
    signals = dict(zip(NAMES, recording.states.T, strict=True)) | {"u": recording.u}
    return pd.DataFrame({"t": np.arange(len(recording.u)) * recording.h} | signals)


@pytest.fixture
def folder(recordings, tmp_path):
    table_of(recordings["E13"]).to_csv(tmp_path / "E13.csv", index=False)
    xr.Dataset.from_dataframe(table_of(recordings["E16"]).set_index("t")).to_netcdf(tmp_path / "E16.nc")
    return tmp_path


def mse_of(name, recording) -> xr.DataArray:
    """Mean square errors of both chambers by pneumo's replays."""
    e = BRIEF.experiments[name]
    return replayed_grid(e, BRIEF.n, recording, study_sampling(PUBLISHED, e), e.steps)["mse"].mean("chamber")


def test_own_runs_as_another_simulators_give_the_studys_cells_bit_for_bit(folder, recordings):
    said = []
    results = other.other_results(folder, BRIEF, said.append)
    assert said == ["E13: E13.csv, replayed", "E16: E16.nc, replayed"]
    for name, recording in recordings.items():
        np.testing.assert_array_equal(results.cells["mse"].sel(experiment=name), mse_of(name, recording))
        np.testing.assert_array_equal(results.run("datum", name)["T"].values, recording.states[:, [3, 5]])


def test_items_whose_runs_are_missing_say_so_and_an_average_of_some_is_none(folder):
    judged = other.verdict_on(folder, BRIEF, "nobody")
    items = {item["id"]: item for item in judged["items"]}
    assert judged["study"] == "runs of nobody" and len(items) == 591
    assert items["T8.E13.M8"]["reproduced"] in BRIEF.n
    assert items["T7.M8.mse"]["reproduced"] is not None  # of a study of these experiments alone
    for name in ("T8.E01.M8", "T5.E13.T_A", "F7.P_B.3.value"):
        assert items[name]["status"] == "not judged", name
    assert "runs of nobody" in verdict_page(judged, other.PAPER_FOLDER)
    (folder / "E16.nc").unlink()
    averages = other.other_results(folder, BRIEF).statistics["mse"]
    assert averages.sel(level="overall").isnull().all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t: t.drop(columns="P_B"),
            "has no column P_B; needed are t, u, x, v, P_A, P_B, there are t, x",
        ),
        (lambda t: t[:-1], "has 300 samples, E13 has 301: 0 to 0.3 s by 0.001 s"),
        (lambda t: t.assign(t=1e3 * t["t"]), "t = 300 s at sample 300: must be 0.3 s"),
        (lambda t: t.assign(v=t["v"].where(t["t"] < 0.1)), "v is not finite at sample 100"),
        (lambda t: t.assign(u="fast"), "could not convert"),
    ],
)
def test_one_line_for_a_run_that_cannot_be_used(folder, recordings, change, message):
    change(table_of(recordings["E13"])).to_csv(folder / "E13.csv", index=False)
    with pytest.raises(ResultError, match=message) as caught:
        other.read_run(folder / "E13.csv", BRIEF.experiments["E13"])
    assert "\n" not in str(caught.value) and "E13.csv" in str(caught.value)


def largest(run, recording):
    """Largest difference of each state over its scale."""
    states = np.column_stack([np.asarray(run[name]) for name in NAMES])
    return np.abs((states - recording.states) / SCALE).max(axis=0)


def test_the_independent_simulator_shares_no_code_with_the_package_and_has_simulinks_numbers():
    code = "import sys, independent_simulator; sys.exit('pneumo' in sys.modules)"
    path = Path(independent.__file__).parent
    assert subprocess.run([sys.executable, "-c", code], cwd=path).returncode == 0
    for seed in (666, 777, 1_234_567):
        numbers = list(islice(independent.random_numbers(seed), 50))
        assert numbers == pytest.approx(list(islice(normal_deviates(seed), 50)), rel=1e-14)


# In open loop the command is constant between samples and steps of 1 ms are accurate. In closed loop the
# chambers often are at equal pressure with a port, where eq (1) has an infinite slope: fixed steps oscillate.
@pytest.mark.parametrize(
    ("name", "seconds", "most"),
    [("E13", 1.0, 1e-6), ("E11", 2.0, 1e-6), ("E16", 1.0, 0.02), ("E10", 1.0, 0.02)],
)
def test_independent_runs_are_those_of_the_study(name, seconds, most):
    run, recording = independent.simulate(name, seconds), record(lasting(name, seconds))
    assert largest(run, recording).max() < most
    np.testing.assert_allclose(run["u"], recording.u, atol=5e-3)


@pytest.mark.slow
@C_COMPILER
def test_runs_of_the_fmu_are_those_of_the_study_where_the_command_is(tmp_path):
    pytest.importorskip("fmpy", reason="fmpy is not installed")
    from benchmarks.fmu_runs import fmu_run

    # Steps of second order: far below the 0.5 kPa to which exports are held.
    assert largest(fmu_run(lasting("E13", 1.0), tmp_path), record(lasting("E13", 1.0))).max() < 5e-4
    recording = record(lasting("E16", 1.0))
    held, often = (largest(fmu_run(lasting("E16", 1.0), tmp_path, every), recording) for every in (1, 10))
    # The controller is outside: the command is late by half the time between communication points.
    assert 5 < held[0] / often[0] < 20 and often.max() < 0.02


def test_replays_on_independent_runs_are_those_on_the_studys(recordings, tmp_path):
    for name, e in BRIEF.experiments.items():
        independent.write_run(independent.simulate(name, e.duration), tmp_path / f"{name}.nc")
    results = other.other_results(tmp_path, BRIEF)
    for name, tolerance in (("E13", 1e-5), ("E16", 2e-2)):
        mse = results.cells["mse"].sel(experiment=name)
        np.testing.assert_allclose(mse, mse_of(name, recordings[name]), rtol=tolerance)
