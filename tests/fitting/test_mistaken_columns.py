"""A mistake in the columns of a record is named, and a record without one passes."""

import numpy as np
import pytest

from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.errors import InputError
from pneumo.fitting.mistaken_columns import check_columns
from pneumo.fitting.record.measurement import Measurement

MISTAKES = {
    "": lambda m: m,
    "P_A and P_B look swapped": lambda m: m._replace(P=m.P[::-1]),
    "column x seems to have the wrong sign": lambda m: m._replace(x=-m.x),
    "column u seems to have the wrong sign": lambda m: m._replace(u=-m.u),
    "seem to be gauge pressures": lambda m: m._replace(P=m.P - 101325.0),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_a_mistake_is_named_and_none_is_made_up(words, tmp_path):
    rig = purpose_rig()
    c = bench_record(rig, np.random.default_rng(3), 3.0)
    plant, P = believed_plant(rig, tmp_path), np.array([c["P_A"], c["P_B"]])
    record = MISTAKES[words](Measurement("m.csv", 1e-3, c["u"], c["x"], P))
    if not words:
        return check_columns(record, plant)
    with pytest.raises(InputError, match=rf"^m\.csv: .*{words}.*--trust skips this check$"):
        check_columns(record, plant)
