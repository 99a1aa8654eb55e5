"""What a fleet costs: the law recovers what runs were made of, and its page is what was measured."""

import json

import pytest
from checkout import ROOT

from benchmarks.fleet_law import law, minutes, rows

JOB, CYLINDER = 9.0, 8.0  # core-seconds of the runs below
PLANNED = [
    {"cylinders": n, "jobs": -(-n // 50) + 1, "wall_s": 9.0, "cpu_s": s, "peak_MB": 114.0}
    for n, s in ((10, 5.0), (10_000, 8.0))
]


def runs(*cylinders_and_blocks):
    return [
        {"cylinders": n, "jobs": blocks + 1, "cpu_s": 5.0 + JOB * (blocks + 1) + CYLINDER * n}
        for n, blocks in cylinders_and_blocks
    ]


@pytest.fixture
def law_fit():
    sizes = [
        {"cylinders": n, "blocks": blocks, "blocks_kB": 40.0 * n + 150.0 * blocks, "index_kB": 100.0 + n}
        for n, blocks in ((5, 5), (10, 1), (110, 3))
    ]
    return {"planned": [*PLANNED], "runs": runs((5, 1), (5, 5), (10, 1)), "sizes": sizes}


def test_the_law_recovers_what_runs_were_made_of(law_fit):
    fitted = law(law_fit)
    assert fitted == pytest.approx((JOB, CYLINDER, 150.0, 40.0, 100.0, 1.0), abs=1e-9)
    small, large = rows(law_fit)
    assert 3600 * small["core_h"] == pytest.approx(5 + 2 * JOB + 10 * CYLINDER)
    assert 3600 * large["core_h"] == pytest.approx(8 + 201 * JOB + 10_000 * CYLINDER)
    assert large["disk_MB"] == pytest.approx((100 + 200 * 150 + 10_000 * 41) / 1000)


def test_a_cluster_runs_blocks_in_turns(law_fit):
    turn = JOB + 50 * CYLINDER / 4  # a block on a node's four cores
    assert minutes(law_fit) == pytest.approx((8 + 2 * turn + JOB) / 60)  # 200 blocks on 100 nodes
    law_fit["planned"][-1] = PLANNED[-1] | {"cylinders": 10_050}
    assert minutes(law_fit) == pytest.approx((8 + 3 * turn + JOB) / 60)


def test_the_law_is_within_two_percent_of_the_runs_that_were_measured():
    measured = json.loads((ROOT / "docs/static/fleet.json").read_text(encoding="utf-8"))
    fitted, planning = law(measured), measured["planned"][0]["cpu_s"]
    for run in measured["runs"]:
        seconds = planning + run["jobs"] * fitted.job_s + run["cylinders"] * fitted.cylinder_s
        assert seconds == pytest.approx(run["cpu_s"], rel=0.02)
