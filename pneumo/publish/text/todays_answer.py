"""Advice for a reader of today, from the evidence: one text for README, documentation, manuscript and pages.

Pages of an installed pneumo have no evidence beside them: they quote todays_answer.json, which
`make numbers` writes.
"""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.evidence.at_work.partly_known_statistics import COMPARED
from pneumo.evidence.random_cylinders.contest_statistics import BEFOREHAND, row_of
from pneumo.publish.text.formatting import span_text, with_interval

FILE = Path(__file__).with_name("todays_answer.json")
LOOPS = ["open", "closed"]
WRONG_VALVES = (0.97, 1.03)


class Advice(NamedTuple):
    """What to take in one situation, and what the evidence says of it."""

    case: str
    take: str
    evidence: str


def full_over_beforehand(contest: xr.Dataset, valve_right: bool) -> xr.DataArray:
    """Ratios of the full order to the choice beforehand by (case, loop, bound), k_0 told up to 2.7 off."""
    told = ~contest["full"].str.contains("adiabatic").values
    at = np.flatnonzero(told & (np.isclose(contest["case_valve"], 1.0) == valve_right))
    return contest["full_quotient"].isel(case=at).sel(part=LOOPS)


def errors_of(contest: xr.Dataset, choice: str, valves: tuple[float, ...] = (1.0,)) -> np.ndarray:
    """Geometric mean errors of a choice over the best's in hindsight, at each valve told, k_0 right."""
    rows = [row_of(contest, choice, 1.0, valve) for valve in valves]
    return np.array([row["error"].sel(part="all", bound="value").item() for row in rows if row is not None])


def lost_by_valve(contest: xr.Dataset) -> str:
    """Errors with the valve told 3 % off over the best in hindsight, of a simulation and the full order."""
    choices = BEFOREHAND, "full order, true law"
    return span_text(np.concatenate([errors_of(contest, choice, WRONG_VALVES) for choice in choices]), 1)


def rule_text(contest: xr.Dataset, model: str) -> str:
    """Rule of n for a model, such as ``n = 1.4 - 0.475/(1 + 7.5 thermal)``."""
    a, b, c = contest["rule_n"].sel(ruled=model).values
    return f"n = {a:.3g} - {b:.3g}/(1 + {c:.2g} thermal)"


def todays_answer(contest: xr.Dataset, air: xr.Dataset) -> list[Advice]:
    """Advice by what is known, from the contest of decision 75 and from measured air."""
    known, wrong = (full_over_beforehand(contest, right) for right in (True, False))
    lost = lost_by_valve(contest)
    by_rule = row_of(contest, "M6 by rule")
    assert by_rule is not None
    of_rule = with_interval(by_rule["error"].sel(part="all").values, 1)
    measured = {
        (case, model): f"{air[quantity].sel(case=case, model=model).item() / 1e3:.1f}"
        for case, quantity in (("pulses", "held_out"), ("discharge", "fitted"))
        for model in ("M8", "full order")
    }
    paying, undecided = (span_text(ratios.sel(bound="value").values) for ratios in (known, wrong))
    return [
        Advice(
            "you know the valve, and k_0 within a factor of 2.7, as the catalogue gives it",
            "the **full order**: pressure and temperature as states, constant k_0",
            f"{paying} times the mean square error of the best of M5 to M10, as a simulation with the same"
            " knowledge chooses model and n",
        ),
        Advice(
            "you know k_0 like that, but the valve only within 3 %",
            "**calibrate the valve** first",
            f"until then every model's error is {lost} times what the best"
            f" reduced one can reach; the full order's is {undecided} times the chosen one's",
        ),
        Advice(
            "you know neither, but have a bench",
            "`pneumo fit`, then the **full order** with what it finds",
            f"measured air: {measured['pulses', 'full order']} kPa where M8 has {measured['pulses', 'M8']},"
            f" on a cylinder behind an on/off valve; {measured['discharge', 'full order']} for"
            f" {measured['discharge', 'M8']} on a vessel that empties",
        ),
        Advice(
            "you can carry only one state a chamber",
            f"model and n by `pneumo study`; or **M6** with {rule_text(contest, 'M6')}",
            f"{errors_of(contest, BEFOREHAND)[0]:.2f} times the best in hindsight where k_0 is right;"
            f" {of_rule} by the rule",
        ),
    ]


class Quoted(NamedTuple):
    """Sentences of the answer for the pages of pneumo."""

    choice: str  #: which model to take, by what is known: two sentences
    in_use: str  #: what that means in an observer and in a controller


def quoted(contest: xr.Dataset, partly_known: xr.Dataset) -> Quoted:
    """Write the sentences from the evidence of decisions 75 and 76."""
    known = span_text(full_over_beforehand(contest, True).sel(bound="value").values)
    ratios = partly_known["observer_over_reduced"].sel(part="all", bound="value", compared="full")
    scales = partly_known["scale"].values
    right, wrong = (span_text(ratios.sel(scale=scale).values) for scale in (scales.min(), scales.max()))
    rows = [row.name for row in COMPARED if not row.estimates_k_0]
    control = partly_known["controller_over_reduced"].sel(part="all", bound="value", compared=rows)
    return Quoted(
        f"On {contest['cylinders'].sel(part='all').item()} random cylinders, with the valve known and k_0"
        f" within a factor of 2.7, the full order had {known} times the mean square error of the best of M5"
        " to M10, as a simulation with the same knowledge chooses. With the valve known within 3 % only,"
        f" every model's error was {lost_by_valve(contest)} times what the best reduced one can reach, so"
        " calibrate the valve first.",
        f"In a pressure observer the full order had {right} times the error of the best reduced model where"
        f" all else is known, and {wrong} times with the valve off by 5 %, dead volumes and friction"
        f" by 20 %; in a position controller {span_text(control.values)} times: there the model hardly"
        " matters.",
    )


@cache
def kept_sentences() -> Quoted:
    """Return the sentences as they were written last."""
    return Quoted(**json.loads(FILE.read_text(encoding="utf-8")))


def keep_sentences(sentences: Quoted) -> None:
    """Write the file that pages quote."""
    FILE.write_text(json.dumps(sentences._asdict(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
