"""What known mistakes lose and win, and the items that none of them loses."""

import numpy as np
import xarray as xr

from pneumo.verdict.claims import BASES
from pneumo.verdict.power import NO_MISTAKE, losing_mistakes, mistakes_table

AGREES = xr.DataArray(
    np.array([[1, 1, 1, 0], [0, 1, 0, 1], [1, 1, 1, 0]], dtype=bool),
    {"mistake": [NO_MISTAKE, "one", "two"], "item": ["a", "b", "c", "d"]},
)


def test_mistakes_that_lose_an_item():
    assert losing_mistakes(AGREES) == {"a": ["one"], "b": [], "c": ["one"]}


def test_lost_won_and_net():
    nothing = dict.fromkeys(BASES, 0)
    assert mistakes_table(AGREES, dict.fromkeys("abcd", "fitted")) == [
        {"mistake": "one", "lost": 2, "won": 1, "net": 1, "of": 3} | nothing | {"fitted": 2},
        {"mistake": "two", "lost": 0, "won": 0, "net": 0, "of": 3} | nothing,
    ]
    by_kind = mistakes_table(AGREES, {"a": "fitted", "b": "measured", "d": "measured"})[0]
    assert (by_kind["lost"], by_kind["won"], by_kind["of"], by_kind["fitted"]) == (1, 1, 2, 1)
