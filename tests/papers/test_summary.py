"""Scores of known items, and computations whose answer is known otherwise."""

import math
from pathlib import Path

import pytest

from pneumo.configuration.parameters import load, study
from pneumo.papers.paper_2006.equation_checks import largest_flow
from pneumo.papers.paper_2006.summary import scores
from pneumo.papers.paper_2006.table1 import PAPER_MODELS, table_1_row
from pneumo.physics.valve import choked_flow
from pneumo.verdict.published import read_table
from pneumo.verdict.sources import StudyResults

STUDY = study(load(Path(__file__).parents[2] / "config/paper.yaml"))


def test_table_1_follows_from_the_table_of_models():
    rows = {name: table_1_row(model) for name, model in PAPER_MODELS.items()}
    derived = [(name, column, cell) for name, row in rows.items() for column, cell in row.items()]
    assert derived == [(cell["row"], cell["column"], cell["printed"]) for cell in read_table(1)]


def test_the_largest_flow_is_in_standard_litres_per_minute():
    results = StudyResults(Path(), "published")
    results.study = STUDY
    plant = STUDY.experiments["E01"].plant
    kg_per_s = choked_flow(plant.valve.k_xu * plant.valve.u_max, 7e5, 293.0, plant.gas)
    litre = 101325 * 1e-3 / (287.0 * 293.15)  # kg
    assert largest_flow(results, "D").value == pytest.approx(kg_per_s / litre * 60, rel=1e-12)


def test_scores_of_known_items():
    cell = {"table": 7, "column": "mse", "status": "exact", "reproduced": 1.0, "deviation": 0.25}
    items = [
        cell,
        cell | {"deviation": -0.2, "status": "missed"},
        cell | {"reproduced": "none", "status": "contradicted"},
        cell | {"status": "unreadable"},
        cell | {"table": 5, "column": "P_A", "status": "close"},
    ]
    found = scores(items)
    assert found["table_7_mse"] == {
        "cells": 2,
        "rms_of_ln_ratio": pytest.approx(math.log(1.25), abs=1e-6),
        "lowest_ratio": pytest.approx(0.8),
        "highest_ratio": pytest.approx(1.25),
    }
    assert found["table_5"] == {"cells": 1, "exact": 0, "exact_or_close": 1}
    assert found["missed_of_readable"] == 0.25
