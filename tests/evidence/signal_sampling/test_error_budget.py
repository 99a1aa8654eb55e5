"""Error budget: parts recombine, the step's has the method's order, sampling's vanishes with its period."""

import itertools

import numpy as np
import pytest
import xarray as xr
from array_equations import array_rates
from figure_checks import saved_whole
from hypothesis import given
from hypothesis import strategies as st
from paper_study import STUDY, lasting

from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED
from pneumo.errors import RunError
from pneumo.evidence.signal_sampling import error_budget as b
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.models import MODELS, Lane
from pneumo.physics.valve import chamber_flows, laminar_factor
from pneumo.publish.figures.budget_figure import error_budget_figure
from pneumo.publish.figures.panels import symbol
from pneumo.simulation.full_order import record
from pneumo.simulation.given_inputs import joint_rates, pressures_on_inputs
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.reference import lane_rate
from pneumo.simulation.replay import replay, replay_by_reference
from pneumo.simulation.signals import study_sampling
from pneumo.simulation.vectorised import ROW
from pneumo.storage.files import EXPERIMENT_LABELS

pytestmark = pytest.mark.xdist_group("error budget")  # its fixtures take seconds

N = (1.0, 1.2)
LANES, INDEX = grid_lanes(N, 1.4)


@pytest.fixture(scope="module")
def cells():
    parts = [b.budget(lasting(name, 0.12), N) for name in ("E06", "E12")]
    return xr.concat(parts, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")


@pytest.fixture(scope="module")
def dataset(cells):
    levels = {"adiabatic": ["E06"], "typical": ["E06", "E12"], "isothermal": []}
    return b.with_budget_attributes(cells.merge(b.budget_by_level(cells, levels)))


def test_parts_add_up_to_the_study_own_error(cells):
    e = lasting("E06", 0.12)
    total, coarse, fine = (b.published_error(e, LANES), *(b.exact_error(e, LANES, m) for m in (1, 16)))
    transport, discretisation = total - coarse, coarse - fine
    products = fine * transport + fine * discretisation + transport * discretisation
    cell = cells.sel(experiment="E06")
    # Sums of squares of some 1e4 Pa, each to 1e-16; their difference is a cross term as large.
    scale = cell["total"].max().item()
    np.testing.assert_allclose(cell["cross_term"], 2 * products.mean(axis=-1)[INDEX], atol=1e-12 * scale)
    parts = ("model_error", "transport_error", "discretisation_error", "cross_term")
    np.testing.assert_allclose(sum(cell[part] for part in parts), cell["total"], rtol=1e-12)


@pytest.mark.parametrize(("name", "transport"), [("total", "published"), ("total_exact", "exact")])
def test_totals_are_those_of_the_study(cells, name, transport):
    e = lasting("E12", 0.12)
    study = replay(record(e), LANES, study_sampling(transport, e))
    np.testing.assert_allclose(cells[name].sel(experiment="E12"), study.mse[INDEX], rtol=1e-12)


@pytest.mark.parametrize("m", [2, 16])
def test_a_finer_step_keeps_the_experiment(m):
    e = lasting("E06", 0.2)
    fine, coarse = record(b.refined(e, m)), record(e)
    assert np.array_equal(fine.reference[::m], coarse.reference)
    np.testing.assert_allclose(fine.states[::m], coarse.states, rtol=1e-2, atol=1e-2)


def test_the_step_has_the_order_of_the_method_where_all_is_smooth():
    # One draw, subsonic or sonic throughout: halving the step divides its error by 2^5.
    e = lasting("E13", 0.05)
    errors = [b.exact_error(e, LANES, m) for m in (1, 2, 4)]
    halving = [b.mean_square(one - other).mean() for one, other in itertools.pairwise(errors)]
    order = b.observed_order(xr.DataArray(halving, dims="step"))
    assert 4.5 < order.item() < 6.5


def test_the_finest_step_is_next_to_the_adaptive_reference():
    # Of errors of some 1e4 Pa. A piston in closed loop: jumps, a limiter and a chamber at supply pressure.
    e = lasting("E14", 0.5)
    true = b.reference_error(e, LANES)
    coarse, fine = (b.mean_square(b.exact_error(e, LANES, m) - true).max() ** 0.5 for m in (1, 16))
    assert fine < 1 < 20 < coarse  # Pa


@pytest.mark.uncompiled
def test_the_adaptive_reference_refuses_a_piston_out_of_range():
    e = lasting("E13", 0.1)
    with pytest.raises(RunError, match=r"^E13: adaptive reference: x = .* m is out of its range$"):
        b.reference_error(e._replace(drive=e.drive._replace(x_reverse=1e-6)), LANES[:1])


def test_sampling_vanishes_with_its_period_and_interpolation_is_that_of_the_replays(cells):
    rms = cells["sampled"].mean(["experiment", "model", "n", "chamber"]) ** 0.5
    growth = rms / rms.shift(period=1)
    assert ((growth > 4) | growth.isnull()).all()
    assert rms.isel(period=0).max() < 1e3 < rms.isel(period=-1).min()
    e = lasting("E06", 0.3)
    recording = record(e)
    inputs = b.sampled_inputs(recording, 1, "linear")
    ours = pressures_on_inputs(inputs, LANES, e.plant, e.h, 1)
    np.testing.assert_allclose(ours, replay(recording, LANES, INTERPOLATED).pressure, rtol=1e-10)


@pytest.mark.uncompiled
def test_a_stride_takes_every_so_many_pressures():
    e = lasting("E06", 0.1)
    inputs = b.sampled_inputs(record(e), 1, "linear")
    every, fifth = (pressures_on_inputs(inputs, LANES, e.plant, e.h, stride) for stride in (1, 5))
    np.testing.assert_array_equal(fifth, every[..., ::5])


def test_joint_rates_are_those_of_the_run_and_of_each_lane():
    e, y, reference = STUDY.experiments["E06"], np.array([0.01, 0.2, 5e5, 300.0, 4e5, 280.0]), 0.012
    P = np.linspace(1.5e5, 6.5e5, 2 * len(LANES)).reshape(-1, 2)
    rates = joint_rates(np.append(y, P), reference, LANES, e.drive, e.plant)
    u = np.clip(e.drive.k_p * (reference - y[0]), -e.plant.valve.u_max, e.plant.valve.u_max)
    of_lanes = np.empty_like(P)
    for (i, row), side in itertools.product(enumerate(LANES), Side):
        inputs, chamber = side.sign * np.array([u, *y[:2]]), chamber_of(e.plant.cylinder, side)
        of_lanes[i, side] = lane_rate(*inputs, P[i, side], chamber, e.plant, Lane(*row))
    # The same sums in another order.
    np.testing.assert_allclose(rates[:6], array_rates(y, reference, e), rtol=1e-12)
    np.testing.assert_allclose(rates[6:].reshape(-1, 2), of_lanes, rtol=1e-12)


def test_hold_and_cubic_meet_the_samples():
    e = lasting("E06", 0.1)
    recording = record(e)
    signals = np.column_stack([recording.u.clip(-10, 10), recording.states[:, :2]])
    for interpolation in b.INTERPOLATIONS:
        inputs = b.sampled_inputs(recording, 4, interpolation)
        np.testing.assert_allclose(inputs[::4, 0], signals[:-1:4], atol=1e-12)
    held = b.sampled_inputs(recording, 4, "hold")
    assert (held.reshape(-1, 24, 3) == held.reshape(-1, 24, 3)[:, :1]).all()


@given(st.floats(-10, 10), st.floats(0.2e5, 9e5), st.floats(200, 500))
def test_regularised_flow_is_the_printed_one_away_from_equal_pressures(u, P, T):
    plant = STUDY.experiments["E06"].plant
    c, valve = plant.conditions, plant.valve._replace(laminar=b.LAMINAR)
    port = c.P_s if u >= 0 else c.P_atm
    printed = chamber_flows(u, P, T, plant.valve, plant.gas, c)
    smooth = chamber_flows(u, P, T, valve, plant.gas, c)
    if 1 - min(P, port) / max(P, port) >= b.LAMINAR:
        assert smooth == printed
    else:
        assert all(0 <= one <= other for one, other in zip(smooth, printed, strict=True))


def test_regularised_flow_is_linear_without_a_jump_and_given_inputs_refuse_it():
    plant = STUDY.experiments["E06"].plant
    valve = plant.valve._replace(laminar=b.LAMINAR)
    P_s = plant.conditions.P_s

    def inflow(difference):
        return chamber_flows(1.0, P_s * (1 - difference), 293.0, valve, plant.gas, plant.conditions)[0]

    assert inflow(0.0) == 0
    assert np.isclose(inflow(2e-6), 2 * inflow(1e-6), rtol=1e-5)
    assert np.isclose(inflow(b.LAMINAR * (1 - 1e-9)), inflow(b.LAMINAR * (1 + 1e-9)), rtol=1e-6)
    assert laminar_factor(2.0, 2.0, 0.0) == 1
    e = b.regularised(lasting("E06", 0.01))
    with pytest.raises(ValueError, match=r"laminar = 0\.001"):
        pressures_on_inputs(np.zeros((1, 6, 3)), LANES, e.plant, e.h, 1)
    plant, rest = STUDY.experiments["E06"].plant, np.zeros((1, 6, 3))
    with pytest.raises(ValueError, match="leak = 1e-09"):
        pressures_on_inputs(rest, LANES, plant._replace(valve=plant.valve._replace(leak=1e-9)), e.h, 1)
    with pytest.raises(ValueError, match=f"{ROW + 1} lanes"):
        pressures_on_inputs(rest, np.resize(LANES, (ROW + 1, 9)), plant, e.h, 1)
    assert len(pressures_on_inputs(rest, np.resize(LANES, (ROW, 9)), plant, e.h, 1)) == ROW


def test_the_fast_replay_knows_the_regularised_law():
    e = b.regularised(lasting("E06", 0.2), laminar=0.1)
    recording = record(e)
    fast, slow = (kernel(recording, LANES, EXACT_SAMPLING) for kernel in (replay, replay_by_reference))
    np.testing.assert_allclose(fast.pressure, slow.pressure, rtol=1e-12)
    printed = e.plant._replace(valve=e.plant.valve._replace(laminar=0.0))
    other = replay(recording._replace(plant=printed), LANES, EXACT_SAMPLING)
    assert abs(other.pressure - fast.pressure).max() > 10  # Pa


def test_models_are_told_apart_where_their_difference_outweighs_the_numbers():
    models = {"model": ["M1", "M2", "M3"]}
    model_error = xr.DataArray([1.0, 2.0, 2.0], models)
    kept = b.told_apart(model_error + 5.0, model_error)  # the same for all: differences stand
    assert kept.values.tolist() == [[False, True, True], [True, False, False], [True, False, False]]
    swapped = b.told_apart(xr.DataArray([2.0, 1.0, 2.75], models), model_error)
    assert not swapped.sel(model="M1", other="M2") and swapped.sel(model="M1", other="M3")
    halved = b.told_apart(xr.DataArray([1.0, 1.5, 1.4], models), model_error)  # the sign stays only
    assert not halved.any()


def test_models_that_coincide_are_never_told_apart_levels_average_and_all_has_units(dataset):
    # M1 is M2, M5 and M6 at n = 1.
    at_one = dataset["constant_n"] == 1
    for model in ("M2", "M5", "M6"):
        apart = dataset["level_told_apart"].sel(model="M1", other=model).where(at_one.sel(model=model), 0)
        assert not apart.any()
    assert not dataset["told_apart"].where(dataset["model"] == dataset["other"], 0).any()
    mse = dataset["sampled"].mean("chamber").sel(n=1.0, model="M3").mean("experiment")
    np.testing.assert_allclose(dataset["level_sampled"].sel(level="typical", model="M3"), mse)
    assert dataset["level_total"].sel(level="isothermal").isnull().all()  # no experiment of this conductance
    for name in dataset.data_vars:
        assert "long_name" in dataset[name].attrs or name in ("best_n",), name


@pytest.mark.slow
def test_figure_stacks_the_parts_and_is_unclipped(dataset, tmp_path):
    fig = error_budget_figure(dataset)
    saved_whole(fig, tmp_path / "error_budget")
    heights = [[bar.get_height() for bar in bars] for bars in fig.axes[0].containers]
    parts = ("model_error", "transport_error", "discretisation_error")
    level = dataset.sel(level="adiabatic")
    expected = [level[f"level_{part}"] for part in parts]
    np.testing.assert_allclose(heights, expected, rtol=1e-9, atol=1e-5)  # a bar is its top less its bottom
    stack = fig.axes[0]
    tops = [[bar.get_y() + bar.get_height() for bar in bars] for bars in stack.containers]
    np.testing.assert_allclose(tops, np.cumsum(expected, axis=0), rtol=1e-9, atol=1e-5)
    total = level["level_total"].values
    highest = np.fmax(tops[-1], total)
    constant = np.array([model.temperature == "constant" for model in MODELS.values()])
    assert stack.get_ylim()[1] == pytest.approx(1.1 * highest[~constant].max())
    marked = [text.get_text().strip("$").removesuffix("}") for text in stack.texts]
    beyond = total[highest > stack.get_ylim()[1]]
    assert len(marked) == len(beyond) > 0
    for text, value in zip(marked, beyond, strict=True):
        digits, power = text.split(r"\times10^{")
        assert 1 <= float(digits) < 10
        assert float(f"{digits}e{power}") == pytest.approx(value, rel=0.05)  # two digits are shown
    assert [label.get_text() for label in fig.axes[3].get_xticklabels()] == [symbol(name) for name in MODELS]
