"""Records of one rig fitted together: one set of parameters, each record from its own start."""

import json

import numpy as np
import pandas as pd
import pytest

import pneumo
from benchmarks.bench_rig import bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.errors import InputError
from pneumo.fitting.fit_problem import Problem, replayed_pressures
from pneumo.fitting.record.joined_records import joined
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import stage_signals
from pneumo.physics.models import FULL, MODELS
from pneumo.quantities.table import MOST_RECORDS, STARTS_OF_ONE, start_name

pytestmark = pytest.mark.xdist_group("fit doubts")
RIG = purpose_rig()._replace(lag=4e-3)
VALVE = {"lag": 4e-3, "dead_time": 1e-3, "null": 0.1}


def columns_of(seed, seconds):
    return bench_record(RIG, np.random.default_rng(seed), seconds)


def measured(seed, seconds=1.0, name="", **changes):
    c = columns_of(seed, seconds)
    P = np.array([c["P_A"], c["P_B"]])
    return Measurement(name or f"{seed}.csv", 1e-3, c["u"], c["x"], P)._replace(**changes)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return believed_plant(RIG, tmp_path_factory.mktemp("rig"))


def test_the_first_part_of_each_comes_first_and_one_cut_parts_them_all():
    a, b, c = measured(1), measured(2, 0.5), measured(3, 2.0)
    together, part = joined([a, b, c], 0.6, 10**6)
    assert together.begins == (0, 601, 902, 2903, 3304)  # of a, b, all of c, the rest of a, of b
    split = round(part * (len(together.u) - 1))
    assert split == 902 + 1200
    ends = [601, 902, 2903, 3304, 3505]
    of = [(a, 0), (b, 0), (c, 0), (a, 600), (b, 300)]
    for (record, first), begin, end in zip(of, together.begins, ends, strict=True):
        last = first + end - begin
        np.testing.assert_array_equal(together.P[:, begin:end], record.P[:, first:last])
        np.testing.assert_array_equal(together.u[begin:end], record.u[first:last])
    assert together.name == "1.csv, 2.csv, 3.csv" and "fitted together" in together.notes[-1]
    assert joined([a], 0.6, 10**6) == (a, 0.6)
    some = [a._replace(T=290.0), a, a._replace(T=300.0)]
    assert joined(some, 0.6, 10**6)[0].T == 295.0
    assert joined([a, c], 0.6, 800)[0].begins == (0, 401, 2402)  # of each half of what may be fitted


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"period": 2e-3}, r"b.csv: period 2 ms, of a.csv 1 ms: must be the same"),
        ({"P_s": np.zeros(201)}, "b.csv: column P_s: must be in all records or in none"),
        ({"m": np.zeros((2, 201))}, "b.csv: column m_A: must be in all records or in none"),
        ({"closed": True}, "b.csv: is a record of closed chambers"),
    ],
)
def test_records_that_cannot_be_fitted_together_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        joined([measured(1, 0.2, "a.csv"), measured(2, 0.2, "b.csv", **changes)], 0.6, 1000)
    with pytest.raises(InputError, match="9 records: must be at most 8"):
        joined([measured(1, 0.2)] * (MOST_RECORDS + 1), 0.6, 1000)


@pytest.mark.parametrize("model", [FULL, MODELS["M8"]])
def test_each_record_is_replayed_from_its_own_start_as_if_alone(model, plant):
    records = [measured(1), measured(2, 0.5)]
    together, part = joined(records, 0.5, 10**6)
    signals = stage_signals(together, plant)
    split = round(part * (len(together.u) - 1))
    both = Problem(model, plant, signals.part(0, split), {})
    assert {"start_2_A", "start_2_B"} < {*both.names} and "start_3_A" not in both.names
    values = both.values(both.guess()) | {
        "start_A": 4e5,
        "start_2_A": 5e5,
        "start_T_A": 280.0,
        "start_T_2_B": 310.0,
    }
    values |= VALVE if model is FULL else {}
    P = replayed_pressures(both, both.inner(values)[None])[0]
    assert P.shape == both.signals.P.shape
    for i, (first, last) in enumerate(both.signals.pieces):
        # The motion of one record does not depend on the other; the smoothing is that of both.
        alone = Problem(model, plant, both.signals.part(first, last), {})
        assert alone.signals.begins == (0,) and "start_2_A" not in alone.names
        own = values | {name: values.get(start_name(name, i), np.nan) for name in STARTS_OF_ONE}
        expected = replayed_pressures(alone, alone.inner(own)[None])[0]
        np.testing.assert_array_equal(P[:, first : last + 1], expected)
    x = both.signals.motion[:: both.signals.stride, 0, 0]
    np.testing.assert_allclose(x, together.x[:split], atol=2e-4)  # 2e-5 m of noise, smoothed; no leap


@pytest.mark.slow
def test_the_command_finds_more_in_two_and_judges_on_a_third(inside, tmp_path):
    believed_plant(RIG, tmp_path)
    units = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_Pa", "P_B": "P_B_Pa"}
    for i in range(3):
        c = columns_of(3 + i, 3.0)
        pd.DataFrame({key: c[name] for name, key in units.items()}).to_csv(tmp_path / f"{i}.csv", index=False)
    asked = ["--validate", "2.csv", "--config", "cylinder.yaml", "--model", "M1", "--json"]

    def width(*words):
        code, out, told = inside("fit", *words, *asked)
        assert code == 0, told
        found = json.loads(out)
        k_0 = found["models"]["full"]["parameters"]["k_0"]
        assert k_0["low"] < RIG.k_0 < k_0["high"]
        return np.log(k_0["high"] / k_0["low"]), found["rms_validated"]["full"], told

    one, *_ = width("0.csv")
    two, errors, told = width("0.csv", "1.csv", "-o", "two")
    assert two < 0.9 * one and "0.csv, 1.csv: fitted together" in told
    assert errors == pytest.approx([1e3, 1e3], rel=0.2)  # the sensors' noise
    text = (tmp_path / "two/fitted.yaml").read_text(encoding="utf-8")
    assert text.startswith("# Cylinder mine as fitted to 0.csv, 1.csv by full")


@pytest.mark.slow
def test_no_record_is_left_out_where_a_replay_takes_several_steps_a_sample(tmp_path, monkeypatch):
    believed_plant(RIG, tmp_path)
    for room in ("notebook.record_fit", "fitting.estimate"):
        monkeypatch.setattr(f"pneumo.{room}.MOST_STEPS", 600)
    units = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_Pa", "P_B": "P_B_Pa"}
    columns = [columns_of(seed, 1.0) for seed in (3, 4)]
    records = [pd.DataFrame({key: one[name][::2] for name, key in units.items()}) for one in columns]
    fit = pneumo.fit(records, tmp_path / "cylinder.yaml", models=["M1"])
    second = fit.measurement.begins[1] * fit.measurement.period
    assert fit.result.held_out_from > 1.9 * second
