"""Files of a rig: units, bounds, and one clear line for each mistake."""

import pytest

from pneumo.errors import ConfigurationError
from pneumo.fitting.rig.rig_file import QUANTITIES, key, read_rig, rig
from pneumo.physics.valve import GASES

TANK = {"volume_L": 16, "orifice_mm": 2.7}
VALVE = {"valve_C_in_dm3_per_sbar": 1, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 6}
CHAMBER = {"bore_mm": 25, "dead_volume_mL": [1, 20]} | VALVE
IN_SI = {
    **{"bore": 0.025, "dead_volume": (1e-6, 20e-6), "P_s": 6e5, "P_start": 101325.0, "n": (1.0, 1.4)},
    **{"store_c": 3.0, "store_k": 2.0, "T_lag": 4.0, "T_surroundings": 300.0, "valve_C_in": 1e-8},
    "valve_opening_delay": (-2e-3, 1e-3),  # a trigger may come before its edge is recorded
}


def test_numbers_are_in_the_unit_of_their_key_and_bounds_are_both(tmp_path):
    more = {"store_c_J_per_K": 3, "store_k_W_per_K": 2, "T_lag_s": 4, "T_surroundings_K": 300}
    read = rig(CHAMBER | more | {"valve_opening_delay_ms": [-2, 1]}, "rig.yaml")
    for name, value in IN_SI.items():
        ends = value if isinstance(value, tuple) else (value, value)
        assert read.ends[name] == pytest.approx(ends, rel=1e-12), name
    assert (read.gas, read.sensor) == (GASES["air"], "valve") and not read.has("hose_volume")
    (tmp_path / "rig.yaml").write_text("volume_L: 16\norifice_mm: [2, 3]\n")
    assert read_rig(tmp_path / "rig.yaml").ends["orifice"] == pytest.approx((2e-3, 3e-3))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (TANK | {"volumeL": 3}, "volumeL: unknown key, perhaps volume_L; known keys: gas, sensor, volume_L"),
        (TANK | {"C_d": "wide"}, "C_d = 'wide': must be a number, or a list of two"),
        (TANK | {"C_d": [0.9, 0.7]}, "ascending"),
        (TANK | {"C_d": [0.7, 0.8, 0.9]}, "a list of two"),
        (TANK | {"C_d": float("nan")}, "C_d = nan"),
        (TANK | {"C_d": 11}, "at least 0.001 and at most 10"),
        (TANK | {"gas": "neon"}, "gas = 'neon': must be air or nitrogen or helium or hydrogen"),
        (TANK | {"bore_mm": 25, "dead_volume_mL": 3}, "volume_L: conflicts with bore_mm; give only one"),
        ({"orifice_mm": 2}, "volume_L: missing; or give bore_mm"),
        (CHAMBER | {"hose_volume_mL": 3}, "hose_volume_mL: needs hose_C_dm3_per_sbar, which is missing"),
        *(
            (CHAMBER | {key(name): QUANTITIES[name].high}, f"{key(name)}: needs {key('dead_volume_B')}")
            for name in QUANTITIES
            if name.endswith("_B") and name != "dead_volume_B"
        ),
    ],
)
def test_a_mistake_is_one_line_that_names_field_value_and_what_is_allowed(content, said):
    with pytest.raises(ConfigurationError) as error:
        rig(content, "rig.yaml")
    assert str(error.value).startswith("rig.yaml: ") and said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("gas", "kg_per_mol", "cp"),  # J/(mol K) at 293 K by the WebBook's Shomate equations; monatomic 5/2 R
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
