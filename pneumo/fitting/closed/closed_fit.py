"""Thermal laws fitted to a measurement of closed chambers, with a piston that moves or is held.

Pressures give the gas's temperature only as a ratio to the wall's, which is measured or configured: all
conductances are inversely proportional to the wall's temperature. `k_0_A` is the law's conductance at P_0,
T_0 and in mid-stroke, where configurations state it. The law "wall heat, area and root of PT" is that of the
full order.
"""

from collections.abc import Callable, Sequence

import numpy as np

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.fitting.closed.closed_checks import check_closed, closed_warnings
from pneumo.fitting.closed.closed_problem import LAWS, ClosedProblem, ClosedRecord, fitted_names
from pneumo.fitting.engine import Solution, covariances
from pneumo.fitting.estimate import alike_notes, at_temperature, error_line, ranked
from pneumo.fitting.fit_result import Estimate, FitResult, equally_good, fit_data
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.residuals import Residual, split_residuals
from pneumo.fitting.settings import LARGEST_MOTION, PART
from pneumo.fitting.stage_signals import smoothed
from pneumo.physics.cylinder import Side, chamber_of, volume

REPORTED = ("n", "k_0", "k_0_A", "k_0_B", "V_d_A", "V_d_B", "leak", "T_A", "T_B")
HELD = ("wall heat, constant", "wall heat, area and root of PT")  # laws that differ where the piston is held
MOST_SAMPLES = 4000  # of a chamber in the sum of squares


def closed_record(measurement: Measurement, plant: Plant) -> ClosedRecord:
    """Record with a smoothed position."""
    c, gas, cylinder, t, x = plant.conditions, plant.gas, plant.cylinder, measurement.t, measurement.x
    x, areas = smoothed(t, x) + cylinder.stroke / 2, (cylinder.A_A, cylinder.A_B)
    size = areas, cylinder.bore, cylinder.stroke
    return ClosedRecord(
        measurement.name, t, x, measurement.P, *size, gas.R, gas.gamma, c.T_amb, c.P_0 * c.T_0
    )


def moves(record: ClosedRecord) -> bool:
    """Whether the piston moves, so that dead volumes can be fitted."""
    return float(np.ptp(record.x)) > LARGEST_MOTION * record.stroke


def fit_closed(
    measurement: Measurement,
    plant: Plant,
    *,
    part: float = PART,
    check: bool = True,
    progress: Callable[[str], None] = lambda _text: None,
) -> FitResult:
    """Fit thermal laws to two closed chambers.

    Parameters
    ----------
    part
        Fraction of the record that is fitted; one run from the first sample predicts the rest.
    check
        Whether to refuse chambers that look swapped, and a command that is not about zero.
    progress
        Is called with a line after each law.

    Raises
    ------
    InputError
        If no chamber can be fitted: its pressure must change beyond its noise, and follow the piston if that
        moves. Also if `check` refuses the record.
    """
    plant = at_temperature(plant, measurement.T)
    record = closed_record(measurement, plant)
    chambers, notes = check_closed(record, plant, measurement, check)
    if not moves(record):
        notes.append(
            "the piston is held: dead volumes are as configured, and k_0 is proportional to the volume"
        )
    at = plant.conditions
    notes.append(
        f"k_0 is at {at.P_0 / 1e3:.4g} kPa, {at.T_0:.5g} K and mid-stroke, by the law of the row; the wall is"
        f" taken to have {at.T_amb:.5g} K, and every k_0 scales with its inverse"
    )
    estimates: dict[str, Estimate] = {}
    residuals: dict[str, dict[str, Residual]] = {}
    fitted = round(part * (len(record.t) - 1)) + 1
    near: np.ndarray | None = None  # of the last law with wall heat
    for name in LAWS if moves(record) else HELD:
        problem = closed_problem(name, record, plant, fitted, chambers)
        best = problem.solve(near)
        if problem.law.explicit_heat:
            near = best.theta
        estimates[name], residuals[name] = estimated(problem, best)
        progress(error_line(name, estimates[name]))
    estimates = ranked(estimates)
    data = fit_data(measurement, estimates, REPORTED)
    return FitResult(
        data=data.drop_vars(["u", "m"], errors="ignore"),
        notes=(*measurement.notes, *notes, *alike_notes(equally_good(estimates))),
        warnings=tuple(closed_warnings(estimates, residuals, plant)),
        held_out_from=float(measurement.t[fitted - 1]),
        of="closed",
    )


def closed_problem(
    name: str, record: ClosedRecord, plant: Plant, fitted: int, chambers: Sequence[int]
) -> ClosedProblem:
    """Least squares of a law, with parameters scaled to typical values of this plant."""
    cylinder, law, k = plant.cylinder, LAWS[name], default_conductance(plant.cylinder).k_0
    V = volume(0.0, chamber_of(cylinder, Side.A), cylinder)
    leak = V / (record.R * record.T_wall * record.t[-1])  # changes the mass in a chamber within the record
    absent = [f"_{side.name}" for side in Side if side not in chambers]
    absent += [] if moves(record) else ["V_d"]
    names = (*fitted_names(law), *(("first_A", "first_B") if law.explicit_heat else ()))
    return ClosedProblem(
        record=record,
        law=law,
        names=tuple(name for name in names if not any(part in name for part in absent)),
        fitted=fitted,
        scales={"V_d_A": cylinder.V_d_A, "V_d_B": cylinder.V_d_B, "leak": leak, "k_A": k, "k_B": k},
        every=max(1, fitted // MOST_SAMPLES),
        chambers=tuple(chambers),
    )


def estimated(problem: ClosedProblem, best: Solution) -> tuple[Estimate, dict[str, Residual]]:
    """Estimate of a law from its best fit, with intervals, and its residuals by chamber.

    Residuals that noise does not explain are taken for the law's own error.
    """
    record, seen, first = problem.record, list(problem.chambers), problem.fitted
    pressure = np.full_like(record.P, np.nan)
    pressure[seen] = problem.replay(best.theta, len(record.t))[seen]
    residual = (record.P - pressure)[seen, :first]
    split = split_residuals(record.P[seen, :first], residual, record.h)
    far = any(part.far_from_noise for part in split)
    both = covariances(best, best.squares if far else 0.0)
    values = problem.values(best.theta)
    low, high = problem.intervals(best, both)
    if "leak" in low:
        low["leak"] = np.nan_to_num(low["leak"])  # its search begins at zero
    # Fitted parameter, and factor from it, by reported name.
    reported: dict[str, tuple[str, float]] = {name: (name, 1.0) for name in REPORTED if name in low}
    if problem.law.explicit_heat:
        for side in (Side(side).name for side in seen):
            reported[f"k_0_{side}"], reported[f"T_{side}"] = (
                (f"k_{side}", 1.0),
                (f"start_{side}", record.T_wall),
            )
    values, low, high = (
        {name: factor * numbers[fitted] for name, (fitted, factor) in reported.items()}
        for numbers in (values, low, high)
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
