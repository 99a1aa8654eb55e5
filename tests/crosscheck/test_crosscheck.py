# pyright: standard
"""The same equations in GNU Octave: pressures agree on the same step."""

import numpy as np
import pytest
from brief import in_brief

from paper.study.paper_2006.paper_models import PAPER_MODELS
from tests.crosscheck.octave import EXPERIMENTS, OCTAVE, TOLERANCE, compared, largest, worst

BRIEF = (EXPERIMENTS[0], 0.25)


@pytest.mark.octave
@pytest.mark.skipif(OCTAVE is None, reason="GNU Octave is absent: Debian has it in the package octave")
@pytest.mark.parametrize(("name", "seconds"), in_brief([BRIEF, *((e, 1.0) for e in EXPERIMENTS)], [BRIEF]))
def test_octave_finds_the_same_pressures(name, seconds):
    # Twenty draws of the reference in each second. The whole ten are `make crosscheck`'s.
    comparison = compared(name, seconds)
    assert set(comparison["exact"]) == set(comparison["published"]) == set(PAPER_MODELS)
    assert worst(comparison) < TOLERANCE


def test_a_difference_is_found_and_dated():
    ours = np.full((2, 5), 4.0)
    theirs = ours.copy()
    theirs[1, 3] += 1
    assert largest(theirs - ours, ours, 1e-3) == {"largest_relative_difference": 0.25, "t_s": 0.003}
