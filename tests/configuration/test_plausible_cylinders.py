"""Configurations in wrong units: refused with field and reason, all bad rows of a table at once."""

import json

import pytest
import yaml

from pneumo.configuration.parameters import Sources, read_sources
from pneumo.configuration.plausible_cylinders import checked, implausible
from pneumo.configuration.schema_parts import merged
from pneumo.errors import BadRowsError, ConfigurationError, as_lines
from pneumo.selection.cylinder_template import TEMPLATE

MINE = yaml.safe_load(TEMPLATE.read_text())
AREA = "k_x_k_u_m2_per_V"


def sources(**changes):
    """The template's configuration with other values in its cylinder's section."""
    override = {"cylinders": {"mine": changes}}
    return Sources(merged(MINE, override), [("cylinder.yaml", MINE), ("mine.yaml", override)], None)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"load_N": 300.0}, "mine.yaml: cylinders.mine.load_N = 300.0: the piston cannot move back"),
        ({"load_N": 785.0}, "hold it; is it a weight? then mass_kg and incline_deg"),
        (
            {"load_N": -300.0},
            "load_N = -300.0: the piston cannot move out: at P_s_Pa = 700000 the air pushes",
        ),
        ({"coulomb_N": 10_000.0}, "coulomb_N = 10000.0: the piston cannot move"),
        ({"mass_kg": 40.0, "incline_deg": 90.0}, "mass_kg = 40.0: the piston cannot move out"),
        ({"mass_kg": 40.0, "incline_deg": -90.0}, "mass_kg = 40.0: the piston cannot move back"),
        ({"bore_mm": 0.025, "rod_mm": 0.01}, "bore_mm = 0.025: below 1 mm; is it in metres?"),
        ({"stroke_mm": 0.16}, "stroke_mm = 0.16: below 1 mm"),
        ({"valve": {"C_dm3_per_sbar": 90.0}}, "valve.C_dm3_per_sbar = 90.0: fully open it moves the piston"),
        (
            {"valve": {"C_dm3_per_sbar": 350.0}},
            "; is this a nominal flow in l/min? then Q_n_l_per_min",
        ),
        (
            {"valve": {"C_dm3_per_sbar": None, "Q_n_l_per_min": 2e4}},
            "mine.yaml: cylinders.mine.valve.Q_n_l_per_min = 20000.0: fully open it moves the piston",
        ),
        ({"valve": None, AREA: 7e-5}, f"{AREA} = 7e-05: fully open it moves the piston of 25 mm at"),
        ({"valve": None, AREA: 7e-13}, f"{AREA} = 7e-13: a stroke takes"),
        ({"valve": None, AREA: 1e-323}, f"{AREA} = 1e-323: a stroke takes inf s"),
        ({"friction_Ns_per_m": 1e6 - 1, "stroke_mm": 500.0}, "friction_Ns_per_m = 999999.0: a stroke takes"),
        ({"dead_volume_m3": 0.004}, "dead_volume_m3 = 0.004: 50.9 times the 7.85e-05 m³ of a stroke; is"),
        ({"dead_volume_B_m3": 0.004}, "dead_volume_B_m3 = 0.004: 50.9 times the"),
        ({"mass_kg": 3000.0}, "mass_kg = 3000.0: the air, 247 N, accelerates it by 0.0823 m/s² at"),
        ({"open_loop": {"amplitude_V": 800.0}}, "open_loop.amplitude_V = 800.0: more than 10 times u_max_V"),
        ({"closed_loop": {"amplitude_mm": 1500.0}}, "closed_loop.amplitude_mm = 1500.0: an amplitude of"),
        (
            {"closed_loop": {"amplitude_mm": None, "variance_m2": 2.25}},
            "closed_loop.variance_m2 = 2.25: an amplitude of 1500 mm exceeds the stroke, 160 mm",
        ),
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
        {
            "bore_mm": 2.5,
            "rod_mm": 1.0,
            "stroke_mm": 2.5,
            "coulomb_N": 0.1,
            "valve": {"C_dm3_per_sbar": 0.05},
            "closed_loop": {"amplitude_mm": 0.3},
        },
        {"valve": {"C_dm3_per_sbar": 10.0}},
        {"dead_volume_m3": 1e-3, "mass_kg": 500.0, "stroke_mm": 160.0},  # a long hose, a carriage on rails
        {"open_loop": {"amplitude_V": 40.0}, "closed_loop": {"amplitude_mm": 100.0}},
    ],
)
def test_unusual_cylinders_are_taken(changes):
    assert checked(sources(**changes)).cylinders["mine"]


def test_signals_are_judged_in_the_loops_that_run():
    wrong = sources(closed_loop={"amplitude_mm": 1500.0}, open_loop={"amplitude_V": 800.0})
    for loop, words in (("open", "amplitude_V"), ("closed", "amplitude_mm")):
        content = wrong.content | {"run": {"experiments": [loop]}}
        (problem,) = implausible(wrong._replace(content=content).validated())
        assert problem.path[-1] == words


def test_a_supply_in_bar_is_named_once():
    content = merged(MINE, {"supply": {"P_s_Pa": 7, "P_atm_Pa": 1}})
    with pytest.raises(ConfigurationError, match=r"^a: supply\.P_atm_Pa = 1\.0: no atmosphere"):
        checked(Sources(content, [("a", content)], None))


@pytest.fixture
def fleet(tmp_path):
    """Write a table of the template's cylinder with so many rows; `bore` and `load` by number of the row."""

    def write(count, bore=lambda row: 25, load=lambda row: 0, **changes):
        section = {key: value for key, value in MINE["cylinders"]["mine"].items() if "loop" not in key}
        section = {k: v for k, v in section.items() if k not in ("valve", "rod_mm")} | {AREA: 7e-7}
        section |= {"open_loop.amplitude_V": 0.8, "open_loop.reverse_at": 0.9}
        rows = [section | {"bore_mm": bore(row), "load_N": load(row)} for row in range(2, count + 2)]
        lines = [",".join(["name", *section])]
        lines += [",".join([f"c{i}", *map(str, row.values())]) for i, row in enumerate(rows)]
        (tmp_path / "fleet.csv").write_text("\n".join(lines))
        slow = {"loop": "open", "k_0_W_per_K": 0.3, "duration_s": 2.0}
        content = MINE | {"cylinders": "fleet.csv", "experiments": {"slow": slow}, "run": {}} | changes
        (tmp_path / "fleet.yaml").write_text(json.dumps(content))
        return read_sources(tmp_path / "fleet.yaml")

    return write


def rows_of(error):
    return [line.partition(": row ")[2].partition(",")[0] for line in str(error.value).splitlines()]


def test_all_bad_rows_are_named_at_once_each_in_a_line(fleet, tmp_path):
    wrong = fleet(6, bore=lambda row: -25 if row in (3, 5) else 25)
    with pytest.raises(BadRowsError) as error:
        checked(wrong, trust=True)
    assert rows_of(error) == ["3", "5"]
    lines = as_lines(error.value).splitlines()
    assert all(line.startswith(f"pneumo: {tmp_path / 'fleet.csv'}: row ") for line in lines)
    assert "column bore_mm = -25: must be a number greater than 0" in lines[0]
