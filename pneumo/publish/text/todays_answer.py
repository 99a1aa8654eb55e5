"""Advice for a reader of today, from the evidence: one text for README, documentation and manuscript."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.contest_statistics import BEFOREHAND, row_of
from pneumo.publish.text.formatting import with_interval

LOOPS = ["open", "closed"]
WRONG_VALVES = (0.97, 1.03)


class Advice(NamedTuple):
    """What to take in one situation, and what the evidence says of it."""

    case: str
    take: str
    evidence: str


def _span(values: np.ndarray) -> str:
    return f"{values.min():.2f} to {values.max():.2f}"


def full_over_beforehand(contest: xr.Dataset, valve_right: bool) -> xr.DataArray:
    """Ratios of the full order to the choice beforehand by (case, loop, bound), k_0 told up to 2.7 off."""
    told = ~contest["full"].str.contains("adiabatic").values
    at = np.flatnonzero(told & (np.isclose(contest["case_valve"], 1.0) == valve_right))
    return contest["full_quotient"].isel(case=at).sel(part=LOOPS)


def errors_of(contest: xr.Dataset, choice: str, valves: tuple[float, ...] = (1.0,)) -> np.ndarray:
    """Geometric mean errors of a choice over the best's in hindsight, at each valve told, k_0 right."""
    rows = [row_of(contest, choice, 1.0, valve) for valve in valves]
    return np.array([row["error"].sel(part="all", bound="value").item() for row in rows if row is not None])


def rule_text(contest: xr.Dataset, model: str) -> str:
    """Rule of n for a model, such as ``n = 1.4 - 0.475/(1 + 7.5 thermal)``."""
    a, b, c = contest["rule_n"].sel(ruled=model).values
    return f"n = {a:.3g} - {b:.3g}/(1 + {c:.2g} thermal)"


def todays_answer(contest: xr.Dataset, air: xr.Dataset) -> list[Advice]:
    """Advice by what is known, from the contest of decision 75 and from measured air."""
    known, wrong = (full_over_beforehand(contest, right) for right in (True, False))
    choices = BEFOREHAND, "full order, true law"
    lost = np.concatenate([errors_of(contest, choice, WRONG_VALVES) for choice in choices])
    by_rule = row_of(contest, "M6 by rule")
    assert by_rule is not None
    of_rule = with_interval(by_rule["error"].sel(part="all").values, 1)
    measured = {
        (case, model): f"{air[quantity].sel(case=case, model=model).item() / 1e3:.1f}"
        for case, quantity in (("pulses", "held_out"), ("discharge", "fitted"))
        for model in ("M8", "full order")
    }
    paying, undecided = (_span(ratios.sel(bound="value").values) for ratios in (known, wrong))
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
            f"until then every model's error is {lost.min():.1f} to {lost.max():.1f} times what the best"
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
