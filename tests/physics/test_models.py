"""The ten reduced models: each against the literal equations."""

import numpy as np
import paper_equations as paper
import pytest
from hypothesis import given, target
from model_rates import arguments, evaluate, scale_of

from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.physics.models import MODELS, WALL_LAWS, Lane, lane, lane_array

EPS = np.finfo(float).eps
WITH_N = ("M2", "M5", "M6", "M7", "M8", "M9", "M10")


@pytest.mark.parametrize("name", PAPER_MODELS)
@given(a=arguments())
def test_model_is_the_literal_equation(name, a):
    T, dP_dt = evaluate(name, a)
    literal_T, literal_dP_dt = paper.MODELS[name](**a)
    assert literal_T == T  # the same power of the same number
    # Two orders of writing, some 25 roundings of at most half an ulp of the sum of terms, most of far less.
    error = abs(dP_dt - literal_dP_dt) / (EPS * scale_of(name, a) or 1)
    target(error)
    assert error <= 8


def test_the_papers_ten_models_are_in_order_and_lanes_stack_in_field_order():
    assert list(MODELS)[:10] == [f"M{i}" for i in range(1, 11)] == list(paper.MODELS) == list(PAPER_MODELS)
    assert all(name == row.name for name, row in MODELS.items())
    assert [name for name, row in PAPER_MODELS.items() if row.has_n] == list(WITH_N)
    lanes = [lane(MODELS["M4"], 1.2, 1.4), lane(MODELS["M10"], 1.25, 1.4)]
    array = lane_array(lanes)
    assert array.shape == (2, len(Lane._fields))
    assert [Lane(*row) for row in array.tolist()] == lanes
    assert lane_array([]).shape == (0, len(Lane._fields))
    assert {row.wall for row in MODELS.values()} == set(WALL_LAWS)
