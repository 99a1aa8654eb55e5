"""The same equations in GNU Octave: pressures agree on the same step."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

FILE = Path(__file__).parents[2] / "tests/crosscheck/compare.py"
SPEC = importlib.util.spec_from_file_location("compare", FILE)
compare = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(compare)


@pytest.mark.octave
@pytest.mark.skipif(
    compare.OCTAVE is None, reason="GNU Octave is absent: Debian has it in the package octave"
)
@pytest.mark.parametrize("name", compare.EXPERIMENTS)
def test_octave_finds_the_same_pressures(name):
    # One second: 20 draws of the reference. The whole ten are `make crosscheck`'s.
    comparison = compare.compared(name, 1.0)
    assert set(comparison["exact"]) == set(comparison["published"]) == {f"M{i}" for i in range(1, 11)}
    assert compare.worst(comparison) < compare.TOLERANCE


def test_a_difference_is_found_and_dated():
    ours = np.full((2, 5), 4.0)
    theirs = ours.copy()
    theirs[1, 3] += 1
    assert compare.largest(theirs - ours, ours, 1e-3) == {"largest_relative_difference": 0.25, "t_s": 0.003}


def test_octave_is_told_numbers_of_the_configuration_only():
    config = compare.read_yaml(compare.CONFIG)
    told = {name: compare.numbers(config, name, 1.0) for name in compare.EXPERIMENTS}
    assert (told["E13"]["closed_loop"], told["E14"]["closed_loop"]) == (0, 1)
    assert told["E13"]["amplitude"] == config["cylinders"]["D"]["open_loop"]["amplitude_V"]
    assert all(np.isfinite(float(value)) for numbers in told.values() for value in numbers.values())
