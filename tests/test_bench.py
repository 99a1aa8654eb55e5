"""The bench runs, and refuses a contender that computes something else. No timing is judged."""

import pytest

from benchmarks import bench


@pytest.mark.slow
def test_contenders_agree_and_are_timed():
    assert all(value > 0 for value in bench.compare(1, seconds=0.1).values())


def test_a_contender_with_other_numbers_stops_the_bench(monkeypatch):
    core = bench.CONTENDERS["core"]
    wrong = core._replace(replay=lambda *of: 1.001 * core.replay(*of))
    monkeypatch.setattr(bench, "CONTENDERS", {"core": wrong})
    with pytest.raises(ArithmeticError, match=r"side by side: .* by 1\.0e-03"):
        bench.compare(1, seconds=0.01)
