"""`fitted.yaml`: what a fit found, in the user's keys and units, read as any configuration."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from checkout import ROOT

from pneumo.catalogue import default_conductance
from pneumo.configuration.parameters import load, study
from pneumo.configuration.priors import uncertainties
from pneumo.fitting.fit_result import Estimate, FitResult, fit_data
from pneumo.fitting.fitted_yaml import fitted_configuration
from pneumo.fitting.record.measurement import Measurement
from pneumo.physics.models import wall_law
from pneumo.physics.valve import chamber_flows
from pneumo.quantities.table import QUANTITIES, REPORTED
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant
from pneumo.statistics.intervals import Interval

SAMPLES = 200
VALUES = {"n": 1.312345678, "k_0": 0.4512345678, "k_xu": 8.9e-7, "V_d_A": 9e-6, "V_d_B": 11e-6}


def found(values=VALUES, model="M8", full=None, also=(), held=(), **open_ends):
    """Result of a fit with these values, within 10 per cent; other ends by name; `full` is put first."""
    P = np.full((2, SAMPLES), 4e5)
    m = Measurement("bench.csv", 1e-3, np.ones(SAMPLES), np.zeros(SAMPLES), P)
    low, high = ({name: factor * value for name, value in values.items()} for factor in (0.9, 1.1))
    low |= open_ends
    one = Estimate(values, low, high, np.full(2, 900.0), np.array([1000.0, 1400.0]), P, held=held)
    worse = Estimate({"n": 1.0}, {}, {}, np.full(2, 9e3), np.full(2, 9e3), P)
    fits = {}
    if full is not None:
        fits["full"] = full._replace(rms=one.rms, held_out=np.full(2, 300.0), pressure=P)
    data = fit_data(m, fits | {model: one, "M2": worse}, (*REPORTED, *also))
    lights = dict.fromkeys(full.values, ("green", "")) if full else {}
    return FitResult(data=data, notes=(), warnings=(), held_out_from=0.12, judgements=lights)


def read(text, tmp_path):
    """Configuration and study of a text, as the commands read them."""
    file = tmp_path / "fitted.yaml"
    file.write_text(text, encoding="utf-8")
    return load(file), study(load(file))


def written(fit, cylinder, plant, *files, T=np.nan, P_s=None):
    bench = Measurement("bench.csv", 1e-3, *np.zeros((2, 9)), np.zeros((2, 9)), T=T, P_s=P_s)
    return fitted_configuration(load(*files), cylinder, plant, fit, "bench.csv", bench)


@pytest.fixture(scope="module")
def mine():
    return configured_plant(study(load(TEMPLATE)), "mine", 1.0)


def test_a_valve_by_its_catalogue_stays_one_and_every_experiment_has_k_0(mine, tmp_path):
    text = written(found(), "mine", mine, TEMPLATE)
    configuration, result = read(text, tmp_path)
    assert result.name == "my-cylinder-fitted" and set(result.experiments) == {"open", "closed"}
    valve, before = (c.cylinders["mine"].valve for c in (configuration, load(TEMPLATE)))
    assert valve == before.model_copy(update={"C_dm3_per_sbar": valve.C_dm3_per_sbar})
    for experiment in result.experiments.values():
        assert experiment.plant.k_0 == pytest.approx(VALUES["k_0"], rel=1e-5)  # six digits are written
        assert experiment.plant.valve.k_xu == pytest.approx(VALUES["k_xu"], rel=1e-5)
        c = experiment.plant.cylinder
        assert (c.V_d_A, c.V_d_B) == pytest.approx((9e-6, 11e-6))
    assert configured_plant(result).k_0 == result.experiments["open"].plant.k_0  # no --cylinder, no --k0
    head = text.partition("name:")[0]
    assert all(line.startswith("# ") for line in head.splitlines())
    C = valve.C_dm3_per_sbar
    assert "bench.csv by M8" in head and "1.22 kPa" in head
    assert "export and linearise: M8 --n 1.31235 --k0 0.451235" in head
    assert f"C = {C:.4g} ({0.9 * C:.4g} to {1.1 * C:.4g})" in head
    assert "k_0 = 0.4512 (0.4061 to 0.4964) W/K" in head and "9 (8.1 to 9.9) cm³" in head


def test_the_paper_s_cylinder_keeps_its_key_and_one_experiment_of_each_kind(tmp_path):
    paper = ROOT / "config/paper.yaml"
    plant = configured_plant(study(load(paper)), "E", 1.0)
    text = written(found(), "E", plant, paper)
    configuration, result = read(text, tmp_path)
    assert list(configuration.cylinders) == ["E"]
    section = configuration.cylinders["E"]
    assert section.valve is None and section.k_x_k_u_m2_per_V == pytest.approx(VALUES["k_xu"])
    # The paper's experiments of a cylinder are two loops at several conductances.
    assert sorted(e.drive.closed_loop for e in result.experiments.values()) == [False, True]
    assert "levels" not in yaml.safe_load(text)


CURVE = {"u_V": [0, 5, 10], "C_dm3_per_sbar": [0, 1.0, 1.5]}
VALVES = {
    **{
        key: {"valve": {key: value, "b": 0.3}} for key, value in {"Q_nN_l_per_min": 350, "S_mm2": 7.5}.items()
    },
    "Cv, b unknown, exhaust": {"valve": {"Cv": 0.38, "b": "unknown", "exhaust_ratio": 0.8, "exhaust_b": 0.3}},
    "curve": {"valve": {"curve": CURVE, "b": 0.3, "exhaust_ratio": 0.8}},
    "curve of the exhaust": {"valve": {"curve": CURVE | {"exhaust_C_dm3_per_sbar": [0, 0.5, 1.4]}, "b": 0.3}},
    "throttles": {"valve": {"C_dm3_per_sbar": 1.5, "b": 0.3}, "throttle_A_dm3_per_sbar": 0.3},
    "two valves": {"valve": {"Cv": 0.38, "b": 0.3}, "valve_B": {"Q_n_l_per_min": 250, "b": 0.3}},
}


@pytest.mark.parametrize("valves", VALVES.values(), ids=VALVES)
def test_flows_of_a_valve_are_those_of_the_fit_however_it_is_given(valves, tmp_path):
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["cylinders"]["mine"] |= valves
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    before = configured_plant(study(load(file)), "mine", 1.0)
    b = 0.3 if "throttle_A_dm3_per_sbar" in valves else 0.35  # on which the series with a throttle depends
    fitted = {"k_xu": 1.2 * before.valve.k_xu, "exhaust": 0.9 * before.valve.exhaust, "b": b}
    text = written(found(VALUES | fitted, also=("exhaust", "b")), "mine", before, file)
    after = configured_plant(read(text, tmp_path)[1])
    assert ("conductances of the curve times 1.2 (1.08 to 1.32)" in text) == ("curve" in valves["valve"])
    with_b = before._replace(gas=before.gas._replace(critical_ratio=b))
    for u in (-10.0, -3.0, 3.0, 10.0):
        for side in (0, 1):
            was, now = (
                chamber_flows(u, 4e5, 293.0, p.valve, p.gas, p.conditions, side) for p in (with_b, after)
            )
            assert now == pytest.approx((1.2 * was[0], 1.2 * 0.9 * was[1]), rel=1e-5)


def test_what_the_record_does_not_determine_stays_and_is_said(mine, tmp_path):
    before = study(load(TEMPLATE)).experiments["open"].plant
    text = written(found(held=("k_0", "V_d_B"), k_0=np.nan, V_d_B=np.nan), "mine", mine, TEMPLATE)
    after = read(text, tmp_path)[1].experiments["open"].plant
    assert after.k_0 == default_conductance(after.cylinder).k_0
    assert after.cylinder == before.cylinder._replace(V_d_A=9e-6)
    assert after.valve.k_xu == pytest.approx(VALUES["k_xu"], rel=1e-5)
    assert "as configured: k_0 = 0.4512 (at most 0.4964) W/K, V_d of B" in text
    # Measured flows know no valve, and M6 no wall.
    text = written(found({k: VALUES[k] for k in ("n", "V_d_A", "V_d_B")}, "M6"), "mine", mine, TEMPLATE)
    after = read(text, tmp_path)[1].experiments["open"].plant
    assert after.valve == before.valve and "k_0 =" not in text
    assert after.k_0 == default_conductance(after.cylinder).k_0


def test_the_rig_is_the_full_order_s_and_the_best_model_s_own_stand_in_a_comment(mine, tmp_path):
    rig = {"k_0": 0.8, "k_xu": 9.5e-7, "V_d_A": 7e-6, "V_d_B": 7e-6, "lag": 2e-3}
    low, high = ({name: factor * value for name, value in rig.items()} for factor in (0.9, 1.1))
    full = Estimate(rig, low | {"lag": np.nan}, high, *[np.zeros(2)] * 3, held=("lag",))
    full = full._replace(values=rig | {"lag": 0.0})
    text = written(replace(found(full=full), wall="k_0"), "mine", mine, TEMPLATE)
    plant = configured_plant(read(text, tmp_path)[1])
    assert plant.wall == wall_law("k_0") != mine.wall
    assert (plant.k_0, plant.cylinder.V_d_A, plant.cylinder.V_d_B) == pytest.approx((0.8, 7e-6, 7e-6))
    assert plant.valve.k_xu == pytest.approx(9.5e-7, rel=1e-5)
    head = text.partition("name:")[0]
    assert "bench.csv by full, which is off by 0.3 kPa" in head and "M8, off by 1.22 kPa" in head
    assert "n = 1.312 (1.181 to 1.444), k_0 = 0.4512 (0.4061 to 0.4964)" in head
    assert "M8 --n 1.31235 --k0 0.451235" in head and "taken so: lag = 0 (at most 2.2) ms" in head
    # A full order that leaves more than noise has no intervals: then the best model's stand.
    text = written(found(full=full._replace(low={}, high={})), "mine", mine, TEMPLATE)
    assert configured_plant(read(text, tmp_path)[1]).k_0 == pytest.approx(VALUES["k_0"], rel=1e-5)
    assert "bench.csv by M8" in text


def test_a_study_of_the_fitted_file_judges_with_what_the_fit_learned(mine, tmp_path):
    narrow = Interval(VALUES["k_xu"], 0.99 * VALUES["k_xu"], 1.01 * VALUES["k_xu"])
    fit = found(k_xu=narrow.low)
    fit.data["high"].loc[{"model": "M8", "parameter": "k_xu"}] = narrow.high
    known = uncertainties(read(written(fit, "mine", mine, TEMPLATE), tmp_path)[0])["mine"]
    assert known.half_width("C") == pytest.approx(-np.log(0.99), rel=1e-3)
    assert known.half_width("k_0") < uncertainties(load(TEMPLATE))["mine"].half_width("k_0")
    assert set(known.measured) == {*fit.models}
    # An open end says nothing: limits remain, those of a dead volume beside a known one too.
    text = written(found(held=("k_0", "V_d_B"), k_0=np.nan, V_d_B=np.nan), "mine", mine, TEMPLATE)
    unknown, before = (uncertainties(c)["mine"] for c in (read(text, tmp_path)[0], load(TEMPLATE)))
    for name in ("k_0", "V_d_B"):
        assert unknown.half_width(name) == pytest.approx(before.half_width(name), rel=1e-3)
    assert unknown.half_width("V_d_A") == pytest.approx(-np.log(0.9), rel=1e-3)
    # A joint covariance counts instead of intervals, but not for what is held.
    joint = {"k_xu": {"k_xu": 1e-4, "V_d_A": 2e-4}, "V_d_A": {"k_xu": 2e-4, "V_d_A": 9e-4}}
    ends = ({name: factor * value for name, value in VALUES.items()} for factor in (0.9, 1.1))
    full = Estimate(
        VALUES, *ends, *np.zeros((3, 2)), held=("k_0",), covariance=joint | {"k_0": {"k_0": 1e-6}}
    )
    known = uncertainties(read(written(found(full=full), "mine", mine, TEMPLATE), tmp_path)[0])["mine"]
    C, V_d_A = (known.names.index(name) for name in ("C", "V_d_A"))
    assert known.covariance[C][V_d_A] == 2e-4 and known.covariance[V_d_A][V_d_A] == 9e-4
    assert known.half_width("k_0") == pytest.approx(before.half_width("k_0"), rel=1e-3)


def test_flows_up_to_the_record_s_largest_command_are_as_well_known_as_the_fit_found(mine, tmp_path):
    values = VALUES | {"linearity": 0.0}
    joint = {"k_xu": {"k_xu": 1e-4, "linearity": 0.0}, "linearity": {"k_xu": 0.0, "linearity": 4e-8}}
    ends = [{name: factor * value for name, value in values.items()} for factor in (0.9, 1.1)]
    ends = [end | {"linearity": limit} for end, limit in zip(ends, (-4e-4, 4e-4), strict=True)]
    full = Estimate(values, *ends, *np.zeros((3, 2)), held=("linearity",), covariance=joint)
    fit = found(full=full, also=("linearity",))
    known = uncertainties(read(written(fit, "mine", mine, TEMPLATE), tmp_path)[0])["mine"]
    assert fit.reached == mine.valve.u_max / 10
    # The linearity of a study is that up to u_max; the logarithm of an opening depends on both.
    for part, of_linearity in ((0.1, 0.0), (0.05, (4 * 0.5) ** 2 * 4e-8)):
        slopes = [float(name == "C") + 4 * (1 - part) * (name == "linearity") for name in known.names]
        assert slopes @ np.array(known.covariance) @ slopes == pytest.approx(1e-4 + of_linearity)


def test_a_coefficient_gives_way_to_k_0_and_a_measured_temperature_is_kept(mine, tmp_path):
    other = tmp_path / "other.yaml"
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["supply"]["P_s_Pa"] = "700000 ± 2 %"
    content["experiments"]["open"] |= {"lambda_0_W_per_m2K": 40.0}
    del content["experiments"]["open"]["k_0_W_per_K"]
    content["run"]["experiments"] = ["open"]
    content["name"] = "a" * 40
    other.write_text(yaml.safe_dump(content))
    assert "700000.0 ± 2.0 %" in written(found(), "mine", mine, other)
    result = read(written(found(), "mine", mine, other, T=301.25, P_s=np.array([6.4e5, 6.6e5])), tmp_path)[1]
    assert list(result.experiments) == ["open"] and len(result.name) == 40
    plant = result.experiments["open"].plant
    assert plant.k_0 == pytest.approx(VALUES["k_0"], rel=1e-5)
    assert plant.conditions.T_amb == plant.conditions.T_in == 301.25 and plant.conditions.P_s == 6.5e5


@pytest.mark.parametrize(
    ("name", "value", "kept"),
    [
        *(("lag", 0.0, False), ("lag", 5e-4, True), ("null", 0.0, False), ("null", -0.2, True)),
        *(("dead_time", 0.0, False), ("dead_time", 0.25e-3, True)),
        ("dead_time", -0.25e-3, False),  # less than a sample of 1 ms
    ],
)
def test_a_valves_parameter_is_written_unless_it_is_zero_or_the_clocks(mine, tmp_path, name, value, kept):
    low, high = (VALUES | {name: value - 1e-4}, VALUES | {name: value + 1e-4})
    held = () if value else (name,)
    full = Estimate(VALUES | {name: value}, low, high, *[np.zeros(2)] * 3, held=held)
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["cylinders"]["mine"]["valve_dynamics"] = {QUANTITIES[name].key.rpartition(".")[2]: 1e-3}
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    for configured in (TEMPLATE, file):
        section = read(written(found(full=full), "mine", mine, configured), tmp_path)[0].cylinders["mine"]
        assert (section.valve_dynamics is not None) == kept
