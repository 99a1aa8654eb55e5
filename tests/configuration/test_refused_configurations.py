"""Configurations that are refused, each with one line."""

import copy
import re

import pytest
from bad_input import BASE, PAPER, complaint, error_of

from pneumo.configuration.parameters import load
from pneumo.configuration.schema_parts import merged
from pneumo.errors import ConfigurationError

NAMES = [f"E{j:02d}" for j in range(1, 17)]
SHARE = "a number greater than 0 and less than 1"
STOP = "must lie inside the half-stroke, above {}"
LONG = "must be at most 2e+07 steps of step_s = 1e-06"
AVERAGE = "reserved for Table 7's average; choose another name"
CONDUCTANCE = "catalogue or a number at least 0 and at most 10000; or give lambda_0_W_per_m2K"


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        ("cylinders.D.bore_mm", "20 mm", "'20 mm': must be a number greater than 0 and at most 1000"),
        ("cylinders.E.seed", False, "False: must be a whole number at least 0 and less than 4294967296"),
        ("experiments.E01.k_0_W_per_K", -1, "-1: must be catalogue or a number at least 0 and at most 10000"),
        ("experiments.E01.loop", "half", "'half': must be open or closed"),
        ("experiments.E01.cylinder", "F", "'F': must be one of D, E"),
        ("experiments.E01", "E02", "'E02': must be a section"),
        ("run.experiments", [], "[]: must be all or a list (not empty), each text"),
        ("levels.typical", 0.1, "0.1: must be a list, each a number at least 0 and at most 10000"),
        ("n", [1.4, 1.0], "[1.4, 1.0]: must increase, and 1 follows 1.4"),
        ("n", [], "[]: must be a list (not empty), each a number greater than 0 and at most 3"),
        ("name", "my study", r"'my study': must be text of at most 40 letters, digits, _ and -"),
        ("supply.P_0_per_P_s", "half", f"'half': must be half-bridge or {SHARE}"),
        ("supply.P_s_Pa", 0.9e5, "90000.0: must exceed P_atm_Pa = 100000"),
        ("cylinders.D.settling.stop_mm", -50.0, f"-50.0: {STOP.format(-50)}"),
        ("run.experiments", ["E01", "E99"], f"'E99': no such experiment; there are {', '.join(NAMES)}"),
    ],
)
def test_bad_value(path, value, line):
    assert complaint(path, value) == f"mine.yaml: {path} = {line}"


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        ("n", [1.2, 0], "n.1 = 0: must be a number greater than 0 and at most 3"),
        ("step_s", 1e-6, f"experiments.E01.duration_s = 300.0: {LONG}"),
        ("levels", {"overall": [0.1]}, f"levels.overall = 'overall': {AVERAGE}"),
        # What an override leaves out or takes away is missing from its file.
        ("experiments.X", {"loop": "open"}, "experiments.X.cylinder: missing; must be text"),
        ("experiments.E07.k_0_W_per_K", None, f"experiments.E07.k_0_W_per_K: missing; must be {CONDUCTANCE}"),
        # The value that gets the blame stands in an earlier file; the override moved its limit.
        ("cylinders.D.stroke_mm", 20.0, f"cylinders.D.settling.stop_mm = -15.0: {STOP.format(-10)}"),
    ],
)
def test_the_file_that_made_a_mistake_is_named_whatever_the_place(path, value, line):
    assert complaint(path, value) == f"mine.yaml: {line}"


def test_a_wrong_unit_is_told_before_the_key_missing_for_it_and_a_name_that_is_no_text():
    content = copy.deepcopy(BASE)
    content["cylinders"]["D"]["bore_cm"] = content["cylinders"]["D"].pop("bore_mm")
    line = error_of(content, ("p.yaml", content))
    assert re.match(r"p\.yaml: cylinders\.D\.bore_cm = 20\.0: unknown key, perhaps bore_mm; ", line)
    override = {"experiments": {17: BASE["experiments"]["E01"]}}
    line = error_of(merged(BASE, override), ("mine", override))
    assert line.startswith("mine: experiments.17 = 17: the name must be text")
    assert error_of(BASE | {17: 1}, ("mine", {17: 1})).startswith("mine: 17 = 17: unknown key")


def test_the_last_file_that_sets_a_field_or_makes_a_conflict_is_named(tmp_path):
    low, high = {"supply": {"P_s_Pa": 1.5e5}}, {"supply": {"P_atm_Pa": 2e5}}
    sources = ("base", BASE), ("low", low), ("high", high), ("n", {"n": [1]})
    line = error_of(merged(merged(BASE, low), high), *sources)
    assert line.startswith("high: supply.P_s_Pa = 150000.0: must exceed P_atm_Pa = 200000")
    files = [tmp_path / f"{name}.yaml" for name in ("one", "two", "three")]
    for file, text in zip(files, ("step_s: -1\n", "step_s: -2\n", "name: three\n"), strict=True):
        file.write_text(text)
    with pytest.raises(ConfigurationError) as error:
        load(PAPER, *files)
    assert str(error.value) == f"{files[1]}: step_s = -2: must be a number at least 1e-07 and at most 1"


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ("e01", "differs from E01 by case only"),
        ("\uff25\uff10\uff11", "must be text"),
        ("E01\u200d", "must be text"),
    ],
)
def test_names_that_look_alike_are_refused(other, words):
    assert words in complaint(f"experiments.{other}", BASE["experiments"]["E01"])
