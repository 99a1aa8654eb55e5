"""The fast kernel against the readable reference: single rates, whole replays, and lanes it cannot follow."""

import math
from functools import cache

import numpy as np
import pytest
from brief import in_brief
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from paper_study import STUDY, lasting

from pneumo import testing as some
from pneumo.configuration.experiment import Drive
from pneumo.configuration.sampling import EXACT_SAMPLING, HELD, HELD_TO_NEXT, INTERPOLATED, Sampling
from pneumo.physics.models import MODELS, Lane, lane, lane_array
from pneumo.physics.valve import exact_gas, mass_flow
from pneumo.simulation import polynomials
from pneumo.simulation import replay as replay_module
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import LEFT_RANGE, OK, replay, replay_one_by_one

LANES, _ = grid_lanes(STUDY.n, 1.4)
LINEAR = INTERPOLATED
SAMPLINGS = [LINEAR, EXACT_SAMPLING, HELD, HELD_TO_NEXT, Sampling(held=True, delay=(1.0, 1.0, 1.0), every=3)]
EPS = np.finfo(float).eps
COUNT = len(LANES)
DIFFERENT = len(np.unique(LANES, axis=0))
E14 = lasting("E14", 0.4)


@cache
def recorded():
    """The run that most tests replay."""
    return record(E14)


def both(recording=None, lanes=LANES, sampling=EXACT_SAMPLING, stride=1):
    """The same replays by the entry, which takes the fast kernel where it can, and by the reference."""
    arguments = recording or recorded(), lanes, sampling, stride
    return replay(*arguments), replay_one_by_one(*arguments)


def handed_over(monkeypatch, recording=None, lanes=LANES, sampling=EXACT_SAMPLING, stride=1):
    """Result of the fast replay, that of the reference, and the lanes that were left to the reference."""
    recording, handed = recording or recorded(), []

    def spy(recording, lanes, *rest):
        handed.extend(map(tuple, lanes))
        return one_by_one(recording, lanes, *rest)

    one_by_one = replay_module.replay_one_by_one
    with monkeypatch.context() as patch:
        patch.setattr(replay_module, "replay_one_by_one", spy)
        ours = replay(recording, lanes, sampling, stride)
    return ours, replay_one_by_one(recording, lanes, sampling, stride), handed


