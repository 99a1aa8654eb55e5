"""Runs of another simulator: read, replayed, judged; and what is refused."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from paper_study import STUDY, lasting
from typer.testing import CliRunner

from paper.study.pages.verdict_page import verdict_page
from paper.study.paper_2006 import other_simulators as other
from pneumo.cli.commands import app
from pneumo.errors import ResultError
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.storage.grid_layout import replayed_grid

NAMES = ("E13", "E16")
BRIEF = STUDY._replace(experiments={name: lasting(name, 0.3) for name in NAMES})


def table_of(e, recording):
    x, v, P_A, T_A, P_B, T_B = recording.states.T
    t = np.arange(e.steps + 1) * e.h
    signals = {"t": t, "u": recording.u, "x": x, "v": v, "P_A": P_A, "P_B": P_B, "T_A": T_A, "T_B": T_B}
    return pd.DataFrame(signals)


@pytest.fixture(scope="module")
def recordings():
    return {name: record(e) for name, e in BRIEF.experiments.items()}


@pytest.fixture
def folder(recordings, tmp_path):
    for name, recording in recordings.items():
        table = table_of(BRIEF.experiments[name], recording)
        if name == "E13":
            table.to_csv(tmp_path / "E13.csv", index=False)
        else:
            xr.Dataset.from_dataframe(table.set_index("t")).to_netcdf(tmp_path / f"{name}.nc")
    return tmp_path


def own_cells(name, recordings):
    e = BRIEF.experiments[name]
    return replayed_grid(e, BRIEF.n, recordings[name], study_sampling(PUBLISHED, e), e.steps)


def test_own_runs_as_another_simulators_give_the_studys_cells_bit_for_bit(folder, recordings):
    said = []
    results = other.other_results(folder, BRIEF, said.append)
    assert said == ["E13: E13.csv, replayed by pneumo", "E16: E16.nc, replayed by pneumo"]
    for name in NAMES:
        cells = own_cells(name, recordings)
        np.testing.assert_array_equal(results.cells["mse"].sel(experiment=name), cells["mse"].mean("chamber"))
        run = results.run("datum", name)
        np.testing.assert_array_equal(run["T"].values, recordings[name].states[:, [3, 5]])


def test_a_simulators_own_replays_are_taken_as_they_are(folder, recordings):
    cells = own_cells("E16", recordings)
    table = cells[["mean_error", "mse"]].to_dataframe().reset_index()
    table.loc[table["model"].isin([m for m, model in MODELS.items() if not model.has_n]), "n"] = 9.0
    table = table.drop_duplicates(["model", "n", "chamber"])[list(other.ERRORS)]
    table.to_csv(folder / "E16_replays.csv", index=False)
    part = BRIEF._replace(experiments={"E16": BRIEF.experiments["E16"]})
    results = other.other_results(folder, part)
    np.testing.assert_allclose(results.cells["mse"].values[0], cells["mse"].mean("chamber"), rtol=1e-15)
    broken = table.drop(table.index[(table["model"] == "M8") & (table["chamber"] == "B")][:1])
    broken.to_csv(folder / "E16_replays.csv", index=False)
    with pytest.raises(ResultError, match="M8 has no cell of n, chamber"):
        other.other_results(folder, part)


def test_items_whose_runs_are_missing_say_so_and_an_average_of_some_is_none(folder):
    judged = other.verdict_on(folder, BRIEF, "nobody")
    items = {item["id"]: item for item in judged["items"]}
    assert judged["study"] == "runs of nobody" and len(items) == 611
    assert items["T8.E13.M8"]["reproduced"] in BRIEF.n
    assert items["T7.M8.mse"]["reproduced"] is not None  # of a study of these experiments alone
    for name in ("T8.E01.M8", "T5.E13.T_A", "F7.P_B.3.value"):
        assert items[name]["status"] == "not judged", name
    both = other.other_results(folder, BRIEF)
    (folder / "E16.nc").unlink()
    results = other.other_results(folder, BRIEF)
    levels = BRIEF.experiments_by_level
    for level in both.statistics["level"].values:
        whole = set(levels.get(level, NAMES)) <= {"E13"}
        assert results.statistics["mse"].sel(level=level).notnull().any() == (
            whole and bool(levels.get(level, True))
        )
    assert "runs of nobody" in verdict_page(judged, other.PAPER_FOLDER)


def test_settling_times_are_read_where_they_are_given(folder):
    (folder / "settling.csv").write_text("experiment,P_A,P_B,T_A,T_B\nE16,0.1,0.2,0.3,0.4\n")
    times = other.read_settling(folder, BRIEF)
    assert times.sel(experiment="E16").values.tolist() == [0.1, 0.2, 0.3, 0.4]
    assert times.sel(experiment="E13").isnull().all()


@pytest.mark.parametrize(
    "change, message",
    [
        (
            lambda t: t.drop(columns="P_B"),
            "has no column P_B; needed are t, u, x, v, P_A, P_B, there are t, u",
        ),
        (lambda t: t[:-1], "has 300 samples, E13 has 301: 0 to 0.3 s by 0.001 s"),
        (lambda t: t.assign(t=1e3 * t["t"]), "t = 300 s at sample 300: must be 0.3 s"),
        (lambda t: t.assign(v=t["v"].where(t["t"] < 0.1)), "v is not finite at sample 100"),
        (lambda t: t.assign(u="fast"), "could not convert"),
    ],
)
def test_one_line_for_a_run_that_cannot_be_used(folder, recordings, change, message):
    e = BRIEF.experiments["E13"]
    change(table_of(e, recordings["E13"])).to_csv(folder / "E13.csv", index=False)
    with pytest.raises(ResultError, match=message) as caught:
        other.read_run(folder / "E13.csv", e)
    assert "\n" not in str(caught.value) and "E13.csv" in str(caught.value)


def test_a_run_without_temperatures_has_none(folder, recordings):
    e = BRIEF.experiments["E13"]
    table_of(e, recordings["E13"]).drop(columns=["T_A", "T_B"]).to_csv(folder / "E13.csv", index=False)
    recording, run = other.read_run(folder / "E13.csv", e)
    assert run["T"].isnull().all() and np.isfinite(recording.states).all()


def test_the_command_refuses_an_empty_folder_and_to_record(tmp_path):
    for arguments, message in (
        (["--runs", str(tmp_path)], "holds no run such as E01.csv"),
        (["--runs", str(tmp_path), "--record"], "without --record"),
    ):
        with pytest.raises(ResultError, match=message):
            CliRunner().invoke(app, ["paper", "verdict", *arguments], catch_exceptions=False)
    assert list(tmp_path.iterdir()) == []
