"""Configuration: what paper.yaml says, conversion to SI, and one line for whatever is wrong."""

import json
import math

import numpy as np
import pint
import pytest
from bad_input import BASE, PAPER, complaint, error_of, made, override_of
from hypothesis import given
from hypothesis import strategies as st
from paper_study import STUDY

from paper.study.stored_runs import from_json, to_json
from pneumo import testing as some
from pneumo.configuration.experiment import Excitation
from pneumo.configuration.parameters import Sources, load, plant_of, sonic_conductance, study
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.configuration.priors import accuracy, conversion_notes, default_notes, uncertainties
from pneumo.configuration.schema_parts import merged
from pneumo.errors import ConfigurationError
from pneumo.physics.cylinder import heat_area
from pneumo.physics.valve import Gas, Valve, choked_flow
from pneumo.selection.cylinder_template import TEMPLATE


def test_the_papers_study():
    s = STUDY
    assert list(s.experiments) == [f"E{j:02d}" for j in range(1, 17)]
    assert s.n == (1.0, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4)
    assert s.levels == {"adiabatic": (0.02, 0.1), "typical": (0.1, 0.5), "isothermal": (0.5, 2.5)}
    for j, e in enumerate(s.experiments.values()):  # Table 5's coding
        assert e.plant.k_0 == pytest.approx([0.02, 0.1, 0.5, 2.5][j // 4], rel=1e-3)  # D: lambda_0's digits
        assert e.cylinder == "DDEE"[j % 4]
        assert e.drive.closed_loop == bool(j % 2)
        assert e.h == 0.001
    durations = [e.steps * e.h for e in s.experiments.values()]  # Table 6
    printed = [300, 300, 1800, 1200, 60, 60, 360, 600, 60, 60, 120, 120, 60, 60, 60, 60]
    assert durations == pytest.approx(printed, rel=1e-15)  # a product with 0.001


def test_experiment_in_SI_units():
    e = STUDY.experiments["E14"]
    c = e.plant.cylinder
    # A key in mm is a product with 1e-3, good to an ulp.
    assert (c.bore, c.stroke, c.x_max, e.push.x_stop) == pytest.approx((0.02, 0.1, 0.05, -0.015), rel=3e-16)
    assert c.x_min == -c.x_max
    assert c.A_A == c.A_B == math.pi * c.bore**2 / 4
    assert (c.V_d_A, c.V_d_B, c.M, c.k_f) == (1.571e-6, 1.571e-6, 1.5, 100.0)
    assert e.plant.gas == Gas(287.0, 1.4, 0.0404, 0.5283)
    assert e.plant.valve == Valve(1e-7, 10.0)
    assert e.plant.conditions == (7e5, 1e5, 293.0, 293.0, 0.8077 * 7e5, 293.0)
    assert e.drive.k_p == 1000.0
    assert e.excitation == Excitation(seed=666, amplitude=math.sqrt(0.0003), every=50)
    assert e.push.force == -300.0
    assert (e.steps, e.pressure_stride) == (60_000, 10)
    # The amplitude is that of the loop.
    assert STUDY.experiments["E15"].excitation == Excitation(777, 0.3**0.5, 50)  # V
    assert STUDY.experiments["E16"].excitation == Excitation(777, math.sqrt(0.0021), 50)  # m
    assert STUDY.experiments["E15"].drive.x_reverse == pytest.approx(0.96 * 0.1375, rel=3e-16)


OWN = {
    **{"bore_mm": 25.0, "stroke_mm": 160.0, "mass_kg": 3.0, "friction_Ns_per_m": 60.0, "u_max_V": 5.0},
    **{"valve": {"C_dm3_per_sbar": 1.5, "b": 0.35}, "seed": 1, "sample_time_s": 0.05},
    "open_loop": {"amplitude_V": 0.8, "reverse_at": 0.9},
    "closed_loop": {"amplitude_mm": 15.0, "k_p_V_per_m": 100.0},
}


def on_own_cylinder(experiment=None, **changes):
    """Experiment X on a cylinder of one's own, on top of the paper's gas and supply."""
    x = {"cylinder": "own", "loop": "open", "k_0_W_per_K": 0.3, "duration_s": 2.0} | (experiment or {})
    x = {key: value for key, value in x.items() if value is not None}
    override = {"cylinders": {"own": OWN | changes}, "experiments": {"X": x}, "run": {"experiments": ["X"]}}
    return made(override, ("own.yaml", override)).experiments["X"]


def test_catalogue_valve_passes_the_choked_flow_of_ISO_6358_and_may_leak():
    ureg = pint.get_application_registry()
    e = on_own_cylinder()
    assert e.plant.gas.elliptic and e.plant.gas.critical_ratio == 0.35
    C, P, T = ureg.Quantity(1.5, "dm^3/(s bar)"), ureg.Quantity(7.0, "bar"), ureg.Quantity(310.0, "K")
    wanted = C * ureg.Quantity(1.185, "kg/m^3") * P * (ureg.Quantity(293.15, "K") / T) ** 0.5
    flow = choked_flow(e.plant.valve.k_xu * 5.0, 7e5, 310.0, e.plant.gas)
    assert flow == pytest.approx(wanted.to("kg/s").magnitude, rel=1e-12)
    plain = on_own_cylinder(valve=None, k_x_k_u_m2_per_V=1e-7)
    assert not plain.plant.gas.elliptic and plain.plant.gas.critical_ratio == 0.5283
    # Asymmetry and leak.
    asked = {"C_dm3_per_sbar": 2.0, "b": 0.3, "exhaust_ratio": 1.3, "leak_dm3_per_sbar": 0.02}
    valve = on_own_cylinder(valve=asked).plant.valve
    assert valve.exhaust == 1.3
    assert valve.leak == pytest.approx(0.01 * valve.k_xu * valve.u_max, rel=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "C", "within"),
    [
        ("C_m3_per_sPa", 1.5e-8, 1.5, 0.0),
        ("C_l_per_minbar", 90.0, 1.5, 0.0),
        ("S_mm2", 7.5, 1.5, 0.05),
        ("Q_n_l_per_min", 381.4, 1.5, 0.0),
        ("Q_nN_l_per_min", 350.7, 1.5, 0.0),  # 381.4 over 1.0875
        # NFPA's formula in its own units: 22.48 sqrt(14.504 psi * 87.02 psia / 528 degR) = 34.76 scfm.
        ("Cv", 0.4, 0.4 * 34.76 * 28.317 * 1.01325 / 254.27, 0.15),
        ("Kv_m3_per_h", 0.35, 0.35 / 0.865 * 34.76 * 28.317 * 1.01325 / 254.27, 0.15),
    ],
)
def test_figures_of_catalogues_give_the_conductance_with_its_accuracy(key, value, C, within):
    section = {"valve": {key: value, "b": 0.3}}
    plant = on_own_cylinder(**section).plant
    assert sonic_conductance(plant.valve, plant.gas) == pytest.approx(C, rel=2e-3)
    configuration = Sources(merged(BASE, {"cylinders": {"own": OWN | section}})).validated()
    rule = np.log1p(np.hypot(within, 0.1))  # to which b adds up to 0.07 where the figure is a nominal flow
    assert rule * (1 - 1e-9) <= uncertainties(configuration)["own"].half_width("C") < np.hypot(rule, 0.07)
    (note,) = conversion_notes(configuration)
    assert note.startswith(f"own: {key} = {value:g} is C = ")
    section["valve"].pop("b")  # 0.3 then
    configuration = Sources(merged(BASE, {"cylinders": {"own": OWN | section}})).validated()
    assert configuration.cylinders["own"].valve.largest_C == pytest.approx(C, rel=2e-3)
    assert uncertainties(configuration)["own"].half_width("b") == pytest.approx(0.15)
    assert "0.3 assumed" in conversion_notes(configuration)[1]


@pytest.mark.parametrize(
    ("gas", "ratio"),
    [("helium", 2.54), ("hydrogen", 3.79), ("CO2", 0.83), ("nitrogen", 1.017), ("argon", 0.80)],
)
def test_a_valve_keeps_its_area_with_another_gas(gas, ratio):
    def flow(of):
        p = plant_of(Sources(merged(read_yaml(TEMPLATE), {"gas": of})).validated(), "open")
        return choked_flow(p.valve.k_xu * p.valve.u_max, 7e5, 293.15, p.gas)

    assert flow("air") / flow(gas) == pytest.approx(ratio, rel=0.01)
    assert flow({"sonic_coefficient": 0.0404}) == pytest.approx(1.185 * 1.5e-8 * 7e5, rel=1e-9)  # the paper's


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("supply.T_amb_K", 20, "and at most 500; is it in degC?"),
        ("supply.P_s_Pa", 6, "; is it in bar?"),
        ("supply.T_in_K", "25,0", "; decimal point, not comma"),
        ("cylinders.D.bore_mm", 0.025, "must exceed rod_mm = 10; is it in metres?"),
    ],
)
def test_a_message_names_the_likely_cause(path, value, words):
    with_rod = merged(BASE, {"cylinders": {"D": {"rod_mm": 10.0}}})
    override = override_of(path, value)
    assert words in error_of(merged(with_rod, override), ("mine.yaml", override))
    assert "is it" not in error_of(merged(BASE, override_of("supply.T_amb_K", 600)))


