"""Faults on the smoke study, and how studies are compared; `make torture`, `make determinism` do it all."""

import random
import signal
import time

import numpy as np
import pytest
import xarray as xr

from tests.torture.determinism import BOUND, moved
from tests.torture.faults import FAULTS, Bench
from tests.torture.study import stop

in_smoke_study = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


class TestFaults:
    pytestmark = in_smoke_study

    def test_a_spoilt_file_is_refused_by_name_and_made_again(self, smoke_study):
        study, seconds = smoke_study
        bench = Bench(study, study.hashes(), seconds, study.size(), random.Random(1), kills=0, tries=1)
        same, outcome = next(FAULTS["bit_flip"](bench))
        assert same, outcome

    def test_two_kills_then_one_job_at_a_time_give_the_same_bytes(self, smoke_study):
        study, _ = smoke_study
        expected = study.hashes()
        study.clear()
        for with_jobs in (True, False):  # left to themselves, jobs go on writing for a while
            run, there = study.start(), len(study.hashes())
            while len(study.hashes()) == there and run.poll() is None:
                time.sleep(0.1)
            assert stop(run, signal.SIGKILL, with_jobs=with_jobs, after=0)
        assert study.hashes() != expected
        done = study.run("-j1")
        assert done.code == 0, done.output
        assert study.hashes() == expected


# Comparing


@pytest.fixture
def cells() -> xr.Dataset:
    return xr.Dataset(
        {
            "mse": (("n", "t"), np.array([[1.0, -4.0], [np.nan, 2.0]])),
            "status": ("n", np.int8([0, 1])),
            "pressure": ("t", np.float32([1.0, 3.0])),
        }
    )


def test_equal_studies_have_not_moved(cells):
    assert moved(cells, cells.copy(deep=True)) == (0.0, "status")


def test_a_number_moves_by_its_share_of_the_largest_of_its_variable(cells):
    other = cells.copy(deep=True)
    other["mse"][1, 1] += 4e-9
    by, name = moved(cells, other)
    assert name == "mse" and by == pytest.approx(1e-9) and by > BOUND


def test_another_label_or_another_gap_is_further_than_any_number(cells):
    for name, place, value in (("status", 0, 1), ("mse", (0, 0), np.nan)):
        other = cells.copy(deep=True)
        other[name][place] = value
        assert moved(cells, other) == (np.inf, name)


def test_the_last_place_of_stored_pressures_may_differ(cells):
    other = cells.copy(deep=True)
    other["pressure"][1] = np.nextafter(np.float32(3.0), np.float32(4.0))
    assert moved(cells, other)[0] == 0.0
    other["pressure"][1] = 3.0001
    assert moved(cells, other)[1] == "pressure"
