"""Advice for a reader of today, from the evidence: one text for README, documentation, manuscript and pages.

Pages of an installed pneumo, without evidence beside them, quote `kept_sentences`.
"""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.equations.system import FULL_ORDER
from pneumo.evidence.at_work.partly_known_statistics import COMPARED, REDUCED
from pneumo.evidence.random_cylinders.contest_statistics import BEFOREHAND
from pneumo.publish.text.formatting import span_text, with_interval
from pneumo.publish.text.kept_sentences import Quoted

FULL = "full order, constant law"  # the law that a user has: the true one is not known
LOOPS = ["open", "closed"]
THIRDS = ["lowest third", "middle third", "highest third"]
WRONG_VALVES = (0.97, 1.03)
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


def lost_to_it(contest: xr.Dataset) -> str:
    """Text on the third of `thermal` and the k_0 where the full order pays least with the right valve."""
    ratios = full_over_beforehand(contest, True).sel(part=THIRDS)
    values = ratios.sel(bound="value").transpose("case", "part").values
    case, third = np.unravel_index(int(values.argmax()), values.shape)
    interval = with_interval(ratios.isel(case=case, part=third).values)
    k_0 = ratios["case_k_0"].values[case]
    wrong = f"{k_0:.2g} times too large" if k_0 > 1 else f"{1 / k_0:.2g} times too small"
    return f"{interval} in the {THIRDS[third]} of `thermal` where k_0 is told {wrong}"


def rule_text(contest: xr.Dataset, model: str) -> str:
    """Rule of n for a model, such as ``n = 1.4 - 0.475/(1 + 7.5 thermal)``."""
    a, b, c = contest["rule_n"].sel(ruled=model).values
    return f"n = {a:.3g} - {b:.3g}/(1 + {c:.2g} thermal)"


def todays_answer(contest: xr.Dataset, air: xr.Dataset, partly_known: xr.Dataset) -> list[Advice]:
    """Advice by what is wanted and known, from the contest of decision 75, decision 76 and measured air."""
    known = full_over_beforehand(contest, True).sel(bound="value", part=LOOPS).values
    full, chosen = lost_by_valve(contest)
    simulated, ruled = errors_of(contest, BEFOREHAND), errors_of(contest, "M6 by rule")
    measured = [
        ", ".join(f"{air['held_out'].sel(case=case, model=m).item() / 1e3:.1f}" for m in SHOWN_ON_AIR)
        + f" kPa {where}"
        for case, where in RECORDS.items()
    ]
    return [
        Advice(
            "you control a position",
            f"any of {REDUCED[0]} to {REDUCED[-1]}: the model hardly matters",
            f"the full order has {controllers(partly_known)} times the tracking error of the best of them",
        ),
        Advice(
            "you estimate or simulate pressures, know the valve, and k_0 within a factor of 2.7",
            "the **full order**: pressure and temperature as states, constant k_0",
            f"{span_text(known)} times the mean square error (MSE) of the model of M5 to M10 that a"
            f" simulation with the same knowledge chooses; but {lost_to_it(contest)}",
        ),
        Advice(
            "you know k_0 like that, but the valve only within 3 %",
            "**calibrate the valve** first",
            f"until then the full order has {full} times the MSE that the best reduced model can reach, the"
            f" chosen one {chosen} times",
        ),
        Advice(
            "you know neither, but have a bench",
            "`pneumo fit`, then the model that is best on the part held out",
            f"{', '.join(SHOWN_ON_AIR)} on measured air, held out: {'; '.join(measured)}",
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
    rows = [row.name for row in COMPARED if not row.estimates_k_0]
    ratios = partly_known["controller_over_reduced"].sel(part="all", bound="value", compared=rows)
    return span_text(ratios.values)


def observers(partly_known: xr.Dataset) -> dict[str, str]:
    """Ranges of RMS errors of full-order observers over the best reduced model's, by what is known."""
    ratios = partly_known["observer_over_reduced"].sel(part="all", bound="value")
    known, unknown = ratios.sel(scale=ratios["scale"].min()), ratios.sel(scale=ratios["scale"].max())
    of_full = [row for row in COMPARED if row.model == FULL_ORDER]
    wrong = [row.name for row in of_full if row.k_0_factor != 1 and not row.estimates_k_0]
    states = [row.name for row in of_full if row.estimates_k_0]
    return {
        "known": span_text(known.sel(compared=FULL_ORDER).values),
        "wrong k_0": span_text(known.sel(compared=wrong).values),
        "estimated k_0": span_text(known.sel(compared=states, sensors=["one", "both"]).values),
        "unknown": span_text(unknown.sel(compared=FULL_ORDER).values),
    }


def quoted(contest: xr.Dataset, partly_known: xr.Dataset) -> Quoted:
    """Write the sentences from the evidence of decisions 75 and 76."""
    known = span_text(full_over_beforehand(contest, True).sel(bound="value", part=LOOPS).values)
    full, chosen = lost_by_valve(contest)
    of_observers = observers(partly_known)
    return Quoted(
        f"On {contest['cylinders'].sel(part='all').item()} random cylinders, with the valve known and k_0"
        f" within a factor of 2.7, the full order had {known} times the mean square error of the best of M5"
        f" to M10, as a simulation with the same knowledge chooses, but {lost_to_it(contest)}. With the valve"
        f" known within 3 % only, the full order had {full}, the chosen model {chosen} times what the best"
        " reduced one can reach, so calibrate the valve first.",
        f"In a pressure observer the full order had {of_observers['known']} times the RMS error of the best"
        f" reduced model where everything is known, {of_observers['wrong k_0']} times with k_0 wrong by 2:"
        " then estimate k_0 as a state, if a pressure is measured"
        f" ({of_observers['estimated k_0']}). With the valve off by 5 %, dead volumes and friction by 20 %"
        f" it had {of_observers['unknown']} times. In a position controller it had"
        f" {controllers(partly_known)} times the tracking error: there the model hardly matters.",
    )
