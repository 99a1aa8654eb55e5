"""Closed chambers: checks of a record before it is fitted, and warnings of the fit."""

from collections.abc import Mapping

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fitting.closed.closed_problem import BOUNDS, LAWS, ClosedRecord
from pneumo.fitting.fit_problem import ON_BOUND
from pneumo.fitting.fit_result import Estimate
from pneumo.fitting.fit_warnings import (
    apart,
    disagreements,
    odd_values,
    residual_warnings,
    undetermined_notes,
)
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.residuals import Residual
from pneumo.fitting.stage_signals import smoothing
from pneumo.physics.cylinder import chamber_of

SHUT = 0.02  # command over its limit, below which a valve passes next to nothing
SELDOM = 0.01  # of the samples, that a command may be larger
BLOCKS = 20  # of a record, whose mean pressures are compared
VISIBLE = 10.0  # range of the means over their noise, above which a pressure changes
OPEN = 0.1  # standard deviation of ln P over that of ln V, below which a chamber is not closed
MOVED = 0.02  # standard deviation of ln V, above which the motion must show in the pressure
REVERSED = 0.5  # correlation of ln P and ln V, above which one of them has the wrong sign
DETERMINED = ("k_0_A", "k_0_B", "V_d_A", "V_d_B")  # should have a narrow interval
REMEDY = "move the piston fast through much of its stroke, or compress fast and hold, with the valve shut"


def check_closed(
    record: ClosedRecord, plant: Plant, measurement: Measurement, check: bool
) -> tuple[list[int], list[str]]:
    """Sides, 0 or 1, of the chambers that can be fitted, and notes on the record.

    `InputError` if no chamber can be fitted; with `check`, also if the command is not about zero, or if
    chambers look swapped.
    """
    chambers, notes, reasons = [], [], []
    driven = float(np.mean(np.abs(measurement.u) > SHUT * plant.valve.u_max))
    if check and driven > SELDOM:
        raise InputError(
            f"{record.name}: column u: beyond {100 * SHUT:g} % of u_max in {100 * driven:.2g} % of samples:"
            " must be about zero in closed chambers; --closed-from names the time when the valve shuts,"
            " --trust skips this check"
        )
    if np.any(measurement.u != 0) or (measurement.m is not None and np.any(measurement.m != 0)):
        notes.append("command or flows are not zero: not used, since --closed says that no gas flows")
    for side, (P, length) in enumerate(zip(record.P, record.uncovered, strict=True)):
        chamber, name = chamber_of(plant.cylinder, side), f"P_{'AB'[side]}"
        log_P, log_V = np.log(P), np.log(chamber.V_d + chamber.area * length)
        motion = np.std(log_V)
        means = np.array([block.mean() for block in np.array_split(P, BLOCKS)])
        noise = smoothing(P, record.h)[1] / np.sqrt(len(P) / BLOCKS) if np.ptp(P) > 0 else 0.0
        if np.ptp(means) <= VISIBLE * noise:
            reasons.append(f"{name} does not change beyond its noise")
        elif motion > MOVED and np.std(log_P) < OPEN * motion:
            reasons.append(f"{name} hardly follows the piston: the chamber is open")
        elif check and motion > MOVED and np.corrcoef(log_P, log_V)[0, 1] > REVERSED:
            raise InputError(
                f"{record.name}: {name} rises as its chamber grows: columns P_A and P_B look swapped,"
                " or x has the wrong sign; --trust skips this check"
            )
        else:
            chambers.append(side)
    if not chambers:
        raise InputError(f"{record.name}: {', '.join(reasons)}: nothing to fit; {REMEDY}")
    return chambers, notes + [
        f"{reason}: not fitted, but gas leaks past the piston to or from it" for reason in reasons
    ]


def closed_warnings(
    estimates: Mapping[str, Estimate], residuals: Mapping[str, Mapping[str, Residual]], plant: Plant
) -> list[str]:
    """Warnings of residuals of the best law, and of unlikely parameters.

    The parameters are those of the best law with wall heat, and n of the law "free n". `estimates` are by
    law, the best first, `residuals` by law and chamber.
    """
    best = next(iter(estimates))
    wall = next(estimate for law, estimate in estimates.items() if LAWS[law].explicit_heat)
    result = residual_warnings(best, residuals[best])
    at_bound = [
        name
        for name, value in wall.values.items()
        if name.startswith("V_d")
        and value < BOUNDS["V_d"][0] * (1 + ON_BOUND) * getattr(plant.cylinder, name)
    ]
    meaning = "no n describes wall heat and leakage of this record"
    free = {name: estimates["free n"].values[name] for name in ("n",) if "free n" in estimates}
    result += odd_values(wall.values | free, at_bound, plant, meaning=meaning)
    result += undetermined_notes(wall, DETERMINED, remedies={}, remedy=REMEDY)
    ends = [(wall.low[name], wall.high[name]) for name in ("k_0_A", "k_0_B") if name in wall.low]
    if ends and apart(ends):
        result.append(
            "the intervals of k_0 of A and of B do not overlap, and a configuration has one k_0:"
            " `fitted.yaml` gets their mean, with an interval that contains both"
        )
    return result + disagreements(estimates, ("k_0_A", "k_0_B"))