def assert_same(ours, theirs, rtol=1e-9):
    # A rounding of 1e-16 P moves eq (1) by 1e-8 of the choked flow where pressures are equal, for one step at
    # the most: 1e-10 of P. The moments' rtol is 1e-9 where runs are short and errors may be some 0.1 P.
    for name in ("status", "failure_step"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
    np.testing.assert_allclose(ours.pressure, theirs.pressure, rtol=1e-10)
    np.testing.assert_allclose(ours.mse, theirs.mse, rtol=rtol)
    for name, scale in (("mean_error", np.sqrt(theirs.mse)), ("variance", theirs.mse)):
        difference = getattr(ours, name) - getattr(theirs, name)
        np.testing.assert_array_equal(np.isnan(difference), np.isnan(scale))
        assert not (abs(difference) > rtol * scale).any()


@given(some.gammas(), some.gas_constants())
@example(1.05, 287.0)
@example(5 / 3, 2077.0)
def test_flow_polynomial_holds_for_any_gas(gamma, R):
    assert polynomials.flow_polynomial(exact_gas(R, gamma))[1] < polynomials.FLOW_TOLERANCE / 10


@pytest.mark.parametrize(("b", "terms"), [(None, 10), (0.4, 10), (0.3, 14), (0.1, 18)])
def test_the_flow_has_the_fewest_terms_that_suffice_and_an_even_number_of_them(b, terms):
    air = exact_gas(287.0, 1.4)
    gas = air if b is None else air._replace(critical_ratio=b, elliptic=True)
    psi, _ = polynomials.flow_polynomial(gas)
    assert len(psi) == terms
    for ratio in np.linspace(gas.critical_ratio, 0.999, 7)[1:]:
        s = -math.log(ratio)
        flow = math.sqrt(s) * Polynomial(psi)(s) / math.sqrt(293.0)
        assert flow == pytest.approx(mass_flow(1.0, 1.0, ratio, 293.0, gas), rel=1e-11)


def all_lanes(gamma):
    n = np.linspace(1.0, gamma, 4)
    return lane_array([lane(m, i, gamma) for m in MODELS.values() for i in (n if m.has_n else n[:1])])


def test_terms_that_a_lane_needs():
    for names, n, expected in (
        (("M1", "M2", "M3", "M4"), 1.2, 0),
        (("M5", "M6"), 1.2, 1),
        (("M5", "M6"), 0.9, 1),
        (("M5", "M6"), 1.0, 0),  # a constant temperature
        (("M7", "M8", "M9"), 1.2, 2),
        (("M10",), 1.2, 3),
    ):
        lanes = lane_array([lane(MODELS[name], n, 1.4) for name in names])
        assert replay_module.needs(lanes).tolist() == [expected] * len(names)


REACH = 2 * polynomials.EXP_REACH / 700  # exponents whose polynomial ends at the logarithm of no pressure


@pytest.mark.parametrize(
    ("name", "changes", "able"),
    [
        *((name, {}, True) for name in MODELS),
        ("M10", {"e_PT": 0.7}, False),
        ("M10", {"e_PT": -0.5}, False),
        ("M9", {"e_A": 0.5}, False),
        ("M9", {"e_A": -1.0}, False),
        ("M10", {"e_A": 2.0}, False),
        ("M10", {"wall_scale": 0.0, "e_PT": 0.3}, True),  # a law that is not read
        *(("M6", {"a": sign * 1.0005 * REACH}, True) for sign in (1, -1)),
        *(("M6", {"a": sign * 0.9995 * REACH}, False) for sign in (1, -1)),
    ],
)
def test_lanes_that_the_kernel_follows(name, changes, able):
    row = lane_array([lane(MODELS[name], 1.2, 1.4)._replace(**changes)])
    assert replay_module.followed(row, E14.plant).tolist() == [able]
    laminar = E14.plant._replace(valve=E14.plant.valve._replace(laminar=1e-3))
    assert not replay_module.followed(row, laminar).any()


@pytest.mark.parametrize("seconds", in_brief([6.0, 60.0], [6.0]))
@pytest.mark.parametrize("sampling", in_brief(SAMPLINGS, SAMPLINGS[:2]))
def test_the_kernel_follows_all_lanes_of_the_whole_of_e14(monkeypatch, sampling, seconds):
    ours, theirs, handed = handed_over(monkeypatch, record(lasting("E14", seconds)), LANES, sampling, 1000)
    assert (theirs.status == OK).all() and not handed
    assert_same(ours, theirs, rtol=1e-10)  # mean squares of 60 000 errors, added with a rounding each


@pytest.mark.parametrize("sampling", SAMPLINGS[:2])
@pytest.mark.parametrize("name", ["E01", "E06", "E07", "E12", "E16"])
def test_other_experiments(name, sampling):
    assert_same(*both(record(lasting(name, 0.4)), sampling=sampling))


def test_polytropic_indices_below_one():
    n = np.linspace(0.8, 0.95, replay_module.WIDTH)  # a group of lanes of one model alone
    lanes = [lane(model, value, 1.4) for model in MODELS.values() if model.has_n for value in n]
    assert any(each.a < 0 and each.wall_scale == 0 for each in lanes)
    assert_same(*both(lanes=lane_array(lanes)))


@settings(max_examples=40)
@given(
    some.plants(), st.integers(0, 2**32 - 1), st.booleans(), st.floats(0.0, 3.0), st.sampled_from([0, 1, 3])
)
def test_any_plant_and_any_signals(plant, seed, exact, late, most):
    # Signals unrelated to each other are harder than recorded ones: whatever they make of the lanes, failure
    # included, the reference makes too.
    random, steps = np.random.default_rng(seed), 12
    c, half = plant.conditions, plant.cylinder.stroke / 2
    x, v = random.uniform(-0.9, 0.9, steps + 1) * half, random.normal(0, 0.3, steps + 1)
    air = random.uniform(0.3, 1.2, (4, steps + 1)).T * [c.P_0, c.T_0, c.P_0, c.T_0]
    reference, u = random.normal(0, half, steps + 1), random.normal(0, 8, steps + 1)
    drive, halvings = Drive(True, 10 / half, half), random.integers(0, most + 1, steps, np.int8)
    recording = Recording(np.column_stack([x, v, air]), reference, u, drive, plant, 1e-3, halvings, most)
    sampling = EXACT_SAMPLING if exact else Sampling(delay=(late,) * 3)
    assert_same(*both(recording, all_lanes(plant.gas.gamma), sampling))


@pytest.mark.parametrize("stride", [1, 7, 400, 401])
def test_stride(stride):
    every, (some_steps, theirs) = both()[0], both(stride=stride)
    np.testing.assert_array_equal(some_steps.pressure, every.pressure[:, :, ::stride])
    np.testing.assert_array_equal(some_steps.mse, every.mse)  # from every step, whatever is stored
    assert some_steps.pressure.shape == theirs.pressure.shape


def test_long_sums_keep_small_terms():
    # 200 000 steps at rest, full-order pressure off by 0.1 Pa: a plain sum of that many squares loses 1e-12.
    steps, c = 200_000, E14.plant.conditions
    states = np.tile([0.0, 0.0, c.P_0 + 0.1, c.T_0, c.P_0 + 0.1, c.T_0], (steps + 1, 1))
    rest = recorded()._replace(states=states, reference=np.zeros(steps + 1), u=np.zeros(steps + 1))
    rest = rest._replace(halvings=np.zeros(steps, np.int8))
    cells = replay(rest, LANES[LANES[:, Lane._fields.index("wall_scale")] == 0][:3], LINEAR, steps)
    assert cells.mse.shape == (3, 2)
    offset = states[0, 2] - c.P_0
    np.testing.assert_allclose(cells.mean_error, offset * steps / (steps + 1), rtol=4 * EPS)
    np.testing.assert_allclose(cells.mse, offset**2 * steps / (steps + 1), rtol=4 * EPS)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 65, COUNT])
