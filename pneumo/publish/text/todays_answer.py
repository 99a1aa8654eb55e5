"""Advice for a reader of today, from the evidence: one text for README, documentation, manuscript and pages.

Pages of an installed pneumo, without evidence beside them, quote `kept_sentences`.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.equations.system import FULL_ORDER
from pneumo.evidence.random_cylinders.contest_statistics import BEFOREHAND, runs_counted
from pneumo.publish.text.formatting import span_text, with_interval
from pneumo.publish.text.kept_sentences import Quoted
from pneumo.statistics.intervals import quotient_interval

FULL = "full order, constant law"  # the law that a user has: the true one is not known
LOOPS = ["open", "closed"]
THIRDS = ["lowest third", "middle third", "highest third"]
WRONG_VALVES = (0.97, 1.03)
REDUCED = ("M6", "M7", "M8", "M10")
SHOWN_ON_AIR = ("full order", "M10", "M8")
RECORDS = {  # of measured air with flow -> what was measured
    "pulses": "behind an on/off valve",
    "discharge": "on a vessel that empties",
    "filling": "on one that fills",
}


class Advice(NamedTuple):
    """Advice for one situation: the model to take, and the evidence for it."""

    case: str
    take: str
    evidence: str


def full_over_beforehand(contest: xr.Dataset, valve_right: bool) -> xr.DataArray:
    """Mean square error of the full order, constant k_0, over that of the model chosen by a simulation.

    By (case, part, bound): a case for each k_0 given to both, right or up to 2.7 times off, with the valve
    right or 3 % off.
    """
    told = np.isclose(contest["case_valve"], 1.0) == valve_right
    return contest["full_quotient"].isel(case=np.flatnonzero((contest["full"].values == FULL) & told))


def errors_of(contest: xr.Dataset, choice: str, valves: tuple[float, ...] = (1.0,)) -> np.ndarray:
    """Geometric mean of a choice's MSE over the lowest in hindsight, one value per k_0 and valve given."""
    tried = (contest["choice"] == choice).values & np.isclose(
        contest["row_valve"].values[:, None], valves
    ).any(axis=1)
    return contest["error"].isel(row=np.flatnonzero(tried)).sel(part="all", bound="value").values


def lost_by_valve(contest: xr.Dataset) -> tuple[str, str]:
    """Ranges of MSE over the lowest in hindsight, valve 3 % off: full order, choice of a simulation."""
    full, chosen = (span_text(errors_of(contest, name, WRONG_VALVES), 1) for name in (FULL, BEFOREHAND))
    return full, chosen


def worst_third(contest: xr.Dataset) -> tuple[float, str]:
    """Assumed k_0, over the true one, and third of `thermal` where the full order pays least, as text.

    The valve is right.
    """
    ratios = full_over_beforehand(contest, True).sel(part=THIRDS)
    values = ratios.sel(bound="value").transpose("case", "part").values
    case, third = np.unravel_index(int(values.argmax()), values.shape)
    interval = with_interval(ratios.isel(case=case, part=third).values)
    return float(ratios["case_k_0"].values[case]), f"{interval} in the {THIRDS[third]} of `thermal`"


def by_mean_error(contest: xr.Dataset, k_0: float) -> str:
    """Text on the loop in which the full order pays least by the mean of all errors, at an assumed k_0.

    The geometric mean gives each run the same weight, this one each pascal squared.
    """
    found = list[tuple[np.ndarray, str]]()
    for loop in LOOPS:
        counted = runs_counted(contest)[loop].sel(loop=loop)
        at = contest.sel(loop=loop, valve_told=1.0).sel(k_0_told=k_0, method="nearest")
        at = at.where(counted, drop=True)
        full, chosen = at["mse_full"].sel(law="constant"), at["mse_simulated"].sel(carried="best")
        found.append((np.array(quotient_interval(full.values, chosen.values)), loop))
    interval, loop = max(found, key=lambda each: each[0][0])
    return f"{with_interval(interval)} in {loop} loop"


def k_0_in_words(k_0: float) -> str:
    """Words on an assumed k_0 over the true one."""
    if k_0 == 1:
        return "k_0 right"
    return f"k_0 told {k_0:.2g} times too large" if k_0 > 1 else f"k_0 told {1 / k_0:.2g} times too small"


def rule_text(contest: xr.Dataset, model: str) -> str:
    """Rule of n for a model, such as ``n = 1.4 - 0.475/(1 + 7.5 thermal)``."""
    a, b, c = contest["rule_n"].sel(ruled=model).values
    return f"n = {a:.3g} - {b:.3g}/(1 + {c:.2g} thermal)"


