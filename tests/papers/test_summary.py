"""Scores of known items, and computations whose answer is known otherwise."""

import math
from pathlib import Path

import numpy as np
import pytest
from paper_study import STUDY

from paper.study.paper_2006.equation_checks import largest_flow
from paper.study.paper_2006.paper_models import PAPER_MODELS, table_1_row
from paper.study.paper_2006.printed_tables import read_table
from paper.study.paper_2006.results import StudyResults
from paper.study.paper_2006.run_statements import turning_points
from paper.study.paper_2006.summary import scores
from pneumo.physics.valve import choked_flow


def test_table_1_follows_from_the_models_and_the_largest_flow_is_in_standard_litres():
    rows = {name: table_1_row(model) for name, model in PAPER_MODELS.items()}
    derived = [(name, column, cell) for name, row in rows.items() for column, cell in row.items()]
    assert derived == [(cell["row"], cell["column"], cell["printed"]) for cell in read_table(1)]
    results = StudyResults(Path(), "published")
    results.study = STUDY
    plant = STUDY.experiments["E01"].plant
    kg_per_s = choked_flow(plant.valve.k_xu * plant.valve.u_max, 7e5, 293.0, plant.gas)
    litre = 101325 * 1e-3 / (287.0 * 293.15)  # kg
    assert largest_flow(results, "D").value == pytest.approx(kg_per_s / litre * 60, rel=1e-12)


def test_scores_of_known_items():
    cell = {"table": 7, "column": "mse", "status": "exact", "reproduced": 1.0, "deviation": 0.25}
    missed, none = {"deviation": -0.2, "status": "missed"}, {"reproduced": "none", "status": "contradicted"}
    items = [cell, cell | missed, cell | none, cell | {"table": 5, "column": "P_A", "status": "close"}]
    agreement = scores(items)
    ratios = {"lowest_ratio": pytest.approx(0.8), "highest_ratio": pytest.approx(1.25)}
    rms = pytest.approx(math.log(1.25), abs=1e-6)
    assert agreement["table_7_mse"] == {"cells": 2, "rms_of_ln_ratio": rms} | ratios
    assert agreement["table_5"] == {"cells": 1, "exact": 0, "exact_or_close": 1}


def test_extrema_are_counted_in_turn_and_ripples_are_not():
    t = np.arange(0.0, 3.0, 0.001)
    series = np.exp(-t) * np.cos(2 * np.pi * t) + 1e-3 * np.sin(2 * np.pi * 50 * t)
    turns = turning_points(series, 0.05)
    np.testing.assert_allclose(t[turns], [0.475, 0.975, 1.475, 1.975, 2.475], atol=0.01)
    assert turning_points(-series, 0.05) == turns  # minima and maxima alike, the start is neither
    assert len(turning_points(series, 1e-4)) > 50
    assert turning_points(t, 0.05) == turning_points(-t, 0.05) == []
    assert turning_points(np.array([0.0, 1.0, 0.5, 2.0]), 0.6) == []
    assert turning_points(np.array([0.0, 1.0, 0.5, 2.0]), 0.4) == [1, 2]
