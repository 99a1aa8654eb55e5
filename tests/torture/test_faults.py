# pyright: standard
"""Faults on the smoke study, and how studies are compared; `make torture`, `make determinism` do it all."""

import json
import random
import signal
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pneumo.storage.files import read, write, write_text
from tests.torture.compare import compared_files, differences
from tests.torture.faults import FAULTS, Bench
from tests.torture.study import stop

in_smoke_study = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


class TestFaults:
    pytestmark = in_smoke_study

    def test_a_spoilt_file_is_refused_by_name_and_made_again(self, smoke_study):
        hashes, size = smoke_study.hashes(), smoke_study.size()
        bench = Bench(smoke_study, hashes, 0.0, size, random.Random(1), kills=0, tries=1)
        same, outcome = next(FAULTS["damage"](bench))
        assert same, outcome

    def test_two_kills_then_one_job_at_a_time_give_the_same_bytes(self, smoke_study):
        expected = smoke_study.hashes()
        smoke_study.clear()
        for with_jobs in (True, False):  # left to themselves, jobs go on writing for a while
            run, count = smoke_study.start(), len(compared_files(smoke_study.results))
            while len(compared_files(smoke_study.results)) == count and run.poll() is None:
                time.sleep(0.1)
            assert stop(run, signal.SIGKILL, with_jobs=with_jobs, after=0)
        assert smoke_study.hashes() != expected
        done = smoke_study.run("-j1")
        assert done.code == 0, done.output
        assert smoke_study.hashes() == expected


@pytest.fixture
def two_studies(tmp_path) -> list[Path]:
    """Results of two equal studies."""
    status, pressure = np.array([0, 1], np.int8), np.array([1.0, 3.0], np.float32)
    values = {"mse": (("n", "t"), [[1.0, -4.0], [np.nan, 2.0]]), "pressure": ("t", pressure)}
    dataset = xr.Dataset(values | {"status": ("n", status)}, {"n": [1.0, 1.4]}, {"title": "A"})
    for name in ("one", "other"):
        write(dataset, tmp_path / name / "cells.nc", {"config_sha256": name})
        write_text(json.dumps({"items": [1.5, {"config_sha256": name}]}), tmp_path / name / "verdict.json")
        write_text(f"hash {name[0] * 64}".replace("o", "a"), tmp_path / name / "page.html")
    return [tmp_path / "one", tmp_path / "other"]


def test_studies_that_differ_in_hashes_only_are_equal_and_an_absent_file_is_found(two_studies):
    assert list(differences(*two_studies)) == []
    (two_studies[1] / "cells.nc").unlink()
    assert list(differences(*two_studies)) == ["cells.nc: only before"]


@pytest.mark.parametrize(
    ("name", "old", "new", "line"),
    [
        ("verdict.json", "1.5", "1.25", "verdict.json: /items/0: differs by 0.17 of its largest value"),
        ("verdict.json", "items", "things", "verdict.json: /items/0: only before"),
        ("page.html", "hash", "hashes", "page.html: bytes: differs"),
    ],
)
def test_other_text_is_found(two_studies, name, old, new, line):
    file = two_studies[1] / name
    file.write_text(file.read_text().replace(old, new))
    assert line in list(differences(*two_studies))


@pytest.mark.parametrize(
    ("name", "place", "value"), [("mse", (1, 1), 2.0 + 4e-9), ("status", 0, 1), ("mse", (0, 0), np.nan)]
)
def test_another_number_is_found(two_studies, name, place, value):
    file = two_studies[1] / "cells.nc"
    dataset = read(file)
    dataset[name][place] = value
    write(dataset, file, {})
    assert [line for line in differences(*two_studies) if line.startswith(f"cells.nc: {name}: differs")]
