"""The fast kernel against the readable reference: single rates, whole replays, and lanes it cannot follow."""

from functools import cache

import numpy as np
import pytest
from brief import in_brief
from hypothesis import example, given, settings
from hypothesis import strategies as st
from paper_study import STUDY, lasting

from pneumo import testing as some
from pneumo.configuration.experiment import Drive
from pneumo.configuration.sampling import EXACT_SAMPLING, HELD, INTERPOLATED, Sampling
from pneumo.physics.models import MODELS, Lane, full_order_lane, lane, lane_array
from pneumo.physics.valve import exact_gas
from pneumo.simulation import polynomials
from pneumo.simulation import replay as replay_module
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import LEFT_RANGE, NO_RUN, OK, replay, replay_one_by_one

LANES, _ = grid_lanes(STUDY.n, 1.4)
LINEAR = INTERPOLATED
SAMPLINGS = [
    LINEAR,
    EXACT_SAMPLING,
    HELD,
    Sampling("hold_next"),
    HELD._replace(delay=(1.0, 1.0, 1.0), every=3),
]
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

    def spy(recording, lanes, in_turn, *rest):
        handed.extend(map(tuple, in_turn))
        return together(recording, lanes, in_turn, *rest)

    together = replay_module.replay_together
    with monkeypatch.context() as patch:
        patch.setattr(replay_module, "replay_together", spy)
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


def all_lanes(gamma):
    n = np.linspace(1.0, gamma, 4)
    return lane_array([lane(m, i, gamma) for m in MODELS.values() for i in (n if m.has_n else n[:1])])


@pytest.mark.parametrize("seconds", in_brief([6.0, 60.0], [6.0]))
@pytest.mark.parametrize("sampling", in_brief(SAMPLINGS, SAMPLINGS[:2]))
def test_the_kernel_follows_all_lanes_of_the_whole_of_e14(monkeypatch, sampling, seconds):
    ours, theirs, handed = handed_over(monkeypatch, record(lasting("E14", seconds)), LANES, sampling, 1000)
    assert (theirs.status == OK).all() and not handed
    assert_same(ours, theirs, rtol=1e-10)  # mean squares of 60 000 errors, added with a rounding each


@pytest.mark.parametrize(("b", "terms"), [(0.4, 10), (0.2, 14), (0.1, 18)])
def test_the_kernel_follows_the_ellipse_of_any_critical_ratio(b, terms):
    gas = E14.plant.gas._replace(critical_ratio=b, elliptic=True)
    assert len(polynomials.flow_polynomial(gas)[0]) == terms <= replay_module.core.lib.MOST_TERMS
    assert_same(*both(record(E14._replace(plant=E14.plant._replace(gas=gas)))))


def test_polytropic_indices_below_one():
    n = np.linspace(0.8, 0.95, replay_module.WIDTH)  # a group of lanes of one model alone
    lanes = [lane(model, value, 1.4) for model in MODELS.values() if model.has_n for value in n]
    assert any(each.a < 0 and each.wall_scale == 0 for each in lanes)
    assert_same(*both(lanes=lane_array(lanes)))


# With a supply little above the atmosphere, some lanes of a step come near to a port and others do not.
LOW = E14.plant._replace(conditions=E14.plant.conditions._replace(P_s=0.55e5, P_atm=0.5e5, P_0=0.5e5))


@settings(max_examples=40)
@example(LOW, 1, True, 0.0, 1)
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


@pytest.mark.parametrize(("steps", "first", "v"), [(400, 200, 400.0), (200, 200, 4e4)])
def test_lanes_that_fail_are_reported_as_the_reference_does(monkeypatch, steps, first, v):
    # A piston that tears open a small chamber: dP/dt = -n P dV/dt / V takes P below zero within a step, on
    # the way or at the last one.
    states = recorded().states[: steps + 1].copy()
    states[first:, 1] = v
    torn = Recording(states, recorded().reference[: steps + 1], recorded().u[: steps + 1], *recorded()[3:])
    torn = torn._replace(halvings=torn.halvings[:steps])
    ours, theirs, handed = handed_over(monkeypatch, torn, sampling=LINEAR)
    assert (theirs.status == LEFT_RANGE).any(axis=1).all() and not (theirs.status == NO_RUN).any()
    assert len(handed) == DIFFERENT
    assert_same(ours, theirs)
    assert (ours.failure_step[ours.status == LEFT_RANGE] >= first).all()


@pytest.mark.parametrize("name", ["E06", "E12", "E14"])
@pytest.mark.parametrize("sampling", [LINEAR, EXACT_SAMPLING], ids=["interpolated", "exact"])
def test_full_orders_that_advance_in_pairs_have_the_bits_of_each_alone(name, sampling):
    e = lasting(name, 1.0)
    recording, gamma, wall = record(e), e.plant.gas.gamma, e.plant.wall
    # With the last of these conductances a step of 1 ms fails.
    pairs = lane_array([full_order_lane(gamma, wall, scale) for scale in (2.7, 0.37, 1.0, 1e5)])
    together = replay_one_by_one(recording, pairs, sampling, 10)
    assert together.status.tolist() == [[OK, OK]] * 3 + [[LEFT_RANGE, LEFT_RANGE]]
    for row, lane_alone in enumerate(pairs):
        alone = replay_one_by_one(recording, lane_alone[None], sampling, 10)
        for values, expected in zip(together, alone, strict=True):
            np.testing.assert_array_equal(values[row], expected[0])
