"""Checks of zero and scale of the position, and of the stroke, by end stops and configured dead volumes.

A fit compensates for a wrong zero or stroke by other dead volumes, and for a wrong scale by another valve and
k_0 too (decision 90), so residuals show none of these errors. A piston that rests on its stops shows them,
and so do dead volumes that somebody measured.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import DEAD_FRACTION
from pneumo.configuration.priors import Accuracy
from pneumo.fitting.fit_result import Estimate, FitWarning
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.record.sensor_faults import noise_of
from pneumo.fitting.settings import MOVED, SURE

PUSHED = 0.5  # force on the piston over the largest, with which one that rests is on a stop
RESTS = 0.05  # s, for which it rests
STILL, STILL_NOISE = 2e-3, 6.0  # of the stroke, or of the noise in x, within which it stays then
AT_END = 0.02  # of the stroke, from the outermost x
LEAST_FORCE = 0.1  # of the largest, on a piston that has come to a stop and is pushed on harder later
LEAST_NOISE = 1e-7  # m, in a position; that of a simulated record is none
GIVES = 1e-4  # m, accuracy with which forces on a resting piston must show how far its stop gives way
MM, CM3 = 1e3, 1e6  # per m and per m^3


def stops_of(record: Measurement, plant: Plant) -> tuple[float, float]:
    """Positions of the two stops that a record shows, m, extrapolated to zero force.

    They are NaN where the piston never rests under force. Zero force, since buffers give way by a
    millimetre under pressure.
    """
    c, x = plant.cylinder, record.x
    samples = max(2, round(RESTS / record.period))
    span = maximum_filter1d(x, samples) - minimum_filter1d(x, samples)
    still = span < max(STILL * c.stroke, STILL_NOISE * noise_of(x, x))
    force = c.A_A * record.P[0] - c.A_B * record.P[1] + c.load
    largest = (plant.conditions.P_s - plant.conditions.P_atm) * min(c.A_A, c.A_B)
    ends = x < x.min() + AT_END * c.stroke, x > x.max() - AT_END * c.stroke
    found: list[float] = []
    for at, outward in zip(ends, (-force, force), strict=True):
        rests = still & at & (outward > LEAST_FORCE * largest)
        pushed = np.any(still & at & (outward > PUSHED * largest))
        found.append(contact(x[rests], force[rests]) if pushed else np.nan)
    return found[0], found[1]


def contact(x: np.ndarray, force: np.ndarray) -> float:
    """Position of a stop without force, m, from positions x, m, of a resting piston and the forces on it, N.

    If the forces hardly differ, the stop is assumed to be rigid.
    """
    spread = float(force.std())
    if spread * len(x) ** 0.5 * GIVES < max(noise_of(x, x), LEAST_NOISE) * np.abs(force).max():
        return float(np.median(x))
    given = max(float(np.polyfit(force, x, 1)[0]), 0.0)  # m/N
    return float(np.median(x - given * force))


def stop_warnings(
    record: Measurement, plant: Plant, known: Accuracy, estimate: Estimate | None = None
) -> list[str]:
    """Warning of stops that are not at their configured positions, with the effect on dead volumes.

    It concerns these, and what else of the `estimate` such an error moves out of its interval.
    """
    c, stops = plant.cylinder, (plant.cylinder.x_min, plant.cylinder.x_max)
    found = np.array(stops_of(record, plant))
    off = found - stops
    if np.isnan(off).all():
        return []
    largest = float(np.nanmax(np.abs(off)))
    moved = {side: largest * area / V for side, area, V in _sides(plant)}
    expected = np.linalg.norm([known["x_zero"], known["stroke"] / 2, known["x_scale"] * c.stroke / 2])
    if largest <= SURE * expected or max(moved.values()) <= MOVED:
        return []
    at, configured = (" and ".join(f"{MM * x:.4g}" for x in xs if np.isfinite(x)) for xs in (found, stops))
    reason = "a wrong zero or scale of x, or stroke"
    zero, longer = float(np.nanmean(off)), 0.0
    if np.isfinite(off).all():
        longer = float(off[1] - off[0])
        reason = reason_of(zero, longer, c.stroke)
    concerned = {f"V_d_{side}": None for side, *_ in _sides(plant)}
    if estimate is not None:
        parts = {
            "the zero of x": (zero, known["x_zero"]),
            "the scale of x": (longer / c.stroke, known["x_scale"]),
        }
        times = {name: error / stated for name, (error, stated) in parts.items() if stated}
        concerned |= dict.fromkeys(estimate.moved_out(times))
    effect = ", ".join(f"V_d of {side} by {100 * part:.0f} %" for side, part in moved.items())
    text = f"the piston rests at {at} mm (stops configured: {configured} mm): {reason}; this moves {effect}"
    return [FitWarning(text, *concerned)]


def stated_volume_warnings(plant: Plant, estimate: Estimate, known: Accuracy, stops_shown: bool) -> list[str]:
    """Warning of fitted dead volumes beyond the accuracy of the configured ones, with a possible reason.

    Where the record shows both stops, zero and scale of x are right: only the data sheet can be wrong.
    """
    names = [f"V_d_{side}" for side, *_ in _sides(plant)]
    areas, configured = np.array([sizes for _, *sizes in _sides(plant)]).T
    values, low, high = (
        np.array([numbers.get(name, np.nan) for name in names])
        for numbers in (estimate.values, estimate.low, estimate.high)
    )
    ratios = values / configured
    stated_within = np.log1p([known["V_d_A"], known["V_d_B"]])
    off = np.abs(np.log(ratios)) > np.hypot(np.log(high / low) / 2, stated_within)
    if not off.any():
        return []
    text = f"the dead volumes of A and B are {ratios[0]:.2g} and {ratios[1]:.2g} times those configured"
    if stops_shown:
        percent = 100 * np.abs(ratios - 1).max()
        text += f": the data sheet is off by {percent:.0f} %, or hoses are not included"
    else:
        A, B = ((values - configured) / areas).tolist()
        reason = reason_of((B - A) / 2, A + B, plant.cylinder.stroke)
        text += f", as {reason} would make them, or hoses: a record in which the piston rests on both stops"
        text += " shows which"
    return [FitWarning(text, *np.array(names)[off].tolist())]


def position_shown(record: Measurement, plant: Plant) -> bool:
    """Whether stops or configured dead volumes show a wrong zero or scale of x, or stroke."""
    return stated(plant) or bool(np.isfinite(stops_of(record, plant)).all())


def dead_volume_notes(record: Measurement, plant: Plant, known: Accuracy) -> list[str]:
    """Note on a record that cannot show a wrong zero or scale of x, or stroke."""
    if position_shown(record, plant):
        return []
    each = ", ".join(f"V_d of {side} by {area * CM3 / MM:.2g} cm³" for side, area, _ in _sides(plant))
    return [
        "a wrong zero or scale of x, or stroke, would not show: no dead volumes are configured, and the"
        f" piston does not rest on both stops; 1 mm of zero moves {each}, and intervals allow for"
        f" {MM * known['x_zero']:g} mm and {100 * known['x_scale']:g} % of scale (section sensors)"
    ]


def stated(plant: Plant) -> bool:
    """Whether dead volumes are configured, and not a configuration's default."""
    c = plant.cylinder
    default = DEAD_FRACTION * c.A_A * c.stroke / 2
    return not np.allclose([c.V_d_A, c.V_d_B], default, rtol=1e-9, atol=0.0)


def reason_of(zero: float, longer: float, stroke: float) -> str:
    """Text on the error of the position that explains an offset `zero` or a change of length `longer`, m."""
    if 2 * abs(zero) > abs(longer):
        return f"a zero of x off by {MM * zero:.2g} mm"
    length, part = MM * abs(longer), 100 * abs(longer) / stroke
    long, large = ("short", "large") if longer > 0 else ("long", "small")
    return f"a stroke {length:.2g} mm too {long} or an x {part:.2g} % too {large}"


def _sides(plant: Plant) -> tuple[tuple[str, float, float], ...]:
    """Chamber, its piston area, m^2, and its configured dead volume, m^3, for A and B."""
    c = plant.cylinder
    return ("A", c.A_A, c.V_d_A), ("B", c.A_B, c.V_d_B)
