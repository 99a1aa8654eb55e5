"""Traces of the report: samples where they are said to be, errors by interval of every step."""

import numpy as np
import pytest
from paper_study import STUDY, lasting

from paper.study import trace_layout
from paper.study.samplings import study_sampling
from paper.study.trace_layout import (
    CHOICES,
    COMMON_N,
    TRACED,
    close_up,
    interval_edges,
    replay_and_errors,
    shown_steps,
    traced,
    traced_lanes,
)
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.simulation.replay import replay

EXPERIMENT = lasting("E12", 7.013)  # no multiple of anything


@pytest.fixture(scope="module")
def recording():
    return record(EXPERIMENT)


def made(recording, transport, failed=False):
    lanes, index = traced_lanes(EXPERIMENT, STUDY.n)
    cells, errors = replay_and_errors(EXPERIMENT, lanes, recording, study_sampling(transport, EXPERIMENT))
    if failed:
        cells.status[index[list(MODELS).index("M8"), 0]] = 1
    return traced(EXPERIMENT, STUDY.n, index, cells, errors)


@pytest.fixture(scope="module")
def every_step(recording):
    """Errors at every step, by (cell, chamber, step), and each cell's lane."""
    lanes, index = traced_lanes(EXPERIMENT, STUDY.n)
    replayed = replay(recording, lanes, study_sampling("published", EXPERIMENT))
    return recording.states[:, [2, 4]].T - replayed.pressure, index, replayed.mse


@pytest.mark.parametrize("experiment", [*STUDY.experiments.values(), EXPERIMENT, lasting("E03", 0.9)])
def test_samples_and_intervals_cover_a_run(experiment):
    shown, edges = shown_steps(experiment), interval_edges(experiment)
    first, last = close_up(experiment)
    assert shown[0] == 0 and shown[-1] <= experiment.steps < shown[-1] + experiment.pressure_stride
    assert np.diff(shown).max(initial=0) <= experiment.pressure_stride
    inside = shown[(shown >= first) & (shown <= last)]
    assert np.diff(inside).max(initial=0) * experiment.h <= trace_layout.CLOSE_UP_SAMPLE + 1e-12
    assert edges[0] == 0 and edges[-1] == experiment.steps and (np.diff(edges) > 0).all()
    assert {first, last} <= set(edges) and len(edges) <= trace_layout.INTERVALS + 12
    assert (last - first) * experiment.h == pytest.approx(min(2.0, experiment.duration))


def test_errors_are_those_of_every_step(recording, every_step):
    errors, index, mse = every_step
    traces = made(recording, "published")
    best = np.array(STUDY.n)[mse.mean(axis=1)[index].argmin(axis=1)]
    shown, edges = shown_steps(EXPERIMENT), interval_edges(EXPERIMENT)
    for choice, n in zip(CHOICES, (best, np.full(len(TRACED), COMMON_N)), strict=True):
        for m, name in enumerate(TRACED):
            lane = index[m, STUDY.n.index(n[m])]
            cell = traces.sel(choice=choice, model=name)
            for c in range(2):
                error = errors[lane, c]
                np.testing.assert_array_equal(cell["error"][c], error[shown].astype(np.float32))
                parts = np.split(error, edges[1:-1])
                np.testing.assert_allclose(cell["mean_square"][c], [np.mean(part**2) for part in parts])
                for value, of_part in (("lowest", np.min), ("highest", np.max)):
                    expected = np.array([of_part(part) for part in parts], dtype=np.float32)
                    np.testing.assert_array_equal(cell[value][c], expected)
                counts = [len(part) for part in parts]
                whole = np.average(cell["mean_square"][c], weights=counts)
                assert whole == pytest.approx(mse[lane, c], rel=1e-9)


def test_a_model_that_failed_at_some_n_has_no_best_trace(recording):
    traces = made(recording, "exact", failed=True).sel(model="M8")
    for name in ("error", "mean_square", "lowest", "highest", "n_shown"):
        assert np.isnan(traces[name].sel(choice="best")).all()
        assert np.isfinite(traces[name].sel(choice="common")).all()
