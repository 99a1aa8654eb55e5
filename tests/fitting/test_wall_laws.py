"""A wall of another law than the full order's: its own k_0 is the estimate, the full order's is replayed."""

import numpy as np
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.measurement_fit import fit_measurement
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.wall_laws import WALL_LAWS, wall_law_notes

pytestmark = pytest.mark.xdist_group("fit doubts")  # its fixture takes seconds
RIG, SECONDS = purpose_rig(), 5.0
BY_AREA = RIG._replace(e_A=1.0, e_PT=0.0)


def fitted(rig, folder):
    columns = bench_record(rig, np.random.default_rng(3), SECONDS)
    P = np.array([columns["P_A"], columns["P_B"]])
    return fit_measurement(
        Measurement("m", 1e-3, columns["u"], columns["x"], P), believed_plant(RIG, folder), []
    )


@pytest.fixture(scope="module")
def by_area(tmp_path_factory):
    return fitted(BY_AREA, tmp_path_factory.mktemp("area"))


def test_the_estimate_is_that_of_the_wall_which_the_record_has(by_area):
    estimate, replayed = by_area.estimates("full")["k_0"], by_area.replayed("full")["k_0"]
    assert estimate.value == pytest.approx(RIG.k_0, rel=0.05)
    assert replayed.value > 1.03 * estimate.value  # below P_0 it conducts as much
    assert (estimate.low, estimate.high) == (replayed.low, replayed.high)
    assert estimate.low < estimate.value < replayed.value < estimate.high
    for name in ("start_A", "start_T_B"):
        assert by_area.estimates("full")[name] == by_area.replayed("full")[name]
    (note,) = [note for note in by_area.notes if "wall" in note]
    assert note.startswith("a wall whose conductance is in proportion to its area fits")
    assert f"k_0 = {replayed.value:.3g} W/K" in note


def test_a_wall_of_the_full_orders_law_has_no_note():
    none, laws = np.zeros(2), dict(zip(WALL_LAWS, (0.9, 0.1), strict=False))
    full = Estimate({"k_0": 0.6}, {}, {}, none, none, none, averaged={"k_0": 0.605}, laws=laws)
    assert list(WALL_LAWS) == ["lambda A_q", "k_0", "lambda_0 A_q"]
    assert wall_law_notes(full) == [] != wall_law_notes(full._replace(averaged={"k_0": 0.59}))
