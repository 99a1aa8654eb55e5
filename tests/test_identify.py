"""Identification: the noise model, a synthetic cylinder found again, and what counts as fitted."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import OptimizeResult

from pneumo.assess import amplitudes, mechanics
from pneumo.assess.claims import read_claims
from pneumo.assess.identify import check, identify
from pneumo.assess.misfit import THRESHOLD, interval, noise, rms, scale
from pneumo.assess.published import table5, table7, table9
from pneumo.assess.statistics import statistics
from pneumo.physics.parameters import load, study
from pneumo.simulate.datum import C, record
from pneumo.simulate.replay import replay
from pneumo.simulate.settling import NOT_SETTLED, QUANTITIES, settle
from pneumo.store import ResultError

STUDY = study(load(Path(__file__).parents[1] / "config" / "paper.yaml"))
TRUE = np.log([1.8, 120.0, 0.3])
NAMES = ("E13", "E14")


def synthetic() -> mechanics.Cells:
    """Cylinder D with other parameters, its own settling times rounded to the millisecond."""
    experiments = {
        name: mechanics.changed(STUDY.experiments[name], TRUE)._replace(name=name) for name in NAMES
    }
    table = table5().copy()
    for name, experiment in experiments.items():
        table.loc[{"experiment": name}] = settle(experiment, longest=20.0).times
    return mechanics.cells(STUDY.experiments, NAMES, table)


# The noise model


def test_noise_adds_rounding_and_discrepancy():
    sigma = noise(np.array([0.1, 100.0]), np.array([5e-4, 5e-4]), 0.01)
    assert sigma[0] == pytest.approx(np.sqrt((5e-4 / np.sqrt(3) / 0.1) ** 2 + 0.01**2), rel=1e-15)
    assert sigma[1] == pytest.approx(0.01, rel=1e-6)


def test_the_rounding_part_is_the_spread_of_rounded_numbers():
    x = np.linspace(0.1, 0.2, 100_001)
    spread = np.std(np.round(x, 3) - x)
    assert float(noise(np.array(1.0), np.array(5e-4), 0.0)) == pytest.approx(spread, rel=1e-3)


def test_deviances_shrink_only_where_the_fit_is_worse_than_expected():
    assert scale(2.0, 8, 3) == 1.0
    assert scale(20.0, 8, 3) == 4.0


@given(st.floats(-5, 5), st.floats(0.01, 3))
def test_interval_of_a_parabola(centre, sigma):
    x = centre + sigma * np.linspace(-4, 4, 401)
    low, high = interval(x, ((x - centre) / sigma) ** 2)
    assert low == pytest.approx(centre - 1.95996 * sigma, abs=1e-3 * sigma)
    assert high == pytest.approx(centre + 1.95996 * sigma, abs=1e-3 * sigma)
    assert abs(THRESHOLD - 1.95996**2) < 1e-4


def test_interval_without_an_end():
    x, nan = np.arange(5.0), np.nan
    assert interval(x, np.array([9.0, 0.0, 1.0, 2.0, 2.0])) == (pytest.approx(1 - THRESHOLD / 9), np.inf)
    assert interval(x, np.array([nan, 1.0, 0.0, 9.0, nan]))[0] == -np.inf


def test_interval_takes_the_outermost_crossing():
    low, high = interval(np.arange(6.0), np.array([8.0, 0.0, 8.0, 0.0, 8.0, 9.0]), 4.0)
    assert (low, high) == (0.5, 3.5)


# Mass, friction, stop


def test_a_synthetic_cylinder_is_found_again_without_a_hint(monkeypatch):
    # Narrower than the real search, which takes a minute or two, and with a small population.
    monkeypatch.setattr(mechanics, "BOUNDS", np.array([(0.5, 8.0), (20.0, 400.0), (0.2, 0.8)]))
    found = mechanics.search(synthetic(), seed=1, mapper=map, population=4, generations=4)
    np.testing.assert_allclose(np.exp(found.x[:2]), np.exp(TRUE[:2]), rtol=0.01)
    assert abs(found.x[2] - TRUE[2]) < 0.1  # two experiments hardly determine the stop
    assert found.fun < 1.0  # eight cells; what is left is rounding


def test_profile_is_lowest_at_the_truth_and_rises(monkeypatch):
    monkeypatch.setattr(mechanics, "STEPS", np.array([0.05, 0.4]))
    monkeypatch.setattr(mechanics, "OFFSETS", np.array([-0.4, -0.05, 0.0, 0.05, 0.4]))
    monkeypatch.setattr(
        mechanics, "nearby", lambda f, start, size=0.0: OptimizeResult(x=start, fun=f(start), nfev=1)
    )
    best = OptimizeResult(x=TRUE, fun=0.0)
    curves, lowest, evaluations = mechanics.profile(synthetic(), best, 1.0, map)
    assert lowest is best
    assert curves.shape == (3, 5)
    assert (curves[:, 2] == 0).all()
    assert (curves[:2, [1, 3]] > THRESHOLD).all()  # others held: far above what a profile would be
    assert evaluations >= 6


def test_what_does_not_settle_is_a_large_finite_residual():
    data = synthetic()
    silly = mechanics.log_ratios(data, np.log([0.1, 1000.0, 0.9]))
    assert np.isfinite(silly).all()
    assert np.isfinite(mechanics.deviance(np.log([20.0, 1.0, 0.1]), data))
    stuck = data._replace(
        experiments=tuple(e._replace(push=e.push._replace(tolerance=1e-300)) for e in data.experiments)
    )
    assert (mechanics.log_ratios(stuck, TRUE)[0] == mechanics.NOT_SETTLED).all()  # E13 never rests


def test_settling_runs_can_be_capped():
    assert settle(STUDY.experiments["E10"], longest=10.0).status == NOT_SETTLED


def test_correlation_of_a_known_normal():
    x, ratio = np.linspace(-4, 4, 41), np.linspace(-5, 5, 51)
    ln_M, ln_ratio = np.meshgrid(x, ratio, indexing="ij")
    ln_k_f, r = ln_M + ln_ratio, 0.6
    deviance = (ln_M**2 - 2 * r * ln_M * ln_k_f + ln_k_f**2) / (1 - r**2)
    assert mechanics.correlation(x, ratio, deviance) == pytest.approx(r, abs=0.01)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["E17"], "E17: not in this study; there are E01, "),
        (["E04"], "E04: has no four legible settling times in Table 5"),
    ],
)
def test_experiments_that_cannot_be_used(names, message):
    with pytest.raises(ResultError, match=rf"^{message}"):
        mechanics.cells(STUDY.experiments, names, table5())


def test_an_experiment_without_a_row_in_table_5():
    with pytest.raises(ResultError, match=r"^E13: has no four legible"):
        mechanics.cells(STUDY.experiments, ["E13"], table5().drop_sel(experiment="E13"))


def test_a_part_of_the_study_has_no_tables_7_and_9():
    part = STUDY._replace(experiments={name: STUDY.experiments[name] for name in ("E06", "E12")})
    with pytest.raises(ResultError, match=r"^E01: not in this study; Tables 7 and 9 average over all 16"):
        check(part)
    with pytest.raises(ResultError, match=r"^E09: not in this study"):
        identify(part, ["D"], 0, 1, print)


# Fitted and scored


def test_fitted_and_scored_are_disjoint_and_halves():
    scored = set(QUANTITIES) - set(mechanics.FITTED)
    assert len(mechanics.FITTED) == len(scored) == 2
    assert mechanics.IS_FITTED.sum() == 2


def test_scored_cells_play_no_role_in_the_fit():
    data = synthetic()
    printed = np.where(mechanics.IS_FITTED, data.printed, 1e3)
    assert mechanics.deviance(TRUE, data._replace(printed=printed)) == mechanics.deviance(TRUE, data)


def test_claims_mark_what_is_fitted():
    items = read_claims().items.values()
    for number in (5, 7):
        marked = {(c.row, c.column) for c in items if c.table == number and c.used_in_identification}
        fitted = {
            5: {(e, q) for names in mechanics.SETTLING.values() for e in names for q in mechanics.FITTED},
            7: {(model, "mse") for model in table7()["model"].values},
        }
        assert marked == fitted[number]


# Amplitudes and transports


def test_tables_of_the_grid_are_those_of_the_statistics():
    rng = np.random.default_rng(3)
    names, models = list(STUDY.experiments), [f"M{i}" for i in range(1, 11)]
    mse = rng.uniform(1, 2, (16, 10, 9))
    k_0 = np.array([e.plant.k_0 for e in STUDY.experiments.values()])
    dims = ("experiment", "model", "n", "chamber")
    both = np.repeat(mse[..., np.newaxis], 2, axis=-1)
    grid = xr.Dataset(
        {"mse": (dims, both), "mean_error": (dims, 0 * both), "failure_time": (dims, np.nan * both)},
        coords={"experiment": names, "model": models, "n": list(STUDY.n), "k_0": ("experiment", k_0)},
    )
    expected = statistics(grid, STUDY.levels)["mse"]
    levels = list(STUDY.levels)
    np.testing.assert_allclose(amplitudes.table_7(mse), expected.sel(level="overall"), rtol=1e-14)
    np.testing.assert_allclose(
        amplitudes.table_9(mse, k_0, STUDY.levels), expected.sel(level=levels), rtol=1e-14
    )
    assert list(table9()["level"].values) == levels


def short(name, steps=300):
    return STUDY.experiments[name]._replace(steps=steps)


def pressures(recording, e, lag):
    lanes = amplitudes.grid_lanes((1.2,), 1.4)[0]
    return replay(recording, lanes, e.drive, e.plant, e.h, transport="published", lag=lag).pressure


def test_hold_reads_the_sample_of_its_steps_start():
    # Signals that stand still between samples are what a hold makes of any signal: u = u_k from k on.
    e = short("E06")
    recording = record(e)
    lag = amplitudes.delays(e.h)["hold"]
    k = np.arange(len(recording.u))[:, np.newaxis] + C - lag[:, 0] / e.h
    assert np.abs(k - np.round(k)).max() < 1e-12
    assert (np.round(k) == np.arange(len(recording.u))[:, np.newaxis]).all()
    assert not np.allclose(pressures(recording, e, lag), pressures(recording, e, 0.0), rtol=1e-6)


def test_u_a_sample_late_is_a_shifted_u():
    e = short("E06")
    recording = record(e)
    shifted = recording._replace(u=np.concatenate([recording.u[:1], recording.u[:-1]]))
    lag = amplitudes.delays(e.h)["linear, u a sample late"]
    np.testing.assert_allclose(pressures(recording, e, lag), pressures(shifted, e, 0.0), rtol=1e-9)


def test_an_array_of_equal_delays_is_the_lag():
    e = short("E06")
    recording = record(e)
    lag = amplitudes.delays(e.h)["linear, 0.13 ms late"]
    np.testing.assert_array_equal(pressures(recording, e, lag), pressures(recording, e, 0.13e-3))


def test_both_kernels_take_the_same_delays():
    e = short("E14")
    lanes, index = amplitudes.grid_lanes(STUDY.n, 1.4)
    names = tuple(amplitudes.delays(e.h))
    fast = amplitudes.cell_mse(e, STUDY.n, names)
    for row, lag in zip(fast, amplitudes.delays(e.h).values(), strict=True):
        options = {"transport": "exact"} if lag is None else {"transport": "published", "lag": lag}
        slow = replay(record(e), lanes, e.drive, e.plant, e.h, **options)
        np.testing.assert_allclose(row, slow.mse.mean(axis=1)[index], rtol=1e-9)


def test_amplitudes_stay_within_their_bounds():
    low, high = amplitudes.AMPLITUDE_BOUNDS
    assert amplitudes.COARSE[[0, -1]] == pytest.approx([low, high])
    assert amplitudes.COARSE[1] * amplitudes.FINE[0] > low
    assert amplitudes.COARSE[-2] * amplitudes.FINE[-1] < high


# What came out


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    file = Path(__file__).parents[1] / "results" / "identification.nc"
    if not file.exists():
        pytest.skip("results/identification.nc is absent: `snakemake -j2 evidence` makes it")
    return xr.open_dataset(file).load()


def test_the_configured_constants_lie_in_their_intervals(found):
    configured = {"D": (1.5, 100.0, 0.3), "E": (5.0, 100.0, 38.0 / 137.5)}
    for cylinder, values in configured.items():
        own = found.sel(cylinder=cylinder)
        assert bool((own["low"] <= values).all() and (values <= own["high"]).all()), cylinder
        assert bool((own["low"] < own["estimate"]).all() and (own["estimate"] < own["high"]).all())


def test_the_scored_half_agrees(found):
    assert float(found["fitted_rms"].max()) <= 0.03
    assert float(found["scored_rms"].max()) <= 0.05
    again = (
        found["settling_log_ratio"].where(found["fitted"] == 0).sel(experiment=list(mechanics.SETTLING["D"]))
    )
    assert rms(again.values[np.isfinite(again.values)]) == pytest.approx(
        float(found["scored_rms"][0]), rel=1e-12
    )


def test_every_transport_but_exact_and_the_misfit_says_which(found):
    misfit = found["transport_rms"].sel(table=7)
    assert misfit.idxmin("transport").item() in ("linear, 0.13 ms late", "linear, last stage held")
    assert float(misfit.sel(transport="linear")) <= 0.075