def test_a_lane_notices_neither_its_company_nor_its_place(count):
    order = np.random.default_rng(count).permutation(COUNT)[:count]
    together, some_lanes = (replay(recorded(), lanes, LINEAR) for lanes in (LANES, LANES[order]))
    for ours, theirs in zip(some_lanes, together, strict=True):
        np.testing.assert_array_equal(ours, theirs[order])


def test_lanes_that_are_the_same_are_replayed_once(monkeypatch):
    # M1 is M2 and M5 at n = 1, M3 is M2 at n = gamma: 63 lanes of the paper's 66, eight full registers.
    paper, blocks, block = LANES[:66], [], replay_module.replay_side_by_side
    monkeypatch.setattr(replay_module, "replay_side_by_side", lambda *a: blocks.append(a[1]) or block(*a))
    once, thrice = (replay(recorded(), lanes, LINEAR) for lanes in (paper, np.tile(paper, (3, 1))))
    assert [len(lanes) for lanes in blocks] == [63, 63]
    for ours, theirs in zip(thrice, once, strict=True):
        assert ours.tobytes() == np.concatenate([theirs] * 3).tobytes()
    index = {name: row for name, row in zip(MODELS, grid_lanes(STUDY.n, 1.4)[1], strict=True)}
    for first, second in ((index["M1"][0], index["M5"][0]), (index["M3"][0], index["M2"][-1])):
        assert once.mse[first].tobytes() == once.mse[second].tobytes()


def test_more_lanes_than_the_work_array_holds_and_a_signal_that_is_not_a_number():
    # Indices n_V that no model has.
    others = [LANES * np.array([n_V, *[1.0] * (LANES.shape[1] - 1)]) for n_V in (1.0, 0.9, 0.8)]
    together = replay(recorded(), np.concatenate(others), LINEAR)
    assert len(np.unique(np.concatenate(others), axis=0)) > replay_module.ROW
    apart = [replay(recorded(), lanes, LINEAR) for lanes in others]
    for ours, *theirs in zip(together, *apart, strict=True):
        assert ours.tobytes() == np.concatenate(theirs).tobytes()
    u = recorded().u.copy()
    u[100] = np.nan
    assert_same(*both(recorded()._replace(u=u), sampling=LINEAR))


def test_lanes_that_the_kernel_cannot_follow_are_run_by_the_reference(monkeypatch):
    # n = 50 has a = 0.98: the polynomial ends at 0.29 to 3.4 P_0, and chambers empty to 0.18 P_0. The others
    # have coefficients that no model has.
    changes = {"e_A": 2.0}, {"e_A": -1.0, "e_PT": 0.0}, {"e_PT": 0.3}, {"e_A": 0.0, "e_PT": 0.5}, {"a": 1e-4}
    others = [lane(MODELS["M10"], 1.2, 1.4)._replace(**change) for change in changes]
    odd = lane_array([lane(MODELS["M6"], 50.0, 1.4), *others])
    lanes = np.concatenate([LANES[:30], odd, LANES[30:]])
    ours, theirs, handed = handed_over(monkeypatch, record(lasting("E06", 2.0)), lanes)
    assert sorted(handed) == sorted(map(tuple, odd))
    assert_same(ours, theirs)


@pytest.mark.parametrize(("steps", "first", "v"), [(400, 200, 400.0), (200, 200, 4e4)])
def test_lanes_that_fail_are_reported_as_the_reference_does(monkeypatch, steps, first, v):
    # A piston that tears open a small chamber: dP/dt = -n P dV/dt / V takes P below zero within a step, on
    # the way or at the last one.
    states = recorded().states[: steps + 1].copy()
    states[first:, 1] = v
    torn = Recording(states, recorded().reference[: steps + 1], recorded().u[: steps + 1], *recorded()[3:])
    torn = torn._replace(halvings=torn.halvings[:steps])
    ours, theirs, handed = handed_over(monkeypatch, torn, sampling=LINEAR)
    assert (theirs.status == LEFT_RANGE).any(axis=1).all()
    assert len(handed) == DIFFERENT
    assert_same(ours, theirs)
    assert (ours.failure_step[ours.status == LEFT_RANGE] >= first).all()


@pytest.mark.parametrize(
    "plant",
    [
        E14.plant._replace(gas=E14.plant.gas._replace(critical_ratio=1e-3)),  # too low for the polynomial
        E14.plant._replace(valve=E14.plant.valve._replace(leak=1e-8)),
    ],
)
def test_plants_that_the_kernel_leaves_to_the_reference(monkeypatch, plant):
    ours, theirs, handed = handed_over(monkeypatch, recorded()._replace(plant=plant))
    assert len(handed) == DIFFERENT
    assert_same(ours, theirs)
    assert not np.allclose(ours.mse, replay(recorded(), LANES, EXACT_SAMPLING).mse, rtol=1e-3)
