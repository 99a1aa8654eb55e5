"""One answer for README, documentation and manuscript: it follows the evidence."""

import re

import numpy as np
import pytest

from pneumo.evidence.random_cylinders.contest_statistics import BEFOREHAND
from pneumo.publish.text.todays_answer import (
    full_over_beforehand,
    kept_sentences,
    quoted,
    rule_text,
    todays_answer,
)
from pneumo.storage.files import read
from pneumo.storage.kept_evidence import KEPT

CONTEST, AIR = read(KEPT / "contest.nc"), read(KEPT / "measured_air.nc")


def test_the_full_orders_ratios_are_those_of_the_errors_of_one_knowledge():
    """Ratio of two geometric means over the same runs is the geometric mean of the ratios."""
    for right in (True, False):
        cases = full_over_beforehand(CONTEST, right)
        assert not cases["full"].str.contains("adiabatic").any()
        for i in range(cases.sizes["case"]):
            at = cases.isel(case=i)
            errors = []
            for choice in (at["full"].item(), BEFOREHAND):
                rows = (CONTEST["choice"] == choice) & np.isclose(CONTEST["row_k_0"], at["case_k_0"])
                rows &= np.isclose(CONTEST["row_valve"], at["case_valve"])
                assert rows.sum() == 1
                errors.append(CONTEST["error"].isel(row=int(np.flatnonzero(rows)[0])).sel(bound="value"))
            for loop in ("open", "closed"):
                expected = errors[0].sel(part=loop).item() / errors[1].sel(part=loop).item()
                assert at.sel(part=loop, bound="value").item() == pytest.approx(expected, rel=0.01), at


def test_the_answer_changes_with_each_part_of_the_evidence():
    told = [row.evidence for row in todays_answer(CONTEST, AIR)]
    other = [
        row.evidence for row in todays_answer(CONTEST.assign(full_quotient=2 * CONTEST["full_quotient"]), AIR)
    ]
    assert [a != b for a, b in zip(told, other, strict=True)] == [True, True, False, False]
    other = [row.evidence for row in todays_answer(CONTEST, AIR.assign(held_out=2 * AIR["held_out"]))]
    assert [a != b for a, b in zip(told, other, strict=True)] == [False, False, True, False]
    other = [row.evidence for row in todays_answer(CONTEST.assign(error=2 * CONTEST["error"]), AIR)]
    assert [a != b for a, b in zip(told, other, strict=True)] == [False, True, False, True]
    a, b, _ = CONTEST["rule_n"].sel(ruled="M6").values
    assert rule_text(CONTEST, "M6").startswith(f"n = {a:.3g} - {b:.3g}/")


def test_pages_quote_the_evidence_of_today():
    kept, contest, partly_known = kept_sentences(), CONTEST, read(KEPT / "partly_known.nc")
    assert kept == quoted(contest, partly_known), "run: make numbers"
    rows = todays_answer(contest, AIR)
    for row, words in zip(
        rows[:2], (" times the mean square error", " times what the best reduced"), strict=True
    ):
        number = re.search(rf"(\d[\d. to]+){words}", row.evidence)
        assert number and number[1] in kept.choice
    more = partly_known.assign(observer_over_reduced=2 * partly_known["observer_over_reduced"])
    assert quoted(contest, more).in_use != kept.in_use and quoted(contest, more).choice == kept.choice
    assert "controller 1.00 times" in kept.in_use