def todays_answer(contest: xr.Dataset, air: xr.Dataset, partly_known: xr.Dataset) -> list[Advice]:
    """Advice by what is wanted and known, from the contest of decision 75, decision 76 and measured air."""
    known = full_over_beforehand(contest, True).sel(bound="value", part=LOOPS).values
    (full, chosen), of_observers = lost_by_valve(contest), observers(partly_known)
    worst_k_0, in_third = worst_third(contest)
    by_mean = by_mean_error(contest, worst_k_0)
    simulated, ruled = errors_of(contest, BEFOREHAND), errors_of(contest, "M6 by rule")
    measured = [
        ", ".join(f"{air['held_out'].sel(case=case, model=m).item() / 1e3:.1f}" for m in SHOWN_ON_AIR)
        + f" kPa {where}"
        for case, where in RECORDS.items()
    ]
    return [
        Advice(
            "you control a position",
            f"any of {', '.join(REDUCED)}: the model hardly matters",
            f"the full order has {controllers(partly_known)} times the tracking error of the best of them",
        ),
        Advice(
            "you simulate pressures, know the valve, and k_0 within a factor of 2.7",
            "the **full order**: pressure and temperature as states, constant k_0",
            f"{span_text(known)} times the mean square error (MSE, geometric mean) of the model that a"
            f" simulation chooses; but, with {k_0_in_words(worst_k_0)}, {in_third}, and {by_mean} by the"
            " plain mean",
        ),
        Advice(
            "you estimate pressures (an observer), and know the valve",
            "the **full order**; with k_0 as a state where a pressure is measured",
            f"{of_observers['known']} times the best reduced model's RMS error if all is known; but"
            f" {of_observers['twice k_0']} with k_0 told twice",
        ),
        Advice(
            "you know k_0 within 2.7, but the valve only within 3 %",
            "**calibrate the valve** first",
            f"until then the full order has {full} times the MSE of the best in hindsight, the chosen model"
            f" {chosen} times",
        ),
        Advice(
            "you know neither, but have a bench",
            "`pneumo fit` or `pneumo rig`, then the model that is best on the part held out",
            f"{', '.join(SHOWN_ON_AIR)} by `pneumo rig` on air: {'; '.join(measured)}; none behind a servo"
            " valve",
        ),
        Advice(
            "you can carry only one state a chamber",
            f"model and n by `pneumo study`; or **M6** with {rule_text(contest, 'M6')}",
            f"{simulated.min():.2f} times the MSE of the best in hindsight where k_0 is right, up to"
            f" {simulated.max():.2f} where it is 2.7 off; {span_text(ruled, 1)} times by the rule",
        ),
    ]


def controllers(partly_known: xr.Dataset) -> str:
    """Range of tracking errors with the full order over the best reduced model's, k_0 right or wrong."""
    rows = ["full, 0.5 k_0", "full", "full, 2 k_0"]
    ratios = partly_known["controller_over_reduced"].sel(part="all", bound="value", compared=rows)
    return span_text(ratios.values)


def observers(partly_known: xr.Dataset) -> dict[str, str]:
    """Ranges of RMS errors of full-order observers over the best reduced model's, by what is known."""
    ratios = partly_known["observer_over_reduced"].sel(part="all", bound="value")
    known, unknown = ratios.sel(scale=ratios["scale"].min()), ratios.sel(scale=ratios["scale"].max())
    states = ["full, k_0 estimated from 0.5 k_0", "full, k_0 estimated from 2 k_0"]
    return {
        "known": span_text(known.sel(compared=FULL_ORDER).values),
        **{
            f"{word} k_0": span_text(known.sel(compared=f"{FULL_ORDER}, {factor} k_0").values)
            for word, factor in (("half", "0.5"), ("twice", "2"))
        },
        "estimated k_0": span_text(known.sel(compared=states, sensors=["one", "both"]).values),
        "unknown": span_text(unknown.sel(compared=FULL_ORDER).values),
    }


def quoted(contest: xr.Dataset, partly_known: xr.Dataset) -> Quoted:
    """Write the sentences from the evidence of decisions 75 and 76."""
    known = span_text(full_over_beforehand(contest, True).sel(bound="value", part=LOOPS).values)
    full, chosen = lost_by_valve(contest)
    of_observers, (worst_k_0, in_third) = observers(partly_known), worst_third(contest)
    by_mean = by_mean_error(contest, worst_k_0)
    return Quoted(
        f"On {contest['cylinders'].sel(part='all').item()} random cylinders, with the valve known and k_0"
        f" within a factor of 2.7, the full order had {known} times the mean square error of the best of M5"
        " to M10, as a simulation with the same knowledge chooses, but, with"
        f" {k_0_in_words(worst_k_0)}, {in_third}, and {by_mean} by the plain mean. With the valve known"
        f" within 3 % only, the full order had {full}, the chosen model {chosen} times the error of the best"
        " in hindsight, so calibrate the valve first.",
        f"In a pressure observer the full order had {of_observers['known']} times the RMS error of the best"
        f" reduced model where everything is known, {of_observers['half k_0']} times with k_0 told half and"
        f" {of_observers['twice k_0']} with k_0 told twice: then estimate k_0 as a state, if a pressure is"
        f" measured ({of_observers['estimated k_0']}). With the valve off by 5 %, dead volumes and friction"
        f" by 20 % it had {of_observers['unknown']} times. In a position controller it had"
        f" {controllers(partly_known)} times the tracking error: there the model hardly matters.",
    )
