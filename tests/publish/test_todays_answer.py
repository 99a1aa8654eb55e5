"""One answer for README, documentation and manuscript: it follows the evidence."""

import re

import numpy as np
import pytest

from pneumo.evidence.random_cylinders.contest_statistics import BEFOREHAND
from pneumo.publish.text.kept_sentences import kept_sentences
from pneumo.publish.text.todays_answer import (
    FULL,
    full_over_beforehand,
    quoted,
    rule_text,
    todays_answer,
)
from pneumo.storage.files import read
from pneumo.storage.kept_evidence import KEPT

CONTEST, AIR, AT_WORK = (read(KEPT / f"{name}.nc") for name in ("contest", "measured_air", "partly_known"))


def test_the_full_orders_ratios_are_those_of_the_errors_of_one_knowledge():
    """Ratio of two geometric means over the same runs is the geometric mean of the ratios."""
    for right in (True, False):
        cases = full_over_beforehand(CONTEST, right)
        assert set(cases["full"].values) == {FULL} and np.isclose(cases["case_valve"], 1).all() == right
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


def evidence(contest=CONTEST, air=AIR, at_work=AT_WORK):
    return [row.evidence for row in todays_answer(contest, air, at_work)]


@pytest.mark.parametrize(
    "changed, rows",
    [
        ({"contest": CONTEST.assign(full_quotient=2 * CONTEST["full_quotient"])}, [1]),
        ({"contest": CONTEST.assign(error=2 * CONTEST["error"])}, [3, 5]),
        ({"contest": CONTEST.assign(mse_full=2 * CONTEST["mse_full"])}, [1]),
        ({"at_work": AT_WORK.assign(observer_over_reduced=2 * AT_WORK["observer_over_reduced"])}, [2]),
        ({"air": AIR.assign(held_out=2 * AIR["held_out"])}, [4]),
        ({"at_work": AT_WORK.assign(controller_over_reduced=2 * AT_WORK["controller_over_reduced"])}, [0]),
    ],
)
def test_the_answer_changes_with_each_part_of_the_evidence(changed, rows):
    pairs = zip(evidence(), evidence(**changed), strict=True)
    assert [i for i, (before, after) in enumerate(pairs) if before != after] == rows
    a, b, _ = CONTEST["rule_n"].sel(ruled="M6").values
    assert rule_text(CONTEST, "M6").startswith(f"n = {a:.3g} - {b:.3g}/")


def spans(text):
    """Pairs of numbers written as a span."""
    return [(float(low), float(high)) for low, high in re.findall(r"([\d.]+) to ([\d.]+)", text)]


def test_no_case_of_a_row_is_outside_the_span_that_it_prints():
    """Every k_0 told within 2.7 and, in the second row, both valves: what the user may have."""
    _, known, _, wrong, _, _ = evidence()
    e, choice = CONTEST["error"].sel(part="all", bound="value").values, CONTEST["choice"].values
    valve, k_0 = CONTEST["row_valve"].values, CONTEST["row_k_0"].values
    for (low, high), name in zip(spans(wrong), (FULL, BEFOREHAND), strict=True):
        inside = e[(choice == name) & ~np.isclose(valve, 1.0)]
        assert len(inside) == 6 and low - 0.05 <= inside.min() and inside.max() <= high + 0.05
        assert max(inside.min() - low, high - inside.max()) < 0.05
    (low, high), (least, most), of_mean = spans(known)
    for told in np.unique(k_0):
        at = (CONTEST["full"].values == FULL) & np.isclose(CONTEST["case_valve"], 1)
        of_loops = CONTEST["full_quotient"].values[at & np.isclose(CONTEST["case_k_0"], told)][0, 1:3, 0]
        assert (of_loops > low - 0.005).all() and (of_loops < high + 0.005).all()
    thirds = CONTEST["full_quotient"].values[at][:, 3:6]
    assert list(CONTEST["part"].values[3:6]) == ["lowest third", "middle third", "highest third"]
    assert (least, most) == pytest.approx(thirds.reshape(-1, 3)[thirds[..., 0].argmax(), 1:], abs=0.005)
    # Sums of errors, in each loop, of runs whose best model has an error at all.
    at = CONTEST.sel(valve_told=1.0, loop=["open", "closed"]).isel(k_0_told=-1)
    at = at.where((at["held_out"] == 1) & (at["run_status"] == 0), drop=True)
    sums = at["mse_full"].sel(law="constant").sum("cylinder") / at["mse_simulated"].sel(carried="best").sum(
        "cylinder"
    )
    assert sums.dims == ("loop",) and of_mean[0] < sums.max() < of_mean[1]
    assert f"{sums.max().item():.2f} (" in known


def test_measured_air_is_told_on_records_that_no_fit_used():
    air = evidence()[4]
    for case in ("pulses", "discharge", "filling"):
        for model in ("full order", "M10", "M8"):
            assert f"{AIR['held_out'].sel(case=case, model=model).item() / 1e3:.1f}" in air


def test_pages_quote_the_evidence_of_today():
    kept = kept_sentences()
    assert kept == quoted(CONTEST, AT_WORK), "run: make numbers"
    _, known, _, wrong, _, _ = evidence()
    assert spans(known + wrong) == spans(kept.choice)
    more = AT_WORK.assign(observer_over_reduced=2 * AT_WORK["observer_over_reduced"])
    assert quoted(CONTEST, more).in_use != kept.in_use and quoted(CONTEST, more).choice == kept.choice
    assert "controller it had 1.00 times" in kept.in_use
