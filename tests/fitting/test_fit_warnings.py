"""The full-order fit finds a rig that shares no code with it, and what is not as assumed is said by name."""

import re

import numpy as np
import pytest

from benchmarks.bench_rig import U_MAX, bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo import simulate
from pneumo.configuration.parameters import DEAD_FRACTION, load, study
from pneumo.errors import InputError
from pneumo.fitting.estimate import estimate, split_of
from pneumo.fitting.fit_problem import FULL, Problem
from pneumo.fitting.fit_result import Estimate, equally_good
from pneumo.fitting.fit_warnings import (
    disagreements,
    doubtful,
    fit_warnings,
    odd_values,
    parameter_warnings,
    undetermined_notes,
)
from pneumo.fitting.fitted_parameters import ALSO, REPORTED
from pneumo.fitting.measurement_fit import fit_measurement
from pneumo.fitting.mistaken_columns import check_columns
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.residuals import Residual
from pneumo.fitting.stage_signals import StageSignals, stage_signals
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant
from pneumo.statistics.intervals import Interval

pytestmark = pytest.mark.xdist_group("fit doubts")  # its fixtures take seconds
RIG = purpose_rig()
SECONDS = 5.0


def signals_of(rig, plant):
    c = bench_record(rig, np.random.default_rng(3), SECONDS)
    return stage_signals(1e-3, c["u"], c["x"], np.array([c["P_A"], c["P_B"]]), plant)


def fitted(signals: StageSignals, plant):
    found = estimate(FULL, plant, signals)
    return Problem(FULL, plant, signals.part(0, split_of(signals)), {}), found


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return believed_plant(RIG._replace(C=1.1 * RIG.C), tmp_path_factory.mktemp("rig"))


@pytest.fixture(scope="module")
def sound(plant):
    return fitted(signals_of(RIG._replace(lag=3e-3, null=0.1), plant), plant)


def assert_near(truth, estimates, widest=0.2):
    """Estimates within three half-widths of their 95 % intervals, since some of these miss."""
    for name, value in truth.items():
        half = (estimates[name].high - estimates[name].low) / 2
        assert abs(estimates[name].value - value) < 3 * half, name
        assert half < widest * value, name


def test_full_order_fit_gives_the_rig_back_and_nothing_is_doubted(sound, plant):
    problem, found = sound
    truth = {"k_0": RIG.k_0, "k_xu": plant.valve.k_xu / 1.1, "V_d_A": RIG.V_A, "V_d_B": RIG.V_B}
    ends = found.values, found.low, found.high
    assert_near(truth, {name: Interval(*(end[name] for end in ends)) for name in truth})
    assert found.values["lag"] + found.values["dead_time"] == pytest.approx(3e-3, abs=1e-4)
    assert found.values["null"] == pytest.approx(0.1, abs=0.01)
    assert fit_warnings(problem, found) == []


def test_residuals_that_move_nothing_beyond_the_interval_are_no_doubt():
    split = [Residual(1e3, 500.0, 1e3)] * 2
    assert doubtful(split, {"k_0": 0.2}, {"k_0": 0.1})
    assert not doubtful(split, {"k_0": 0.2}, {"k_0": 0.3})  # a wide interval says it already
    assert doubtful(split, {"k_0": 0.2, "k_xu": 0.05}, {"k_0": 0.3, "k_xu": 0.01})
    assert not doubtful(split, {"k_0": 0.1}, {})
    assert not doubtful(split, {"k_0": 0.2}, {}, least=600.0)


DEFAULT = f"2.5 times the default of {100 * DEAD_FRACTION:g} % of half the stroke, since none is configured"
ODD = [  # fitted values, over the configured dead volume for these; upper ends; what is said
    ({"null": 0.1 * U_MAX}, {}, "null offset is on the bound"),
    ({"V_d_B": 2.5}, {}, DEFAULT),
    ({"V_d_B": 2.5}, {}, "give dead_volume_B_m3 (with hoses)"),
    ({"dead_time": -5e-3}, {"dead_time": -4e-3}, "--command linear"),
    ({"dead_time": -2.5e-4}, {"dead_time": -2e-4}, ""),  # less than a sample
    ({"lag": 0.0}, {}, ""),
]


@pytest.mark.parametrize(("values", "high", "said"), ODD)
def test_bounds_and_unlikely_values_are_doubted(sound, values, high, said):
    problem, found = sound
    V_d = problem.plant.cylinder.V_d_A
    values = {name: V_d * value if name == "V_d_B" else value for name, value in values.items()}
    changed = found._replace(values=found.values | values, high=found.high | high)
    texts = parameter_warnings(problem, changed)
    assert any(said in text for text in texts) if said else texts == []


@pytest.mark.parametrize(("n", "odd"), [(0.9, True), (1.0, False), (1.39, False), (1.5, True)])
def test_n_outside_1_to_gamma_is_doubted(plant, n, odd):
    said = odd_values({"n": n}, (), plant, meaning="no gas does this")
    assert said == ([f"n = {n:.3g} is outside 1 to 1.4: no gas does this"] if odd else [])


def test_vague_intervals_are_noted(sound):
    problem, found = sound
    assert undetermined_notes(found, problem.names[:5]) == []
    wide = found.high | {"k_0": 10 * found.values["k_0"]}
    for ends in ({"low": found.low | {"k_0": np.nan}}, {"high": wide}):
        (text,) = undetermined_notes(found._replace(**ends), ["k_0", "k_xu"])
        assert "closed-chamber test" in text


