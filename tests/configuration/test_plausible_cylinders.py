"""Configurations in wrong units: refused with field and reason."""

import pytest
import yaml

from pneumo.configuration.parameters import Sources
from pneumo.configuration.plausible_cylinders import checked
from pneumo.configuration.schema_parts import merged
from pneumo.errors import ConfigurationError
from pneumo.selection.cylinder_template import TEMPLATE

MINE = yaml.safe_load(TEMPLATE.read_text())
AREA = "k_x_k_u_m2_per_V"


SMALL = {"bore_mm": 2.5, "rod_mm": 1.0, "stroke_mm": 2.5, "coulomb_N": 0.1}
SMALL |= {"valve": {"C_dm3_per_sbar": 0.05}, "closed_loop": {"amplitude_mm": 0.3}}


def sources(**changes):
    """The template's configuration with other values in its cylinder's section."""
    override = {"cylinders": {"mine": changes}}
    return Sources(merged(MINE, override), [("cylinder.yaml", MINE), ("mine.yaml", override)], None)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"load_N": 300.0}, "mine.yaml: cylinders.mine.load_N = 300.0: the piston cannot move back"),
        ({"load_N": 300.0}, "at P_s_Pa = 700000 the air pushes with 247 N, and load"),
        ({"load_N": -400.0}, "the piston cannot move out: at P_s_Pa = 700000 the air pushes with 294 N"),
        ({"load_N": 300.0, "coulomb_N": 310.0}, "coulomb_N = 310.0: the piston cannot move back"),
        ({"coulomb_N": 10_000.0}, "coulomb_N = 10000.0: the piston cannot move"),
        ({"spring_N_per_m": 2000.0}, "spring_N_per_m = 2000.0: the piston cannot move out"),
        ({"mass_kg": 40.0, "incline_deg": 90.0}, "mass_kg = 40.0: the piston cannot move out"),
        ({"bore_mm": 0.025, "rod_mm": 0.01}, "bore_mm = 0.025: below 1 mm; is it in metres?"),
        ({"valve": {"C_dm3_per_sbar": 350.0}}, "; is this a nominal flow in l/min? then Q_n_l_per_min"),
        ({"valve": None, AREA: 7e-5}, f"{AREA} = 7e-05: fully open it moves the piston of 25 mm at"),
        ({"valve": None, AREA: 1e-323}, f"{AREA} = 1e-323: a stroke takes inf s"),
        ({"friction_Ns_per_m": 1e6 - 1, "stroke_mm": 500.0}, "friction_Ns_per_m = 999999.0: a stroke takes"),
        ({"dead_volume_m3": 0.004}, "dead_volume_m3 = 0.004: 50.9 times the 7.85e-05 m³ of a stroke; is"),
        ({"mass_kg": 3000.0}, "mass_kg = 3000.0: the air, 247 N, accelerates it by 0.0823 m/s² at"),
    ],
)
def test_a_cylinder_in_wrong_units_is_one_line_unless_it_is_trusted(changes, words):
    wrong = sources(**changes)
    with pytest.raises(ConfigurationError) as error:
        checked(wrong)
    line = str(error.value)
    assert words in line and "\n" not in line and "accept it with --trust" in line
    assert checked(wrong, trust=True) == wrong.validated()


@pytest.mark.parametrize(
    "changes",
    [
        {"load_N": 200.0},
        {"mass_kg": 20.0, "incline_deg": 90.0},
        SMALL,
        {"valve": {"C_dm3_per_sbar": 10.0}},
        {"dead_volume_m3": 1e-3, "mass_kg": 500.0, "stroke_mm": 160.0},  # a long hose, a carriage on rails
    ],
)
def test_unusual_cylinders_are_taken(changes):
    assert checked(sources(**changes)).cylinders["mine"]


def test_a_supply_in_bar_is_named_once():
    content = merged(MINE, {"supply": {"P_s_Pa": 7, "P_atm_Pa": 1}})
    with pytest.raises(ConfigurationError, match=r"^a: supply\.P_atm_Pa = 1\.0: no atmosphere"):
        checked(Sources(content, [("a", content)], None))
