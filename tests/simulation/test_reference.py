"""Replays: the exact sampling against a co-simulated run, samples against NumPy's, failed cells."""

import numpy as np
import pytest
from array_equations import array_command, array_flows, array_rates, integrated
from brief import in_brief
from paper_study import STUDY, lasting
from readable_equations import C, replay_lane

from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED, Sampling
from pneumo.physics.cylinder import Side
from pneumo.physics.models import MODELS, Lane, full_order_lane, lane_array, model_dP_dt, temperature
from pneumo.simulation.full_order import equilibrium, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import LEFT_RANGE, NO_RUN, OK, STATUS, replay, replay_one_by_one
from pneumo.storage.layout import replay_dataset

LANES, INDEX = grid_lanes(STUDY.n, 1.4)
EPS = np.finfo(float).eps
BOTH = [INTERPOLATED, EXACT_SAMPLING]
both_samplings = pytest.mark.parametrize("sampling", BOTH)


def replayed(recording, sampling=EXACT_SAMPLING, lanes=LANES, stride=1):
    return replay_one_by_one(recording, lanes, sampling, stride)


def lane_rates(u, x, v, P, e):
    """Rates of all lanes at both chambers; P has shape (lane, 2)."""
    c, gas, cylinder = e.plant.conditions, e.plant.gas, e.plant.cylinder
    sign = np.array([1.0, -1.0])
    u, x, v = sign * u, sign * x, sign * v
    coefficients = Lane(*LANES.T[..., np.newaxis])
    T = temperature(P, c.P_0, c.T_0, coefficients.a)
    V = np.array([cylinder.V_d_A, cylinder.V_d_B]) + cylinder.A_A * (cylinder.stroke / 2 + x)
    length = cylinder.stroke / 2 + cylinder.bore / 2
    fixed = e.plant.k_0, c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, gas.gamma
    m_in, m_out = array_flows(u, P, T, e.plant)
    return model_dP_dt(P, T, V, cylinder.A_A * v, m_in, m_out, (x + length) / length, *fixed, coefficients)


def cosimulated(e, reference):
    """Full-order states and all lanes' pressures, by (step, lane, chamber), of one run of one big system."""

    def rate(z, k, _):
        y, P = z[:6], z[6:].reshape(-1, 2)
        u = np.clip(array_command(reference[k], y[0], e), -e.plant.valve.u_max, e.plant.valve.u_max)
        return np.concatenate([array_rates(y, reference[k], e), lane_rates(u, y[0], y[1], P, e).ravel()])

    P_0 = e.plant.conditions.P_0
    z = integrated(rate, np.append(equilibrium(e.plant), np.full(2 * len(LANES), P_0)), e.steps, e.h)
    return z[:, :6], z[:, 6:].reshape(e.steps + 1, -1, 2)


def assert_read(e, sampling, read):
    """Compare a replay with all lanes integrated on samples, which `read` gives by step and stage."""
    recording = record(e)
    u, x, v = (read(values) for values in (recording.u, recording.states[:, 0], recording.states[:, 1]))
    u = np.clip(u, -e.plant.valve.u_max, e.plant.valve.u_max)

    def rate(P, k, i):
        return lane_rates(u[k, i], x[k, i], v[k, i], P.reshape(-1, 2), e).ravel()

    P = integrated(rate, np.full(2 * len(LANES), e.plant.conditions.P_0), e.steps, e.h)
    pressures, cells = P.reshape(e.steps + 1, -1, 2), replayed(recording, sampling)
    np.testing.assert_allclose(cells.mse, (errors(recording, pressures) ** 2).mean(axis=0), rtol=1e-6)
    np.testing.assert_allclose(cells.pressure, np.moveaxis(pressures, 0, -1), rtol=1e-9)


def errors(recording, pressures):
    return recording.states[:, np.newaxis, [2, 4]] - pressures


