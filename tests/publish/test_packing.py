"""Packed traces come back as they were rounded, and rounding stays below half a stated step."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from packed_traces import unpacked

from paper.study.pages.packing import packed

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
