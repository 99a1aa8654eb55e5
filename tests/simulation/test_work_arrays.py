"""Work arrays of the kernels, in plain Python: an index beyond one is an error, and none is longer than used.

Compiled kernels check no index: beyond a short array they read and write other memory, often unnoticed.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from paper_study import lasting

from pneumo.configuration.sampling import EXACT_SAMPLING, HELD_TO_NEXT, INTERPOLATED, Sampling
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.simulation import (
    chamber_replay,
    fitted_pressures,
    full_order,
    full_order_replay,
    gas_network,
    kalman_filter,
    reference,
    signals,
)
from pneumo.simulation.gas_network import Link, Node, full_order_lane
from pneumo.simulation.runge_kutta import STAGES

E = lasting("E06", 0.003)._replace(most_halvings=1)
PLANT, P_0 = E.plant, E.plant.conditions.P_0
LANES = lane_array([lane(MODELS[name], 1.2, 1.4) for name in ("M1", "M8")])


@pytest.fixture
def unwritten(monkeypatch):
    """Call a function with kernels of some modules in plain Python; return shapes not used to their ends."""

    def called(modules, function, *arguments):
        made = []

        def empty(shape, dtype=float):
            made.append(np.full(shape, np.nan if dtype is float else 0, dtype))
            return made[-1]

        for module in modules:
            monkeypatch.setattr(module, "np", SimpleNamespace(**{**vars(np), "empty": empty}))
            for name, value in list(vars(module).items()):
                monkeypatch.setattr(module, name, getattr(value, "py_func", value))
        getattr(function, "py_func", function)(*arguments)
        ends = [(array, axis) for array in made if array.dtype == float for axis in range(array.ndim)]
        used = {(array.shape, axis) for array, axis in ends if np.isfinite(np.take(array, -1, axis)).any()}
        assert used
        return {array.shape for array, axis in ends if (array.shape, axis) not in used}

    return called


@pytest.fixture(scope="module")
def recording():
    return full_order.record(E)


@pytest.mark.parametrize("most", [0, 1])
def test_of_a_run(unwritten, most):
    start, reference = full_order.equilibrium(PLANT), np.full(4, 0.01)
    unused = unwritten([full_order], full_order.run, start, reference, 0.0, E.drive, PLANT, E.h, most)
    assert unused == (set() if most else {(6,)})  # an error that nobody asks for


@pytest.mark.parametrize("sampling", [EXACT_SAMPLING, INTERPOLATED, HELD_TO_NEXT, Sampling(every=2)])
def test_of_the_stage_inputs_up_to_the_last_sample(unwritten, recording, sampling):
    unused = unwritten([signals], signals._inputs_of, recording, sampling, 0, np.array([0, 1, 2]))
    assert unused == (set() if sampling.exact else {(6,), (STAGES + 1, 6)})  # nothing is integrated again


def test_of_a_replay_of_the_chambers(unwritten, recording):
    modules = [chamber_replay, signals]
    assert not unwritten(modules, chamber_replay.replay_chambers, recording, EXACT_SAMPLING, 1)


def test_of_the_readable_replay(unwritten, recording, monkeypatch):
    monkeypatch.setattr(reference, "replay_tolerance", lambda _: 0.0)  # every step is halved
    modules = [reference, signals]
    assert not unwritten(modules, reference.replay_lanes, recording, LANES, EXACT_SAMPLING, 1)


@pytest.mark.parametrize("count", [1, 3])
def test_of_a_replay_of_the_full_order(unwritten, recording, monkeypatch, count):
    monkeypatch.setattr(full_order_replay, "replay_tolerance", lambda _: 0.0)
    modules, rows = [full_order_replay, signals], [full_order_replay.FullRow()] * count
    assert not unwritten(modules, full_order_replay.full_order_mse, recording, rows, EXACT_SAMPLING)


@pytest.mark.parametrize("volts", [5.0, -5.0])
def test_of_a_replay_of_sets(unwritten, volts):
    u, motions = np.full((3, 3), volts), np.full((2, 3, 3, 2), [0.01, -0.1])  # every chamber meets its port
    row = lane_array([lane(MODELS["M10"], 1.0, 1.4)._replace(a=0.0)] * 3)
    V_d, start, start_T = np.full((3, 2), 1e-5), np.full((3, 2), 1.001e5), np.full((3, 2), 293.0)
    start[:, int(volts > 0) :: 2] = PLANT.conditions.P_s - 100.0
    arguments = u, motions, row, V_d, PLANT, E.h, 1, start, start_T
    assert not unwritten([fitted_pressures], fitted_pressures.pressures_of_sets, *arguments)


def test_of_a_network(unwritten):
    law = full_order_lane(1.4), True
    nodes = [Node(*law, 2e5, 293.0, P_0, 293.0, 293.0, 1.0, 1.0, 1.0)] * 2
    links, ones = [Link(0, 1), Link(1, 2)], np.ones((2, 3))
    arguments = nodes, links, [(1e5, 293.0)], 1e-4 * ones, 1e-6 * ones, PLANT.gas, 1e-5
    assert not unwritten([gas_network], gas_network.replay, *arguments)


@pytest.mark.parametrize("full", [False, True])
def test_of_the_filter(unwritten, full):
    model = kalman_filter.FilterModel(full, True, lane(MODELS["M8"], 1.2, 1.4), full_order_replay.FullRow())
    arguments = np.zeros(3), np.full((3, 2), P_0), np.ones(3), np.full(2, P_0), model, PLANT
    noise = kalman_filter.Noise(1.0, 1e3, 1e-8, 1e4)
    assert not unwritten([kalman_filter], kalman_filter.estimated, *arguments, noise, E.h)
