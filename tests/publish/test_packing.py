"""Packed traces come back as they were rounded, and rounding stays below half a stated step."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from packed_traces import unpacked

from paper.study.pages import packing
from paper.study.pages.packing import LEAST_STEP, MISSING, packed, rounded, rounding_step

short = st.integers(-(2**15), 2**15 - 1)


@st.composite
def groups(draw):
    samples = draw(st.integers(1, 20))
    rows = draw(st.lists(st.integers(1, 9), min_size=1, max_size=4))
    return [draw(arrays(np.int16, (count, samples), elements=short)) for count in rows]


@given(groups())
@example([np.array([[32767, -32768], [-32768, 32767], [0, 0]], dtype=np.int16)])
def test_what_is_packed_comes_back(traces):
    before = [trace.copy() for trace in traces]
    traces_read = unpacked(packed(traces), [len(trace) for trace in traces], traces[0].shape[1])
    for trace, back, original in zip(traces, traces_read, before, strict=True):
        assert (trace == original).all()
        assert (back == original).all()


pascal = st.floats(-1e7, 1e7)


@given(arrays(float, st.integers(1, 30), elements=pascal), st.floats(1e-3, 1e6))
def test_rounding_is_below_half_a_step(values, rms):
    step = rounding_step(rms, float(np.abs(values).max()))
    kept = rounded(values, step)
    assert (kept != MISSING).all()
    # 1e-9: what the division of a number of steps may lose, many times over.
    assert (np.abs(kept * step - values) <= step * (0.5 + 1e-9)).all()


@given(st.floats(1e-3, 1e6), st.floats(0, 1e9))
@example(16.0, 5e-324)
def test_a_step_is_round_and_no_larger_than_it_must_be(rms, largest):
    step = rounding_step(rms, largest)
    digits = f"{step:e}"
    assert digits[0] in "125" and float(digits[1:8]) == 0
    assert largest / step <= packing.LARGEST_CODE * (1 + 1e-9)
    # At most 5/2 lies between neighbours of 1, 2, 5, 10.
    assert step <= max(rms / packing.FRACTION, LEAST_STEP, 2.5 * largest / packing.LARGEST_CODE) * (1 + 1e-8)


@pytest.mark.parametrize(
    ("rms", "step"),
    [(16.0, 1.0), (31.9, 1.0), (32.0, 2.0), (3678.0, 200.0), (1.0, LEAST_STEP), (np.nan, LEAST_STEP)],
)
def test_steps(rms, step):
    assert rounding_step(rms, 0.0) == step


def test_what_is_not_finite_is_missing():
    assert rounded(np.array([1.4, np.nan, -np.inf, -2.6]), 1.0).tolist() == [1, MISSING, MISSING, -3]
