"""Thermal laws fitted to a measurement of closed chambers, with a piston that moves or is held.

Pressures give the gas's temperature only as a ratio to the wall's, which is measured or configured: all
conductances are inversely proportional to the wall's temperature. `k_0_A` is the law's conductance at P_0,
T_0 and in mid-stroke, where configurations state it. The law "wall heat, area and root of PT" is that of the
full order.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.fitting.closed.closed_problem import (
    BOUNDS,
    LAWS,
    ClosedProblem,
    ClosedRecord,
    closed_problem,
    fitted_names,
)
from pneumo.fitting.estimate import alike_notes, at_temperature, error_line, ranked
from pneumo.fitting.fit_problem import ON_BOUND
from pneumo.fitting.fit_result import Estimate, FitResult, equally_good, fit_data
from pneumo.fitting.fit_warnings import (
    apart,
    disagreements,
    odd_values,
    residual_warnings,
    undetermined_notes,
)
from pneumo.fitting.least_squares import Solution, covariances
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.record.sensor_faults import noise_of
from pneumo.fitting.residuals import Residual, split_residuals
from pneumo.fitting.settings import PART
from pneumo.fitting.stage_signals import smoothed
from pneumo.physics.cylinder import Side, chamber_of, volume

REPORTED = ("n", "k_0", "k_0_A", "k_0_B", "V_d_A", "V_d_B", "leak", "T_A", "T_B")
HELD = ("wall heat, constant", "wall heat, area and root of PT")  # laws that differ where the piston is held
MOST_SAMPLES = 4000  # of a chamber in the sum of squares
SHUT, SELDOM = 0.02, 0.01  # command over its limit that is none; fraction of the samples that may exceed it
BLOCKS, VISIBLE = 20, 10.0  # of a record, and range of their mean pressures over its noise: one that changes
MOVED = 0.02  # standard deviation of ln V, above which the motion must show in the pressure:
OPEN = 0.1  # by its standard deviation of ln P over that of ln V, less in an open chamber
REVERSED = 0.5  # correlation of ln P and ln V, above which one of them has the wrong sign
REMEDY = "move the piston fast through much of its stroke, or compress fast and hold, with the valve shut"


def closed_record(measurement: Measurement, plant: Plant) -> ClosedRecord:
    """Record with a smoothed position."""
    c = plant.conditions
    gas = plant.gas
    cylinder = plant.cylinder
    t = measurement.t
    x = smoothed(t, measurement.x) + cylinder.stroke / 2
    size = (cylinder.A_A, cylinder.A_B), cylinder.bore, cylinder.stroke
    of_gas = gas.R, gas.gamma, c.T_amb, c.P_0 * c.T_0
    return ClosedRecord(measurement.name, t, x, measurement.P, *size, *of_gas)


def fit_closed(
    measurement: Measurement,
    plant: Plant,
    *,
    part: float = PART,
    check: bool = True,
    progress: Callable[[str], None] = lambda _text: None,
) -> FitResult:
    """Fit thermal laws to two closed chambers, as `pneumo.fit` describes.

    `InputError` if no chamber can be fitted: its pressure must change beyond its noise, and follow the piston
    if that moves. With `check`, also if chambers look swapped, or the command is not about zero.
    """
    plant = at_temperature(plant, measurement.T)
    record, at = closed_record(measurement, plant), plant.conditions
    chambers, notes = chambers_to_fit(record, plant, check)
    if check and (driven := float(np.mean(np.abs(measurement.u) > SHUT * plant.valve.u_max))) > SELDOM:
        raise InputError(
            f"{record.name}: column u: beyond {100 * SHUT:g} % of u_max in {100 * driven:.2g} % of samples:"
            " must be about zero in closed chambers; --closed-from names the time when the valve shuts,"
            " --trust skips this check"
        )
    if not record.moves:
        notes.append(
            "the piston is held: dead volumes are as configured, and k_0 is proportional to the volume"
        )
    notes.append(
        f"k_0 is at {at.P_0 / 1e3:.4g} kPa, {at.T_0:.5g} K and mid-stroke, by the law of the row; the wall is"
        f" taken to have {at.T_amb:.5g} K, and every k_0 scales with its inverse"
    )
    estimates: dict[str, Estimate] = {}
    residuals: dict[str, dict[str, Residual]] = {}
    fitted = round(part * (len(record.t) - 1)) + 1
    near: np.ndarray | None = None  # of the last law with wall heat
    for name in LAWS if record.moves else HELD:
        problem = problem_of_law(name, record, plant, fitted, chambers)
        best = problem.solve(near)
        near = best.theta if problem.law.explicit_heat else near
        estimates[name], residuals[name] = estimated(problem, best)
        progress(error_line(name, estimates[name]))
    estimates = ranked(estimates)
    return FitResult(
        data=fit_data(measurement, estimates, REPORTED).drop_vars(["u", "m"], errors="ignore"),
        notes=(*measurement.notes, *notes, *alike_notes(equally_good(estimates))),
        warnings=tuple(closed_warnings(estimates, residuals[next(iter(estimates))], plant)),
        held_out_from=float(measurement.t[fitted - 1]),
        closed=True,
    )


def chambers_to_fit(record: ClosedRecord, plant: Plant, check: bool) -> tuple[list[int], list[str]]:
    """Sides, 0 or 1, of the chambers that can be fitted, and notes on the others.

    `InputError` if none can be fitted, or, with `check`, if chambers look swapped.
    """
    chambers, reasons = list[int](), list[str]()
    for side, (P, length) in enumerate(zip(record.P, record.uncovered, strict=True)):
        chamber, name = chamber_of(plant.cylinder, side), f"P_{'AB'[side]}"
        log_P, log_V = np.log(P), np.log(chamber.V_d + chamber.area * length)
        motion = np.std(log_V)
        means = np.array([block.mean() for block in np.array_split(P, BLOCKS)])
        if np.ptp(means) <= VISIBLE * noise_of(P, residual=P) / np.sqrt(len(P) / BLOCKS):
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
    return chambers, [f"{why}: not fitted, but gas leaks past the piston to or from it" for why in reasons]


def problem_of_law(
    name: str, record: ClosedRecord, plant: Plant, fitted: int, chambers: Sequence[int]
) -> ClosedProblem:
    """Least squares of a law, with values that are typical of this plant."""
    cylinder = plant.cylinder
    law = LAWS[name]
    k_0 = default_conductance(plant.cylinder).k_0
    V = volume(0.0, chamber_of(cylinder, Side.A), cylinder)
    leak = V / (record.R * record.T_wall * record.t[-1])  # changes the mass in a chamber within the record
    absent = [f"_{side.name}" for side in Side if side not in chambers] + ["V_d"] * (not record.moves)
    names = (*fitted_names(law), *(("first_A", "first_B") if law.explicit_heat else ()))
    names = [name for name in names if not any(part in name for part in absent)]
    typical = {"V_d_A": cylinder.V_d_A, "V_d_B": cylinder.V_d_B, "leak": leak, "k_0_A": k_0, "k_0_B": k_0}
    return closed_problem(record, law, names, typical, fitted, max(1, fitted // MOST_SAMPLES), chambers)


def estimated(problem: ClosedProblem, best: Solution) -> tuple[Estimate, dict[str, Residual]]:
    """Estimate of a law from its best fit, with intervals, and its residuals by chamber.

    Residuals that noise does not explain are taken for the law's own error.
    """
    record = problem.record
    seen = list(problem.chambers)
    first = problem.fitted
    pressure = np.full_like(record.P, np.nan)
    pressure[seen] = problem.replay(best.theta, len(record.t))[seen]
    split = split_residuals(record.P[seen, :first], (record.P - pressure)[seen, :first], record.h)
    far = any(part.far_from_noise for part in split)
    low, high = problem.intervals(best, covariances(best, best.squares if far else 0.0))
    if "leak" in low:
        low["leak"] = np.nan_to_num(low["leak"])  # its search begins at zero
    values, low, high = (
        {name: numbers[name] for name in REPORTED if name in problem.scales}
        for numbers in (problem.values(best.theta), low, high)
    )
    # A configuration has one k_0: the geometric mean, weighted by the inverse variance, of those whose
    # interval has two ends, within an interval that contains both intervals.
    sides = [name for name in ("k_0_A", "k_0_B") if np.isfinite(low.get(name, np.nan) + high.get(name, 0.0))]
    if sides:
        weights = np.array([np.log(high[name] / low[name]) ** -2 for name in sides])
        logs = np.log([values[name] for name in sides])
        values["k_0"] = float(np.exp(weights @ logs / weights.sum()))
        low["k_0"], high["k_0"] = min(low[name] for name in sides), max(high[name] for name in sides)
    estimate = Estimate(values, low, high, *problem.errors(pressure), pressure)
    return estimate, {Side(side).name: part for side, part in zip(seen, split, strict=True)}


def closed_warnings(
    estimates: Mapping[str, Estimate], residuals: Mapping[str, Residual], plant: Plant
) -> list[str]:
    """Warnings of residuals of the best law, and of unlikely parameters.

    The parameters are those of the best law with wall heat, and n of the law "free n". `estimates` are by
    law, the best first; `residuals`, of the best law, are by chamber.
    """
    wall = next(estimate for law, estimate in estimates.items() if LAWS[law].explicit_heat)
    least = BOUNDS["V_d"][0] * (1 + ON_BOUND)
    volumes = {name: getattr(plant.cylinder, name) for name in ("V_d_A", "V_d_B") if name in wall.values}
    at_bound = [name for name, V_d in volumes.items() if wall.values[name] < least * V_d]
    free = {"n": estimates["free n"].values["n"]} if "free n" in estimates else {}
    meaning = "no n describes wall heat and leakage of this record"
    result = residual_warnings(next(iter(estimates)), residuals)
    result += odd_values(wall.values | free, at_bound, plant, meaning=meaning)
    result += undetermined_notes(wall, ("k_0_A", "k_0_B", *volumes), REMEDY)
    ends = [(wall.low[name], wall.high[name]) for name in ("k_0_A", "k_0_B") if name in wall.low]
    if ends and apart(ends):
        result.append(
            "the intervals of k_0 of A and of B do not overlap, and a configuration has one k_0:"
            " `fitted.yaml` gets their mean, with an interval that contains both"
        )
    return result + disagreements(estimates, ("k_0_A", "k_0_B"))
