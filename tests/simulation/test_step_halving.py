"""Steps that are halved where they fail or their error estimate is too large."""

import numpy as np
import pytest
from paper_study import lasting

from pneumo.configuration.experiment import MOST_HALVINGS
from pneumo.configuration.sampling import EXACT_SAMPLING, HELD, INTERPOLATED, Sampling
from pneumo.simulation.full_order import RAN, failure, record, run
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import OK, replay, replay_one_by_one

LANES, _ = grid_lanes((1.0, 1.2, 1.4), 1.4)
TO_NEXT = Sampling("hold_next")


def coarse(name, factor, most=MOST_HALVINGS, seconds=3.0):
    """An experiment at so many times its step: many steps are not accurate, some fail."""
    e = lasting(name, seconds)
    excitation = e.excitation._replace(every=e.excitation.every // factor)
    steps = e.steps // factor
    return e._replace(h=factor * e.h, steps=steps, excitation=excitation, most_halvings=most)


def fine(e, parts):
    """An experiment at a fraction of its step."""
    excitation = e.excitation._replace(every=e.excitation.every * parts)
    return e._replace(h=e.h / parts, steps=e.steps * parts, excitation=excitation, most_halvings=0)


@pytest.mark.parametrize("name", ["E06", "E12"])
def test_a_halved_step_is_a_run_at_the_smaller_step(name):
    e = coarse(name, 10)
    r = record(e)
    assert len(set(r.halvings)) > 2
    for k in np.flatnonzero((r.halvings > 0) & (r.halvings < MOST_HALVINGS))[:20]:
        parts = 1 << r.halvings[k]
        # No sign is reversed within a step: what holds at its start holds for all of it.
        forced = e.drive._replace(toggles=False)
        command = np.full(parts + 1, r.reference[k])
        again = run(r.states[k], command, 0.0, forced, e.plant, e.h / parts, MOST_HALVINGS)
        assert not again.halvings.any()
        assert np.array_equal(again.states[-1], r.states[k + 1])


def test_a_run_that_fails_survives_by_halving_near_a_finer_one():
    broken, mended = record(coarse("E06", 10, most=0)), record(coarse("E06", 10))
    status, step = failure(broken.states)
    assert status != RAN and failure(mended.states)[0] == RAN
    # A failed run shows the state in which it failed, and nothing of what was computed from it.
    assert np.isfinite(broken.states[:step]).all() and not np.isnan(broken.states[step]).all()
    assert np.isnan(broken.states[step + 1 :]).all() and step < 290
    exact = record(fine(coarse("E06", 10), 80))
    P, P_exact = mended.states[:, [2, 4]], exact.states[::80, [2, 4]]
    # An error of at most 1e-4 P_0 in a step, 300 of them, most of which the next flows take back.
    assert np.abs(P - P_exact).max() < 5e-3 * mended.plant.conditions.P_0


@pytest.mark.parametrize("sampling", [INTERPOLATED, HELD, TO_NEXT, EXACT_SAMPLING])
@pytest.mark.parametrize("name", ["E06", "E12"])
def test_both_kernels_halve_alike(name, sampling):
    r = record(coarse(name, 10))
    ours, theirs = replay(r, LANES, sampling), replay_one_by_one(r, LANES, sampling)
    assert (theirs.status == OK).all() and np.array_equal(ours.status, theirs.status)
    # The same steps on the same inputs, added in another order: 1e-13 a step where nothing amplifies it.
    np.testing.assert_allclose(ours.pressure, theirs.pressure, rtol=1e-8)
    plain = replay(r._replace(most_halvings=0, halvings=0 * r.halvings), LANES, sampling)
    assert not np.allclose(plain.pressure, ours.pressure, rtol=1e-5)


def test_lanes_do_not_depend_on_their_neighbours_and_exact_ones_follow_the_runs_parts():
    r = record(coarse("E12", 10))
    together = replay(r, LANES, INTERPOLATED).pressure
    alone = np.concatenate([replay(r, row[np.newaxis], INTERPOLATED).pressure for row in LANES[::7]])
    assert np.array_equal(alone, together[::7])
    e = coarse("E06", 10)
    r, exact = record(e), record(fine(e, 80))
    ours = replay(r, LANES, EXACT_SAMPLING).pressure
    theirs = replay(exact, LANES, EXACT_SAMPLING, 80).pressure
    assert np.abs(ours - theirs).max() < 2e-2 * e.plant.conditions.P_0


@pytest.mark.parametrize("replayed", [replay, replay_one_by_one])
def test_a_step_whose_end_reads_the_next_sample_is_halved_only_where_it_fails(replayed):
    # Halves would read the next sample for a shorter time: other signals, not the same ones more closely.
    r = record(coarse("E02", 2))
    assert r.halvings.any()
    plain = r._replace(most_halvings=0)
    ours, theirs = replayed(r, LANES, TO_NEXT), replayed(plain, LANES, TO_NEXT)
    assert (theirs.status == OK).all() and np.array_equal(ours.mse, theirs.mse)
    r = record(coarse("E06", 10))
    plain = r._replace(most_halvings=0)
    assert (replayed(plain, LANES, TO_NEXT).status != OK).any()
    assert (replayed(r, LANES, TO_NEXT).status == OK).all()