def test_equally_good_models_that_disagree_are_named():
    def model(k_0, low, high, error):
        blank = dict.fromkeys(REPORTED, np.nan)
        ends = blank | {"k_0": low}, blank | {"k_0": high}
        return Estimate({"k_0": k_0}, *ends, np.ones(2), np.full(2, error), np.zeros((2, 3)))

    fits = {"M8": model(0.2, 0.1, 0.3, 1000.0), "M9": model(0.6, 0.5, 0.7, 1020.0)}
    assert equally_good(fits) == ["M8", "M9"]
    assert len(disagreements(fits)) == 1 and "k_0" in disagreements(fits)[0]
    assert disagreements(fits | {"M9": model(0.6, np.nan, 0.7, 1020.0)}) == []  # an open end
    assert disagreements(fits | {"M9": model(0.6, 0.5, 0.7, 2000.0)}) == []  # not as good


@pytest.mark.slow
def test_what_is_wrong_with_the_bench_can_be_fitted_too(plant):
    c = bench_record(RIG._replace(exhaust=0.75), np.random.default_rng(3), SECONDS)
    P = np.array([c["P_A"] + 8e3, c["P_B"]])
    measurement = Measurement("m", 1e-3, c["u"], c["x"], P)
    also = ("exhaust", "offset_A")
    found = fit_measurement(measurement, plant, ["M8"], also=also)
    assert all("M8: k_0 is on the bound of the search" in text for text in found.warnings)  # of M8 alone
    truth = {"exhaust": 0.75, "offset_A": 8e3, "k_0": RIG.k_0, "V_d_A": RIG.V_A}
    assert_near(truth, found.estimates("full"), 0.6)  # in 3 s, with two causes free
    # M8 has the exhaust and the sensor as they were found, and so only its own error.
    plain = fit_measurement(measurement, plant, ["M8"])
    # The exhaust is fitted in any case; what is left is the sensor.
    named = any(
        re.search(r"an offset of (7\.[89]|8)[\d.]* kPa of the sensor of P_A", text) for text in plain.warnings
    )
    assert named, plain.warnings
    residual = (found.data["P"] - found.data["pressure"].sel(model="M8")).mean("t")
    assert abs(residual).max() < 8e3 / 2  # Pa: what M8 lacks, but not the offset
    with pytest.raises(InputError, match=f"^--also u: must be one of {', '.join(ALSO)}$"):
        fit_measurement(measurement, plant, ["M8"], also=("u",))
    with pytest.raises(InputError, match=r"^--also exhaust: needs the command u"):
        fit_measurement(measurement._replace(m=np.zeros_like(P)), plant, ["M8"], also=also)


@pytest.mark.slow
def test_a_supply_that_sags_is_no_doubt_where_it_was_logged(plant):
    c = bench_record(RIG._replace(weak_supply=0.5), np.random.default_rng(3), SECONDS)
    P = np.array([c["P_A"], c["P_B"]])
    measurement = Measurement("m", 1e-3, c["u"], c["x"], P, P_s=c["P_s"])
    assert np.ptp(c["P_s"]) > 0.05 * RIG.P_s
    found = fit_measurement(measurement, plant, ["M8"])
    assert all("M8: k_0 is on the bound of the search" in text for text in found.warnings)  # of M8 alone
    assert_near({"k_0": RIG.k_0, "V_d_A": RIG.V_A, "V_d_B": RIG.V_B}, found.estimates("full"), np.inf)
    assert "off by" in fit_measurement(measurement._replace(P_s=None), plant, ["M8"]).warnings[0]
    with pytest.raises(InputError, match=r"^--also P_s: m has the supply pressure as a column$"):
        fit_measurement(measurement, plant, ["M8"], also=("P_s",))


@pytest.mark.slow
def test_a_piston_that_waits_at_its_stops_with_an_open_valve_is_no_obstacle():
    template = configured_plant(study(load(TEMPLATE)))
    rig = template._replace(k_0=0.3, valve=template.valve._replace(k_xu=1.1 * template.valve.k_xu))
    rng, fine = np.random.default_rng(6), 10  # steps of 0.1 ms: the full order's own have to follow too
    u = np.repeat(rng.choice([-10.0, -4.0, 4.0, 10.0], 10), 250)
    run = simulate(rig, 1e-3 / fine, command=np.repeat(u, fine))
    x, P = run.x[::fine], np.array([run.P_A, run.P_B])[:, ::fine]
    assert (P[0] > 0.99 * rig.conditions.P_s).mean() > 0.2  # of the time
    noisy = x + rng.normal(0.0, 5e-6, len(x)), P + rng.normal(0.0, 1e3, P.shape)
    measurement = Measurement("steps", 1e-3, run.u[::fine], *noisy)
    check_columns(measurement, template)
    found = fit_measurement(measurement, template, ["M8"])
    own = found.data["estimate"].sel(model="full")
    k_0, k_xu, V_d = (own.sel(parameter=name).item() for name in ("k_0", "k_xu", "V_d_A"))
    # decision 58: what such a record tells of k_0; the valve it tells well.
    assert k_0 == pytest.approx(0.3, rel=0.35)
    assert (k_xu, V_d) == pytest.approx((rig.valve.k_xu, rig.cylinder.V_d_A), rel=0.02)
    assert found.data["rms_held_out"].sel(model="full").values == pytest.approx(1e3, rel=0.1)
    assert not any("not as assumed" in text for text in found.warnings)
