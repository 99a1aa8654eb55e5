"""Files of a rig: units, bounds, and one clear line for each mistake."""

import pytest

from pneumo.errors import ConfigurationError
from pneumo.fitting.rig.rig_file import OF_B, QUANTITIES, key, read_rig, rig
from pneumo.physics.gases import GASES

TANK = {"volume_L": 16, "orifice_mm": 2.7}
VALVE = {"valve_C_in_dm3_per_sbar": 1, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 6}
CHAMBER = {"bore_mm": 25, "dead_volume_mL": [1, 20]} | VALVE


def test_numbers_are_in_the_unit_of_their_key_and_bounds_are_both():
    read = rig(CHAMBER, "rig.yaml")
    assert read.ends["bore"] == pytest.approx((0.025, 0.025))
    assert read.ends["dead_volume"] == pytest.approx((1e-6, 20e-6))
    assert read.ends["P_s"] == pytest.approx((6e5, 6e5))
    assert read.ends["P_start"] == read.ends["P_surroundings"]
    assert read.ends["n"] == (1.0, 1.4) and not read.has("hose_volume")
    assert rig(CHAMBER | {"valve_opening_delay_ms": [-2, 1]}, "rig.yaml").ends["valve_opening_delay"] == (
        pytest.approx((-2e-3, 1e-3))  # a trigger may come before its edge is recorded
    )


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (TANK | {"volumeL": 3}, "volumeL: unknown key, perhaps volume_L; known keys: gas, sensor, volume_L"),
        (TANK | {"C_d": "wide"}, "C_d = 'wide': must be a number, or a list of two"),
        (TANK | {"C_d": [0.9, 0.7]}, "ascending"),
        (TANK | {"C_d": [0.7, 0.8, 0.9]}, "a list of two"),
        (TANK | {"C_d": True}, "C_d = True"),
        (TANK | {"C_d": float("nan")}, "C_d = nan"),
        (TANK | {"C_d": 11}, "at least 0.001 and at most 10"),
        (
            TANK | {"gas": "neon"},
            "gas = 'neon': must be air or nitrogen or helium or hydrogen or argon or CO2",
        ),
        (TANK | {"bore_mm": 25, "dead_volume_mL": 3}, "volume_L: conflicts with bore_mm; give only one"),
        ({"orifice_mm": 2}, "volume_L: missing; or give bore_mm"),
        (TANK | VALVE, "orifice_mm: conflicts with valve_C_in_dm3_per_sbar"),
        (CHAMBER | {"hose_volume_mL": 3}, "hose_C_dm3_per_sbar: missing"),
        (TANK | {"dead_volume_B_mL": 3}, "dead_volume_B_mL: needs bore_mm, which is missing"),
        (
            {"volume_L": 1, "valve_C_in_dm3_per_sbar": 1},
            "valve_C_out_dm3_per_sbar: missing; valve_C_in_dm3_per_sbar, valve_C_out_dm3_per_sbar, P_s",
        ),
        (CHAMBER | {"hose_b": 0.3}, "hose_b: needs hose_volume_mL, which is missing"),
        (TANK | {"supply_volume_L": 3, "regulator_C_dm3_per_sbar": 1}, "needs valve_C_in_dm3_per_sbar"),
        (CHAMBER | {"silencer_volume_mL": 3}, "silencer_C_dm3_per_sbar: missing"),
        (CHAMBER | {"k_0_B_W_per_K": 3}, "k_0_B_W_per_K: needs dead_volume_B_mL, which is missing"),
    ],
)
def test_a_mistake_is_one_line_that_names_field_value_and_what_is_allowed(content, said):
    with pytest.raises(ConfigurationError) as error:
        rig(content, "rig.yaml")
    assert str(error.value).startswith("rig.yaml: ") and said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_is_read(tmp_path):
    (tmp_path / "rig.yaml").write_text("volume_L: 16\norifice_mm: [2, 3]\n")
    assert read_rig(tmp_path / "rig.yaml").ends["orifice"] == pytest.approx((2e-3, 3e-3))


@pytest.mark.parametrize(
    (
        "gas",
        "kg_per_mol",
        "cp",
    ),  # J/(mol K) at 293 K by the Shomate equations of the WebBook; monatomic 5/2 R
    [
        ("air", 28.9647e-3, 29.10),
        ("nitrogen", 28.0134e-3, 29.12),
        ("helium", 4.002602e-3, 20.786),
        ("hydrogen", 2.01588e-3, 28.82),
        ("argon", 39.948e-3, 20.786),
        ("CO2", 44.0095e-3, 36.89),
    ],
)
def test_a_gas_has_the_constants_of_its_molar_mass_and_heat_capacity(gas, kg_per_mol, cp):
    R, gamma = GASES[gas].R, GASES[gas].gamma
    assert pytest.approx(8.314462618 / kg_per_mol, rel=3e-5) == R
    assert gamma == pytest.approx(cp / (cp - 8.314462618), rel=1e-3)


@pytest.mark.parametrize(
    ("name", "number", "in_SI"),
    [
        ("store_c_J_per_K", 3, 3.0),
        ("store_k_W_per_K", 2, 2.0),
        ("T_lag_s", 4, 4.0),
        ("T_surroundings_K", 300, 300.0),
        ("C_d", 0.6, 0.6),
        ("n", 1.3, 1.3),
        ("P_start_bar", 3, 3e5),
        ("volume_L", 5, 5e-3),
    ],
)
def test_a_number_with_its_unit_is_read_in_SI_units(name, number, in_SI):
    ends = rig(TANK | {name: number}, "rig.yaml").ends
    (quantity,) = (quantity for quantity in QUANTITIES if key(quantity) == name)
    assert ends[quantity] == pytest.approx((in_SI, in_SI), rel=1e-12)


def test_a_rig_is_of_air_and_measured_at_the_valve_unless_it_says_so():
    usual, other = rig(TANK, "rig.yaml"), rig(TANK | {"gas": "nitrogen", "sensor": "chamber"}, "rig.yaml")
    assert (usual.gas, usual.sensor) == (GASES["air"], "valve")
    assert (other.gas, other.sensor) == (GASES["nitrogen"], "chamber")


@pytest.mark.parametrize("name", [name for name in OF_B if name != "dead_volume_B"])
def test_a_quantity_of_the_other_chamber_needs_that_chamber(name):
    needed = key("dead_volume_B")
    number = {key(name): QUANTITIES[name].high}
    with pytest.raises(ConfigurationError, match=f"{key(name)}: needs {needed}, which is missing"):
        rig(CHAMBER | number, "rig.yaml")
