"""The full-order fit finds a rig that shares no code with it, and what is not as assumed is said by name."""

import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bench_rig import U_MAX, bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo import simulate
from pneumo.configuration.parameters import DEAD_FRACTION, load, study
from pneumo.configuration.priors import accuracy
from pneumo.errors import InputError
from pneumo.fitting.estimate import estimate, prediction, split_of
from pneumo.fitting.fit_problem import LIMITS, Prior, Problem
from pneumo.fitting.fit_result import Estimate, equally_good
from pneumo.fitting.fit_warnings import (
    configured_warnings,
    disagreements,
    fit_warnings,
    odd_values,
    parameter_warnings,
    residual_warnings,
    undetermined_notes,
)
from pneumo.fitting.held_out import held_out_warnings
from pneumo.fitting.measurement_fit import fit_measurement
from pneumo.fitting.mistaken_columns import check_columns
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.residuals import residuals
from pneumo.fitting.stage_signals import stage_signals
from pneumo.physics.models import FULL
from pneumo.quantities.table import CHOICES, REPORTED
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant
from pneumo.statistics.intervals import Interval

pytestmark = pytest.mark.xdist_group("fit doubts")  # its fixtures take seconds
RIG = purpose_rig()
SECONDS = 5.0


def measured(rig, seconds=SECONDS):
    c = bench_record(rig, np.random.default_rng(3), seconds)
    P = np.array([c["P_A"], c["P_B"]])
    return Measurement("m", 1e-3, c["u"], c["x"], P)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return believed_plant(RIG._replace(C=1.1 * RIG.C), tmp_path_factory.mktemp("rig"))


@pytest.fixture(scope="module")
def whole(plant):
    return stage_signals(measured(RIG._replace(lag=3e-3, null=0.1)), plant)


@pytest.fixture(scope="module")
def sound(whole, plant):
    problem = Problem(FULL, plant, whole.part(0, split_of(whole)), {})
    return problem, estimate(problem, whole)


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
    assert fit_warnings(problem, found, accuracy()) == []


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
    texts = parameter_warnings(problem, changed, accuracy(), stops_shown=False)
    assert any(said in text for text in texts) if said else texts == []


@pytest.mark.parametrize(("n", "doubted"), [(0.97, True), (0.99, False), (1.41, False), (1.43, True)])
def test_an_n_that_no_gas_has_is_doubted(plant, n, doubted):
    assert bool(odd_values({"n": n}, (), plant, meaning="")) == doubted


@pytest.mark.parametrize(
    ("off", "own", "doubted"),  # of P_s, relative: fitted from configured, and the estimate's deviation
    [
        (0.05, 0.01, True),
        (-0.05, 0.01, True),
        (0.02, 0.001, False),
        (0.05, 0.02, False),
        (0.05, np.nan, False),
    ],
)
def test_what_is_configured_is_doubted_where_the_record_is_sure_that_it_is_not(sound, off, own, doubted):
    problem, found = sound
    P_s = problem.plant.conditions.P_s
    with_prior = replace(problem, priors={"P_s": Prior(P_s, deviation=0.01, weight=1.0)})
    values, low, high = (
        of | {"P_s": P_s * np.exp(off + sign * LIMITS * own if sign else off)}
        for of, sign in ((found.values, 0), (found.low, -1), (found.high, 1))
    )
    texts = configured_warnings(with_prior, found._replace(values=values, low=low, high=high))
    assert len(texts) == doubted and all("--also P_s" in text for text in texts)


SPLIT = 3000  # of 5000 samples


def held_out_texts(problem, record, found):
    """Warnings where the record differs on the part held out, which is predicted again."""
    P, held_out = prediction(FULL, problem.plant, record.part(SPLIT, 5000), found.values)
    pressure = np.concatenate([found.pressure[:, :SPLIT], P], axis=1)
    changed = found._replace(held_out=held_out, pressure=pressure)
    return held_out_warnings(problem, record, changed, accuracy())


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda P: P, ""),
        (lambda P: P + 600.0 * (np.arange(len(P)) > 3900), ""),  # below what a record may show
        (lambda P: P + 9e3 * (np.abs(np.arange(len(P)) - 3950) < 150), "from t = 3.8 to 4.1 s"),
        (lambda P: np.where(np.arange(len(P)) < 4200, P, P[4200]), "from t = 4.2 s on"),  # stops
        (lambda P: np.where(np.arange(len(P)) < SPLIT, P, P - 5e3), "from t = 3 s on"),
    ],
)
def test_a_part_held_out_that_differs_is_named_with_chamber_and_time(sound, whole, changed, said):
    problem, found = sound
    record = whole._replace(P=np.stack([whole.P[0], changed(whole.P[1])]))
    texts = held_out_texts(problem, record, found)
    assert len(texts) == bool(said)
    if said:
        assert "P_B is off by" in texts[0] and "P_A" not in texts[0] and said in texts[0]


