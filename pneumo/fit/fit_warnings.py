"""When not to believe a fit: warnings that name the cause, or at least the symptom.

Judged is the full-order fit where there is one, else the best reduced model. If the full order follows a
record down to the sensors' noise, its parameters are those of the rig; a reduced model's also make up for
what that model lacks. So what the full order leaves tells whether rig and configuration are as assumed.
Limits were chosen on benches that `make fit-bench` does not judge.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pneumo.fit.fitted_parameters import CAUSES, FULL, PARAMETERS, Problem, replayed_pressures
from pneumo.fit.least_squares import fit
from pneumo.fit.stage_signals import smoothing

if TYPE_CHECKING:
    from pneumo.fit.estimate import Estimate

BLOCK = 0.02  # s, over which white noise averages out
COLOURED = 0.4  # rms of what is left and not white, over the sensor's noise, that noise does not explain
FAR = 1.0  # the same, beyond which intervals mean nothing
EXPLAINED = 0.5  # rms with a cause over that without, below which the cause is named
STEPS = 15  # of a search for a cause
ON_BOUND = 0.01  # of the distance between the bounds
VAGUE = 3.0  # upper over lower end of an interval that says little
UNLIKELY = 2.0  # factor between a dead volume found and the configured one
AS_GOOD = 1.05  # error on the part held out over the lowest, up to which models are equally good
EARLY = 0.1  # samples by which a valve may act before its command: no clock is better
BEYOND = 0.02  # of n outside 1..gamma that noise explains
NAMES = {
    "k_0": "k_0",
    "k_xu": "the valve coefficient",
    "V_d_A": "the dead volume of A",
    "V_d_B": "the dead volume of B",
    "dead_time": "the valve's dead time",
    "lag": "the valve's lag",
    "null": "the valve's null offset",
    "n": "n",
    **{f"k_0_{c}": f"k_0 of {c}" for c in "AB"},
    "P_s": "the supply pressure",
    "exhaust": "the exhaust path",
    "A_B": "the piston area of B",
    **{f"offset_{c}": f"the offset of the sensor of P_{c}" for c in "AB"},
    **{f"start_{c}": f"the first pressure of {c}" for c in "AB"},
    **{f"start_T_{c}": f"the first temperature of {c}" for c in "AB"},
}
EXPLANATIONS = {
    "P_s": "a supply of {:.4g} kPa (configured: {:.4g})",
    "exhaust": "an exhaust path of {:.3g} times the area of the supply's (configured: {:.3g})",
    "A_B": "a piston area of {:.4g} mm² in chamber B (configured: {:.4g}; is the rod right?)",
    "offset_A": "a sensor of P_A that is off by {:.3g} kPa",
    "offset_B": "a sensor of P_B that is off by {:.3g} kPa",
}
FACTORS = {"P_s": 1e-3, "exhaust": 1.0, "A_B": 1e6, "offset_A": 1e-3, "offset_B": 1e-3}
CLOSED_TEST = "take k_0 from a closed-chamber test (pneumo fit --closed)"


class Remainder(NamedTuple):
    """What a fit leaves of one pressure, Pa."""

    rms: float
    coloured: float  # rms of the part that neither white noise nor noise in the position explains
    noise: float  # of the sensor

    @property
    def unexplained(self) -> bool:
        """Whether the sensors' noise does not explain it."""
        return self.coloured > COLOURED * self.noise


def block_means(signal: np.ndarray, length: int) -> np.ndarray:
    """Means over blocks of `length` samples along the last axis; a shorter rest is left out."""
    count = signal.shape[-1] // length
    return signal[..., : count * length].reshape(*signal.shape[:-1], count, length).mean(axis=-1)


def remainders(problem: Problem, theta: np.ndarray) -> list[Remainder]:
    """What a fit leaves of the pressures of A and B.

    Its mean square over blocks is compared with what white noise and replays with added noise would give.
    """
    s = problem.signals
    left = s.P - replayed_pressures(problem, theta[None])[0, 0]
    if problem.noisy is None:
        return what_is_left(s.P, left, s.period, np.empty((0, *left.shape)))
    noisy = replayed_pressures(problem, theta[None], problem.noisy)[:, 0]
    return what_is_left(s.P, left, s.period, noisy)


def what_is_left(P: np.ndarray, left: np.ndarray, period: float, noisy: np.ndarray) -> list[Remainder]:
    """Split what a fit leaves of the pressures P, Pa, by (chamber, sample), into noise and the rest.

    `noisy` are replays with added noise in the position, by (replay, chamber, sample), or none.
    """
    length = max(1, round(BLOCK / period))
    spread = np.zeros(2)
    if len(noisy):
        spread = np.nan_to_num(np.mean(block_means(noisy - noisy.mean(axis=0), length) ** 2, axis=(0, 2)))
    result: list[Remainder] = []
    for side in range(len(P)):
        _, noise = smoothing(P[side], period)
        excess = float(np.mean(block_means(left[side], length) ** 2)) - noise**2 / length - spread[side]
        rms = float(np.sqrt(np.mean(left[side] ** 2)))
        result.append(Remainder(rms, float(np.sqrt(max(excess, 0.0))), noise))
    return result


def far_from_noise(problem: Problem, theta: np.ndarray) -> bool:
    """Whether a fit leaves so much that no interval would mean anything."""
    return any(one.coloured > FAR * one.noise for one in remainders(problem, theta))


