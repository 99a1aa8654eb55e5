"""Plants that are known in part: what a row is told, what it finds, and the ratios of its errors."""

import numpy as np
import pytest
import xarray as xr
from paper_study import STUDY

from pneumo.evidence.at_work import partly_known as known
from pneumo.evidence.at_work import partly_known_statistics as statistics
from pneumo.evidence.at_work.plant_at_work import observer_run
from pneumo.evidence.at_work.sampled_plant import sampled_recording

pytestmark = pytest.mark.xdist_group("at work")  # the same kernels, compiled once
OPEN, CLOSED = STUDY.experiments["E07"], STUDY.experiments["E08"]
FULL = next(row for row in known.ROWS if row.name == "full")
ALL = np.ones(len(known.OFF))


def test_rows_are_those_of_the_decision():
    names = [row.name for row in known.ROWS]
    assert len(set(names)) == len(names) == 17
    assert {"M6", "M7, 0.5 k_0", "full, 2 k_0", "M8, k_0 estimated from 0.5 k_0"} <= set(names)


def test_a_row_is_told_a_plant_that_is_off_by_the_scale():
    told, plant = known.told_plant(OPEN.plant, 0.5, ALL), OPEN.plant
    assert known.told_plant(plant, 0.0, ALL) == plant
    assert told.valve.k_xu == pytest.approx(1.025 * plant.valve.k_xu)
    assert told.cylinder.V_d_A == pytest.approx(1.1 * plant.cylinder.V_d_A)
    assert told.cylinder.k_f == pytest.approx(1.1 * plant.cylinder.k_f)
    seed = known.seeds_of(3, 0)[0]
    assert (known.signs_of(seed) == known.signs_of(seed)).all()  # the same at every scale
    assert not all((known.signs_of(s) == known.signs_of(seed)).all() for s in known.seeds_of(3, 0))
    hidden = known.PartlyKnown(OPEN, CLOSED, hidden_coulomb=3.0)
    assert hidden.at(OPEN).plant.cylinder.coulomb == OPEN.plant.cylinder.coulomb + 3.0


def test_a_large_receiver_is_the_supply_and_a_small_one_sags(monkeypatch):
    steps, held = 400, sampled_recording(CLOSED, 3, 400)
    monkeypatch.setattr(known, "RECEIVER", 1e9)
    np.testing.assert_allclose(
        known.sagging_recording(CLOSED, 3, steps).states, held.states, rtol=1e-6, atol=1e-7
    )
    monkeypatch.setattr(known, "RECEIVER", 2.0)
    assert known.sagging_recording(CLOSED, 3, steps).states[:, [2, 4]].max() < held.states[:, [2, 4]].max()


def test_the_full_order_follows_the_plant_that_it_knows_and_not_another():
    run = observer_run(OPEN, np.random.SeedSequence(1))
    model = FULL.filter_model(np.nan, OPEN.plant.gas.gamma)
    right, wrong = (
        known.filter_errors(
            known.Told(run, known.told_plant(OPEN.plant, scale, ALL)), model, "one", 1.0, 1e3
        )[0]
        for scale in (0.0, 1.0)
    )
    assert right < 0.1 * wrong


def test_an_estimate_that_is_lost_counts_as_an_error_of_P_0():
    run = observer_run(OPEN, np.random.SeedSequence(1))
    lost = run._replace(x=np.full_like(run.x, np.nan))
    model = FULL.filter_model(np.nan, OPEN.plant.gas.gamma)
    square, _ = known.filter_errors(known.Told(lost, OPEN.plant), model, "none", 1.0, 1e3)
    assert square == OPEN.plant.conditions.P_0**2


def invented(errors: dict[str, float]) -> xr.Dataset:
    """Cells of nine plants and two seeds in which rows have stated errors, larger on new plants."""
    plants = [f"p{i}" for i in range(7)] + list(statistics.NEW)
    names = [row.name for row in known.ROWS]
    size = np.array([errors.get(name, 8.0) for name in names])
    by_plant = np.exp(np.random.default_rng(0).normal(0, 0.1, (len(plants), 1, len(names))))
    by_plant[7:, :, names.index("full")] *= 50
    values = size[:, None] * by_plant[..., None] * np.array([0.5, 2.0])
    coords = {"plant": plants, "scale": [0.0], "row": names, "seed": [0, 1]}
    cells = xr.DataArray(values, coords, ["plant", "scale", "row", "seed"])
    return xr.Dataset({"estimation_error": cells, "tracking_error": cells})


def test_ratios_are_against_the_best_reduced_model_of_equal_knowledge():
    cells = invented(
        {"full": 1.0, "M8": 4.0, "M6": 6.0, "M8, 0.5 k_0": 5.0, "M8, k_0 estimated from 0.5 k_0": 2.0}
    )
    statistics_of_cells = statistics.partly_known_statistics(cells).isel(scale=0)
    names = cells["row"].values
    ratio = statistics_of_cells["observer_over_reduced"].sel(part="without new")
    assert names[statistics_of_cells["observer_best_reduced"].sel(compared="full")] == "M8"
    assert ratio.sel(compared="full", bound="value") == pytest.approx(0.25, rel=0.2)
    assert ratio.sel(compared="M8, k_0 estimated from 0.5 k_0", bound="value") == pytest.approx(0.4, rel=0.2)
    state = statistics_of_cells["observer_over_fixed"].sel(state="M8, k_0 estimated from 0.5 k_0", part="all")
    assert state.sel(bound="low") < 0.4 < state.sel(bound="high")
    pays = statistics.pays(statistics_of_cells["observer_over_reduced"])
    assert pays.sel(compared="M8, k_0 estimated from 0.5 k_0") and not pays.sel(
        compared="full"
    )  # on new plants
    assert ratio.sel(compared="full", bound="high") < statistics.PAYS


def test_a_plant_has_every_cell_and_no_controllers_where_the_supply_sags(monkeypatch):
    rows = [row for row in known.ROWS if row.name in ("M8", "full, k_0 estimated from 0.5 k_0")]
    for name, value in {"ROWS": rows, "SCALES": (0.0,), "CONTROL_SCALES": (0.0,), "SEEDS": 1}.items():
        monkeypatch.setattr(known, name, value)
    for name, value in {"TUNING_SEEDS": 1, "PRESSURE_NOISES": (1e3,), "BANDWIDTHS": (50.0,)}.items():
        monkeypatch.setattr(known, name, value)
    monkeypatch.setattr(known, "FORCE_NOISES", (1.0,))
    done = known.partly_known_plant(known.PartlyKnown(OPEN, CLOSED), (1.3,), 3)
    assert set(done.data_vars) == set(known.VARIABLES)
    assert all(np.isfinite(done[name]).all() for name in known.VARIABLES if name != "n")
    assert done["k_0_found"].isel(row=1).min() > 0.5  # it started at 0.5, and the plant's is 1
    assert np.isnan(done["n"].sel(row="full, k_0 estimated from 0.5 k_0")).all()
    none = known._controllers(known.PartlyKnown(OPEN, CLOSED, sagging=True), np.array([]), np.array([]), 3)
    assert np.isnan(none["tracking_error"]).all()