def test_a_part_held_out_that_differs_concerns_the_parameters_that_it_moves(sound, whole):
    problem, found = sound
    values = found.values | {"V_d_A": 1.4 * found.values["V_d_A"]}
    P, _ = prediction(FULL, problem.plant, whole.part(SPLIT, 5000), values)
    noise = np.random.default_rng(4).normal(0.0, 1e3, P.shape)
    record = whole._replace(P=np.concatenate([whole.P[:, :SPLIT], P + noise], axis=1))
    (text,) = held_out_texts(problem, record, found)
    assert "V_d_A" in text.parameters and "V_d_B" not in text.parameters


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
    measurement = measured(RIG._replace(exhaust=0.75))
    P = measurement.P + np.array([[8e3], [0.0]])
    measurement = measurement._replace(P=P)
    also = ("exhaust", "offset_A")
    found = fit_measurement(measurement, plant, ["M8"], also=also)
    assert not found.warnings and found.on_bound("M8")
    truth = {"exhaust": 0.75, "offset_A": 8e3, "k_0": RIG.k_0, "V_d_A": RIG.V_A}
    assert_near(truth, found.estimates("full"), 0.6)  # in 3 s, with two causes free
    # M8 has the exhaust and the sensor as they were found, and so only its own error.
    plain = fit_measurement(measurement, plant, ["M8"])
    # Exhaust and offset are fitted in any case, drawn towards what is configured.
    named = any(
        re.search(r"an offset of [5-8][\d.]* kPa of the sensor of P_A", text) for text in plain.warnings
    )
    assert named, plain.warnings
    residual = (found.data["P"] - found.data["pressure"].sel(model="M8")).mean("t")
    assert abs(residual).max() < 8e3 / 2  # Pa: what M8 lacks, but not the offset
    with pytest.raises(InputError, match=r"^--also P_s: m has the supply pressure as a column$"):
        fit_measurement(measurement._replace(P_s=P[0]), plant, ["M8"], also=("P_s",))
    with pytest.raises(InputError, match=f"^--also u: must be one of {', '.join(CHOICES)}$"):
        fit_measurement(measurement, plant, ["M8"], also=("u",))
    with pytest.raises(InputError, match=r"^--also exhaust: needs the command u"):
        fit_measurement(measurement._replace(m=np.zeros_like(P)), plant, ["M8"], also=also)


def test_a_cause_is_looked_for_wherever_noise_does_not_explain_the_residuals(sound, monkeypatch):
    problem, found = sound
    monkeypatch.setattr("pneumo.fitting.fit_warnings.cause_warnings", lambda *_: ["named"])
    values = found.values | {"V_d_A": 1.2 * found.values["V_d_A"]}
    # As if the residuals moved no parameter too far.
    assert fit_warnings(problem, found._replace(values=values, remainder={}), accuracy()) == ["named"]
    assert fit_warnings(problem, found, accuracy()) == []


def test_an_unexplained_residual_is_said_in_kPa(sound, whole):
    problem, found = sound
    values = found.values | {"V_d_A": 3 * found.values["V_d_A"]}
    P, _ = prediction(FULL, problem.plant, whole.part(0, split_of(whole)), values)
    expected = np.sqrt(((P[0] - problem.signals.P[0]) ** 2).mean()) / 1e3
    of_chambers = dict(zip("AB", residuals(problem, problem.inner(values)), strict=True))
    (text,) = residual_warnings("full", of_chambers)
    rms, coloured, noise = (float(size) for size in re.findall(r"([\d.]+) kPa", text))
    assert text.startswith("P_A: full is off by") and noise == pytest.approx(1.0, rel=0.1)
    assert rms == pytest.approx(expected, rel=0.15)  # its first pressure is fitted again
    assert rms == pytest.approx(np.hypot(coloured, noise), rel=0.05)


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


MISTAKES = {
    "": lambda m: m,
    "P_A and P_B look swapped": lambda m: m._replace(P=m.P[::-1]),
    "column x seems to have the wrong sign": lambda m: m._replace(x=-m.x),
    "column u seems to have the wrong sign": lambda m: m._replace(u=-m.u),
    "seem to be gauge pressures": lambda m: m._replace(P=m.P - 101325.0),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_a_mistake_in_the_columns_is_named_and_none_is_made_up(words, tmp_path):
    record, plant = MISTAKES[words](measured(RIG, 3.0)), believed_plant(RIG, tmp_path)
    if not words:
        return check_columns(record, plant)
    with pytest.raises(InputError, match=rf"^m: .*{words}.*--trust skips this check$"):
        check_columns(record, plant)


def test_of_a_long_record_the_beginning_is_fitted(tmp_path, monkeypatch):
    monkeypatch.setattr("pneumo.fitting.estimate.MOST_STEPS", 1500)
    known = dict(accuracy()) | {"x_zero": 2e-3}
    plant = believed_plant(RIG, tmp_path)
    found = fit_measurement(measured(RIG, 4.0), plant, [], known=known)
    cell = found.data["moved_by"].sel(model="full", parameter="V_d_A", quantity="the zero of x")
    assert abs(cell.item()) == pytest.approx(2e-3 * plant.cylinder.A_A, rel=0.2)
    end = found.held_out_from
    assert 0.7 < end <= 1.5
    note = f"a long record: the first {end:.4g} s are fitted, the other {4 - end:.4g} s held out"
    assert note in found.notes
    # The beginning is enough: the rest is followed to the noise of the sensors.
    assert found.data["rms_held_out"].sel(model="full").values.max() < 1.3e3


def test_a_fit_has_the_law_of_the_wall_that_the_record_has(tmp_path):
    fit = fit_measurement(measured(RIG._replace(e_A=1.0, e_PT=0.0), 3.0), believed_plant(RIG, tmp_path), [])
    k_0 = fit.estimates("full")["k_0"]
    assert fit.wall == "lambda_0 A_q" and k_0.value == pytest.approx(RIG.k_0, rel=0.05)
    (note,) = [note for note in fit.notes if "wall" in note]
    assert "a conductance in proportion to its area fits the record best" in note