@pytest.mark.parametrize("name", in_brief(["E01", "E06", "E07", "E12", "E16"], ["E06"]))
def test_exact_signals_equal_a_cosimulated_run(name):
    # The same scheme on the same inputs: they differ by roundings, 1e-16 of a pressure of 6e5 Pa in each of
    # 6000 stages, some 1e-6 Pa where chatter amplifies them, on errors of 10 Pa and more. 1e-6 of the mean
    # square, a hundredth of the 1e-4 that would not matter to any table.
    e = lasting(name, 1.0)
    cylinder = e.plant.cylinder._replace(V_d_B=1.5 * e.plant.cylinder.V_d_A)
    e = e._replace(plant=e.plant._replace(cylinder=cylinder))
    recording = record(e)
    states, pressures = cosimulated(e, recording.reference)
    mse = ((states[:, np.newaxis, [2, 4]] - pressures) ** 2).mean(axis=0)
    cells = replayed(recording)
    assert mse.shape == cells.mse.shape == (len(LANES), 2)
    assert (cells.status == OK).all()
    np.testing.assert_allclose(cells.mse, mse, rtol=1e-6)
    np.testing.assert_allclose(cells.pressure, np.moveaxis(pressures, 0, -1), rtol=1e-9)  # of P: 6e-4 Pa
    # It is sampling that is tested: the other one is far away where the command moves.
    other = replayed(recording, INTERPOLATED)
    assert (abs(other.mse / cells.mse - 1) > 1e-3).mean() > 0.9