def test_rod_weight_and_load():
    flat = on_own_cylinder().plant.cylinder
    assert (flat.load, flat.coulomb) == (0.0, 0.0) and flat.A_A == flat.A_B
    assert flat.V_d_A == flat.V_d_B == pytest.approx(0.1 * flat.A_A * 0.08)
    changes = {"rod_mm": 10.0, "incline_deg": 30.0, "load_N": 7.0, "coulomb_N": 4.0, "dead_volume_m3": 5e-6}
    c = on_own_cylinder(**changes).plant.cylinder
    rod = math.pi * 0.01**2 / 4
    assert pytest.approx(rod) == c.A_A - c.A_B
    assert c.load == pytest.approx(7.0 - 3.0 * 9.80665 / 2 - rod * 1e5)  # half the weight, along the axis
    assert (c.coulomb, c.V_d_A, c.V_d_B) == (4.0, 5e-6, 5e-6)
    c = on_own_cylinder(dead_volume_B_m3=7e-6).plant.cylinder  # a longer hose
    assert c.V_d_B == 7e-6 and c.V_d_A == flat.V_d_A


def test_an_override_of_a_key_replaces_its_alternative(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("experiments: {E01: {k_0_W_per_K: 0.3}, E03: {lambda_0_W_per_m2K: 40}}\n")
    experiments = study(load(PAPER, mine)).experiments
    assert experiments["E01"].plant.k_0 == 0.3
    assert experiments["E03"].plant.k_0 == pytest.approx(
        40 * heat_area(0.0, experiments["E03"].plant.cylinder)
    )
    mine.write_text("cylinders: {D: {valve: {C_dm3_per_sbar: 1.5, b: 0.3}}}\n")
    other = tmp_path / "other.yaml"
    other.write_text("cylinders: {D: {valve: {Q_n_l_per_min: 100}}}\n")
    valve = load(PAPER, mine, other).cylinders["D"].valve
    assert valve.flow_as_given == ("Q_n_l_per_min", 100.0) and valve.b == 0.3


def test_signals():
    assert on_own_cylinder().excitation == Excitation(1, 0.8, 50)
    assert on_own_cylinder({"loop": "closed"}).excitation == Excitation(1, 15e-3, 50)
    sweep = on_own_cylinder({"signal": {"kind": "sweep", "from_Hz": 0.5, "to_Hz": 5.0}}).excitation
    assert (sweep.signal, sweep.band) == ("sweep", pytest.approx((0.5e-3, 5e-3))) and not sweep.random
    steps = on_own_cylinder({"signal": {"kind": "steps", "levels": [1, -1], "hold_s": 0.25}}).excitation
    assert (steps.signal, steps.levels, steps.every) == ("levels", (1.0, -1.0), 250) and not steps.random
    assert on_own_cylinder({"signal": {"kind": "gaussian"}}).excitation == Excitation(1, 0.8, 50, "gaussian")


def test_a_file_as_signal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "mine.csv"
    file.write_text("t,u\n0,0.5\n0.1,-1.5\n")
    x = {"signal": {"kind": "csv", "file": "mine.csv", "column": "u", "hold_s": 0.1}}
    excitation = on_own_cylinder(x).excitation
    assert (excitation.amplitude, excitation.levels, excitation.every) == (1.0, (0.5, -1.5), 100)

    override = {"experiments": {"E01": x}}
    before = made(override).config_sha256
    file.write_text("t,u\n0,0.5\n0.1,-1.4\n")
    assert made(override).config_sha256 != before


TWO_FLOWS = {"C_dm3_per_sbar": 1, "Q_n_l_per_min": 250, "b": 0.3}
THROTTLE = {"throttle_B_dm3_per_sbar": 0.3}
TWICE = {"k_p_V_per_m": 1, "variance_m2": 1e-4, "amplitude_mm": 10.0}
ABSENT = {"kind": "csv", "file": "nowhere.csv", "column": "u", "hold_s": 1}


@pytest.mark.parametrize(
    ("experiment", "changes", "line"),
    [
        ({}, {"rod_mm": 25.0}, "own.bore_mm = 25.0: must exceed rod_mm = 25"),
        ({}, {"rod_A_mm": 25.0}, "own.bore_mm = 25.0: must exceed rod_A_mm = 25"),
        ({}, {"spring_preload_N": 5.0}, "own.spring_N_per_m: missing; must be a number greater than 0"),
        ({}, {"valve": None, "k_x_k_u_m2_per_V": 1e-7} | THROTTLE, "own.valve: missing; "),
        ({}, {"throttle_A_dm3_per_sbar": 0.0}, "throttle_A_dm3_per_sbar = 0.0: must be a number greater"),
        ({}, {"k_x_k_u_m2_per_V": 1e-7}, "own.k_x_k_u_m2_per_V = 1e-07: conflicts with valve"),
        ({}, {"valve": None}, "k_x_k_u_m2_per_V: missing; must be a number greater than 0 and at most 0.01;"),
        ({}, {"valve": {"b": 0.3}}, "and at most 1000; or give Q_n_l_per_min, Q_nN_l_per_min, C_m3"),
        ({}, {"valve": TWO_FLOWS}, "own.valve.C_dm3_per_sbar = 1.0: conflicts with Q_n_l_per_min; give"),
        ({}, {"open_loop": None}, "experiments.X.loop = 'open': needs the section cylinders.own.open_loop"),
        ({}, {"closed_loop": {"k_p_V_per_m": 1}}, "own.closed_loop.amplitude_mm: missing; must be a number"),
        ({}, {"closed_loop": TWICE}, "own.closed_loop.amplitude_mm = 10.0: conflicts with variance_m2"),
        ({"k_0_W_per_K": None}, {}, "X.k_0_W_per_K: missing; must be catalogue or a number"),
        ({"lambda_0_W_per_m2K": 40.0}, {}, "X.k_0_W_per_K = 0.3: conflicts with lambda_0_W_per_m2K"),
        ({"signal": {"kind": "sweep", "from_Hz": 1}}, {}, "X.signal.to_Hz: missing; must be a number"),
        ({"signal": {"kind": "prbs", "hold_s": 1}}, {}, "X.signal.hold_s = 1.0: not allowed with kind: prbs"),
        ({"signal": ABSENT}, {}, "experiments.X.signal.file = 'nowhere.csv': cannot be read"),
    ],
)
def test_cylinders_that_cannot_be(experiment, changes, line):
    with pytest.raises(ConfigurationError) as error:
        on_own_cylinder(experiment, **changes)
    assert line in str(error.value) and "\n" not in str(error.value)
    assert str(error.value).startswith(("own.yaml: ", "experiments.X.signal"))


def test_an_override_changes_what_it_names_and_the_hash():
    ours, theirs = made({"supply": {"T_in_K": 293.5}}), STUDY
    assert study(load(PAPER)).config_sha256 == theirs.config_sha256 != ours.config_sha256
    changed = [e.plant.conditions._replace(T_in=293.0) for e in ours.experiments.values()]
    assert changed == [e.plant.conditions for e in theirs.experiments.values()]


@given(
    st.floats(5e-3, 0.2),
    st.floats(0.1, 100.0),
    some.temperatures(),
    st.lists(some.polytropic_indices(), min_size=1, max_size=20, unique=True).map(sorted),
)
def test_json_round_trip_is_exact(bore, mass, T_in, n):
    override = {"cylinders": {"D": {"bore_mm": bore * 1e3, "mass_kg": mass}}, "supply": {"T_in_K": T_in}}
    s = made(override | {"n": n, "run": {"experiments": ["E01", "E02", "E16"]}})
    again = from_json(to_json(s))
    assert again == s
    assert type(again.experiments["E01"].plant.cylinder) is type(s.experiments["E01"].plant.cylinder)
    assert to_json(again) == to_json(s)
    json.loads(to_json(s), parse_constant=pytest.fail)  # no NaN or Infinity: any JSON reader takes it


def test_an_uncertainty_is_in_the_hash_and_survives_writing(tmp_path):
    override = tmp_path / "mine.yaml"
    override.write_text(
        "cylinders: {mine: {valve: {b: 0.3 ± 0.05}, stroke_mm: 160 +- 0.2}}\n", encoding="utf-8"
    )
    before, after = (load(TEMPLATE, *files) for files in ((), (override,)))
    assert study(before).config_sha256 != study(after).config_sha256
    plants = [study(c).experiments["open"].plant for c in (before, after)]
    assert plants[0] == plants[1]
    again = Sources(after.model_dump(exclude_unset=True)).validated()
    assert again.model_dump() == after.model_dump() and accuracy(again) == accuracy(after)
    assert (accuracy(again)["b"], accuracy(again)["stroke"]) == pytest.approx((0.05, 2e-4))


def test_a_default_that_nobody_stated_is_known_less_well_where_the_record_does_not_show_it(tmp_path):
    stated = tmp_path / "stated.yaml"
    stated.write_text("supply: {P_atm_Pa: 101325 ± 200, T_amb_K: 293.15, T_in_K: 294}", encoding="utf-8")
    unmeasured = "P_atm", "T_amb", "T_in"
    template, mine = (accuracy(load(TEMPLATE, *files), unmeasured=unmeasured) for files in ((), (stated,)))
    assert [template[name] for name in unmeasured] == [0.26, 10.0, 10.0]  # 75 kPa at the least
    assert [mine[name] for name in unmeasured] == pytest.approx([200 / 101325, 10.0, 3.0])
    assert accuracy(load(TEMPLATE)) == accuracy()  # the record has them
    (note,) = default_notes(load(TEMPLATE, stated), unmeasured)
    assert "T_amb = 293.15 ± 10 K; state supply.T_amb_K with ±" in note and "P_atm" not in note


def test_each_stated_uncertainty_is_in_the_unit_that_a_fit_takes(tmp_path):
    """Pressures, the bore and the exhaust as fractions, the others in SI units."""
    stated = tmp_path / "stated.yaml"
    stated.write_text(
        """
        cylinders:
          mine:
            bore_mm: 40 ± 0.1
            stroke_mm: 160 ± 1 %
            valve: {b: 0.3 ± 10 %, exhaust_ratio: 1.2 ± 0.06, linearity_percent: 4}
        supply: {P_s_Pa: 7e5 ± 1.4e4, P_atm_Pa: 100000 ± 3 %, T_amb_K: 293 ± 2, T_in_K: 300 ± 1 %}
        sensors: {x_zero_mm: 2, x_scale_percent: 0.5, P_gain_percent: 0.3, P_offset_kPa: 4}
        """,
        encoding="utf-8",
    )
    found = accuracy(load(TEMPLATE, stated))
    assert found == pytest.approx(
        {"b": 0.03, "exhaust": 0.05, "P_s": 0.02, "bore": 0.0025, "stroke": 1.6e-3, "x_zero": 2e-3}
        | {"x_scale": 5e-3, "T_amb": 2.0, "T_in": 3.0, "P_atm": 0.03}
        | {f"P_gain_{of}": 3e-3 for of in "ABs"}
        | {"V_d_A": 0.2, "V_d_B": 0.2, "offset_A": 4e3, "offset_B": 4e3, "linearity": 0.04}
    )


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ("accuracy: {b: 0.1}", "accuracy = {'b': 0.1}: unknown key"),
        ("cylinders: {mine: {mass_kg: 3 ± 1}}", "mass_kg = '3 ± 1': must be a number"),
        ("cylinders: {mine: {bore_mm: 25 ± -1}}", "'25 ± -1': the uncertainty must be 0 to 10000 %"),
        (
            "cylinders: {mine: {load_N: 0}}\nexperiments: {open: {k_0_W_per_K: 0 ± 1}}",
            "0 cannot have an uncertainty",
        ),
        (
            "cylinders: {mine: {valve_B: {C_dm3_per_sbar: 1 ± 9 %}}}",
            "cannot have an uncertainty; that of the",
        ),
        ("cylinders: {mine: {bore_mm: 2500 ± 1}}", "bore_mm = 2500.0: must be a number greater than 0"),
    ],
)
def test_an_uncertainty_that_cannot_be_is_refused(tmp_path, override, line):
    file = tmp_path / "mine.yaml"
    file.write_text(override, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"mine\.yaml") as error:
        load(TEMPLATE, file)
    assert line in str(error.value)


TEXTS = ["1:30", "2_5", "0x10", "yes", "on", "2026-01-01", "\u0663\u0664"]
NUMBERS = {"010": 10, "1e-7": 1e-7, ".5": 0.5, "1.": 1.0, "-3": -3}
WORDS = {"true": True, "~": None, "": None, "'010'": "010"}


@pytest.mark.parametrize(("text", "value"), [*zip(TEXTS, TEXTS, strict=True), *(NUMBERS | WORDS).items()])
def test_words_and_numbers_are_those_of_yaml_1_2(tmp_path, text, value):
    (tmp_path / "a.yaml").write_text(f"key: {text}\n", encoding="utf-8")
    parsed = read_yaml(tmp_path / "a.yaml")["key"]
    assert parsed == value and type(parsed) is type(value)
    if text in TEXTS:  # which Python's float and int would take in part
        assert f"cylinders.D.mass_kg = {text!r}: must be a number" in complaint("cylinders.D.mass_kg", text)