def record_doubts(problem: Problem, found: "Estimate") -> list[str]:
    """Warn of what a fit leaves beside noise, and of the cause or else of each odd parameter."""
    theta, name = problem.inner(found.values), problem.model.name
    left = remainders(problem, theta)
    symptoms = unexplained_texts(name, dict(zip("AB", left, strict=True)))
    named = causes(problem, left) if symptoms and name == FULL.name else []
    # With a wrong rig all parameters are odd: its cause says more.
    return symptoms + (named or parameter_doubts(problem, found))


def unexplained_texts(name: str, left: Mapping[str, Remainder]) -> list[str]:
    """Warn of what a model leaves of the pressures, by chamber, where noise does not explain it."""
    return [
        f"P_{chamber}: {name} leaves {one.rms / 1e3:.3g} kPa, of which {one.coloured / 1e3:.2g} kPa are not"
        f" noise; the sensor's noise is {one.noise / 1e3:.2g} kPa: something in rig, record or configuration"
        " is not as assumed, and no parameter here is to be trusted"
        for chamber, one in left.items()
        if one.unexplained
    ]


def causes(problem: Problem, left: list[Remainder]) -> list[str]:
    """Name what would explain most of what a full-order fit leaves: one of `CAUSES`, fitted too."""
    before = float(np.sqrt(np.mean([one.rms**2 for one in left])))
    best, text = EXPLAINED * before, ""
    known = problem.free if problem.signals.P_s is None else (*problem.free, "P_s")
    for cause in (one for one in CAUSES if one not in known):
        trial = problem._replace(noisy=None, free=(*problem.free, cause))
        found = fit(trial, tolerance=1e-3, most=STEPS)
        after = problem.plant.conditions.P_s * float(np.sqrt(np.mean(found.residual**2)))
        if after < best:
            factor, configured = FACTORS[cause], trial.guess()[trial.names.index(cause)]
            numbers = trial.values(found.theta)[cause], PARAMETERS[cause].outer(configured)
            best, why = after, EXPLANATIONS[cause].format(*(factor * number for number in numbers))
            text = f"{why} would bring what is left from {before / 1e3:.3g} to {after / 1e3:.3g} kPa"
            text += f" (--also {cause} fits it)"
    return [text] if text else []


def parameter_doubts(problem: Problem, found: "Estimate") -> list[str]:
    """Warn of parameters on a bound, without a narrow interval, or unlikely for this cylinder."""
    result: list[str] = []
    values, low, high = found.values, found.low, found.high
    cylinder, gamma = problem.plant.cylinder, problem.plant.gas.gamma
    ends = problem.bounds().T
    for name, theta, (least, most) in zip(problem.names, problem.inner(values), ends, strict=True):
        margin = ON_BOUND * (most - least)
        free = name == "lag" and theta < most - margin  # no lag is no doubt
        if not (least + margin < theta < most - margin or free):
            result.append(f"{NAMES[name]} is on the bound of the search: {_shown(name, values)}")
        elif PARAMETERS[name].logarithmic and name in low:
            width = high[name] / low[name]
            if not width < VAGUE:
                remedy = (
                    f": {CLOSED_TEST}" if name == "k_0" else ": excite the cylinder more, or record longer"
                )
                result.append(f"this record does not determine {NAMES[name]}{remedy}")
        if name.startswith("V_d"):
            result += unlikely_dead_volume(name, values[name] / getattr(cylinder, name))
        if name == "dead_time" and high.get(name, np.nan) < -EARLY * problem.signals.period:
            result.append(
                "the valve acts before its command was logged: was the command held between samples"
                " (--command linear), is its time stamp right?"
            )
        if name == "n" and not 1 - BEYOND < values[name] < gamma + BEYOND:
            result.append(f"n = {values[name]:.3g} is outside 1 to {gamma:g}: no gas does this")
    return result


def unlikely_dead_volume(name: str, ratio: float) -> list[str]:
    """Warn of a dead volume that is far from the configured one, by its ratio to that."""
    if 1 / UNLIKELY < ratio < UNLIKELY:
        return []
    return [
        f"{NAMES[name]} comes out as {ratio:.2g} times the configured one:"
        " is the stroke right, is the zero of x, is there a hose?"
    ]


def _shown(name: str, values: dict[str, float]) -> str:
    return f"{values[name]:.3g} {PARAMETERS[name].unit}"


def equally_good(fits: "dict[str, Estimate]") -> list[str]:
    """Models whose error on the part held out is the lowest, or hardly larger."""
    errors = {name: float(np.sqrt(np.nanmean(found.held_out**2))) for name, found in fits.items()}
    return [name for name, error in errors.items() if error <= AS_GOOD * min(errors.values())]


def disagreements(fits: "dict[str, Estimate]", parameters: Sequence[str] = ("k_0", "k_xu")) -> list[str]:
    """Warn of `equally_good` models whose intervals of k_0, or of the valve's coefficient, lie apart."""
    result: list[str] = []
    good = equally_good(fits)
    for parameter in parameters:
        ends = {
            name: (
                np.nan_to_num(fits[name].low[parameter], nan=-np.inf),
                np.nan_to_num(fits[name].high[parameter], nan=np.inf),
            )
            for name in good
            if parameter in fits[name].low
        }
        if ends and max(low for low, _ in ends.values()) > min(high for _, high in ends.values()):
            remedy = f": {CLOSED_TEST}" if parameter == "k_0" else ""
            result.append(
                f"{', '.join(ends)} are equally good, but their intervals of {NAMES[parameter]} lie"
                f" apart{remedy}"
            )
    return result