@pytest.mark.parametrize(
    ("name", "rule", "late", "every"),
    [
        *(("E06", "linear", 0.0, 1), ("E07", "linear", 0.0, 2), ("E14", "linear", 0.13, 1)),
        *(("E03", "linear", 0.5, 1), ("E16", "linear", 1.0, 4), ("E06", "linear", 2.3, 1)),
        *(("E06", "hold", late, every) for late, every in ((0, 1), (1, 1), (0, 5), (2, 3))),
    ],
)
def test_samples_are_those_of_numpy(name, rule, late, every):
    # As above; (k + c)/every - late rounds differently, 1e-13 of a step.
    e = lasting(name, 0.5 if rule == "linear" else 0.3)
    k = np.arange(e.steps + 1)
    at = k[:-1, np.newaxis] + C - late * every
    held = np.maximum(k[:-1] // every - int(late), 0)[:, np.newaxis] * every * np.ones(6, int)

    def read(series):
        return series[held] if rule == "hold" else np.interp(at, k[::every], series[::every])

    assert_read(e, Sampling(rule, delay=(float(late),) * 3, every=every), read)


@both_samplings
def test_statistics_are_those_of_every_step(sampling):
    # Sums of 801 terms: 801 EPS of their size at most.
    recording = record(lasting("E08", 0.8))
    cells = replayed(recording, sampling)
    error = errors(recording, np.moveaxis(cells.pressure, -1, 0))
    np.testing.assert_allclose(cells.mse, (error**2).mean(axis=0), rtol=801 * EPS)
    size = abs(error).mean(axis=0).max()
    np.testing.assert_allclose(cells.mean_error, error.mean(axis=0), rtol=0, atol=801 * EPS * size)
    tolerance = {"atol": 2000 * EPS * cells.mse.max(), "rtol": 1e-9}
    np.testing.assert_allclose(cells.variance, error.var(axis=0), **tolerance)
    np.testing.assert_allclose(cells.mean_error**2 + cells.variance, cells.mse, rtol=4 * EPS)
    assert (cells.variance > 0).all() and (cells.failure_step == -1).all()


@both_samplings
def test_lanes_are_independent_and_a_mirrored_recording_swaps_the_chambers(sampling):
    recording = record(lasting("E06", 0.5))
    together = replayed(recording, sampling)
    for i in (0, 5, 30, 65):
        alone = replayed(recording, sampling, LANES[i : i + 1])
        assert np.array_equal(alone.pressure[0], together.pressure[i])
    states = recording.states[:, [0, 1, 4, 5, 2, 3]] * [-1, -1, 1, 1, 1, 1]
    other = recording._replace(states=states, reference=-recording.reference, u=-recording.u)
    mirrored = replayed(other, sampling)
    for name in ("pressure", "mse"):  # IEEE arithmetic is symmetric in sign: equality
        assert np.array_equal(getattr(together, name), getattr(mirrored, name)[:, ::-1])


def test_a_replay_is_that_of_the_python_that_one_reads():
    # 40 steps; powers may differ by an ulp between libraries, which adds up to 1e-13 at most.
    recording = record(lasting("E14", 0.04))
    lanes = [*lane_array([full_order_lane(1.4)]), *LANES[INDEX[[0, 3, 4, 7, 9], 5]]]
    compiled = replayed(recording, EXACT_SAMPLING, np.array(lanes)).pressure
    plain = [[replay_lane(recording, Lane(*row), side) for side in Side] for row in lanes]
    np.testing.assert_allclose(compiled, plain, rtol=1e-13)


def test_every_cell_finds_its_lane_and_failed_ones_leave_the_others_alone_and_say_when():
    e = lasting("E14", 0.2)
    recording = record(e)
    stride = e.pressure_stride
    sound = replayed(recording, INTERPOLATED)
    replays = replayed(recording._replace(plant=e.plant._replace(k_0=1e7)), INTERPOLATED, stride=stride)
    walled = np.array([model.wall != "none" for model in MODELS.values()])
    no_wall = INDEX[~walled]
    assert np.array_equal(replays.mse[no_wall], sound.mse[no_wall])
    assert (replays.status[no_wall] == OK).all()
    warm = INDEX[walled, 1:]  # at n = 1 the air is always at T_amb
    assert (replays.status[warm] == LEFT_RANGE).all()

    for i, side in zip(*np.nonzero(replays.status), strict=True):
        step, pressure = replays.failure_step[i, side], replays.pressure[i, side]
        seen = -(-step // stride)  # samples before it
        assert (pressure[:seen] > 0).all() and np.isnan(pressure[seen:]).all()

    dataset = replay_dataset(e, STUDY.n, INDEX, replays)
    for name in ("status", "mse", "mean_error", "variance"):
        assert np.array_equal(dataset[name], getattr(replays, name)[INDEX], equal_nan=True)
    assert np.array_equal(dataset["pressure"], replays.pressure[INDEX].astype(np.float32), equal_nan=True)
    assert np.array_equal(dataset["t"], np.arange(0, 0.2001, e.pressure_stride * e.h).round(3))
    times = np.where(replays.status == OK, np.nan, replays.failure_step * e.h)[INDEX]
    assert np.array_equal(dataset["failure_time"], times, equal_nan=True)
    assert dataset["status"].attrs["flag_values"].tolist() == list(STATUS)
    assert len(dataset["status"].attrs["flag_meanings"].split()) == len(STATUS)


def test_a_failed_run_has_no_replay_and_a_measured_one_may_lack_signals():
    recording = record(lasting("E14", 0.05))
    states = recording.states.copy()
    states[20:] = np.nan
    failed = replay(recording._replace(states=states), LANES, EXACT_SAMPLING)
    assert (failed.status == NO_RUN).all() and (failed.failure_step == 20).all()
    assert np.isnan(failed.mse).all() and np.isnan(failed.pressure).all()
    measured = recording.states.copy()
    measured[:, 2:] = np.nan  # neither pressures nor temperatures
    cells = replay(recording._replace(states=measured), LANES, INTERPOLATED)
    assert (cells.status == OK).all() and np.isnan(cells.mse).all()
    np.testing.assert_allclose(cells.pressure, replay(recording, LANES, INTERPOLATED).pressure, rtol=1e-9)
