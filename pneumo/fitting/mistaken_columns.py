"""Mistakes that no single column shows: chambers swapped, a wrong sign, gauge for absolute pressure."""

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.configuration.sampling import HELD, Sampling
from pneumo.errors import InputError
from pneumo.fitting.fit_problem import Problem, fit
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.settings import BETTER
from pneumo.fitting.stage_signals import StageSignals, stage_signals
from pneumo.physics.models import MODELS

SECONDS = 4.0  # of the record are enough to see a mistake
MODEL, INDEX = "M6", 1.2  # needs no k_0


def corrected(s: StageSignals, P_atm: float) -> dict[str, StageSignals]:
    """Signals corrected for one mistake each, by the message that names it."""
    sign = "seems to have the wrong sign:"
    result = {
        "columns P_A and P_B look swapped (or u and x both have the wrong sign)": s._replace(P=s.P[::-1]),
        f"column x {sign} chamber A is largest where x is": s._replace(motion=-s.motion),
    }
    if s.flow is None:
        result[f"column u {sign} positive connects chamber A to the supply"] = s._replace(u=-s.u)
    else:
        opposite = "seem to have the wrong sign: positive flows into the chamber"
        result[f"columns m_A and m_B {opposite}"] = s._replace(flow=-s.flow)
        result["columns m_A and m_B look swapped"] = s._replace(flow=s.flow[..., ::-1])
    gauge = (
        "columns P_A and P_B seem to be gauge pressures (write their unit as bar(g) or kPa(g)),"
        " or P_s_Pa is an atmosphere too high"
    )
    return result | {gauge: s._replace(P=s.P + P_atm)}


def quick_fit_error(signals: StageSignals, plant: Plant) -> float:
    """Root mean square error of a quick fit of valve coefficient and dead volumes, Pa."""
    quick = fit(Problem(MODELS[MODEL], plant, signals, {"n": INDEX}), tolerance=1e-3, most=8)
    return plant.conditions.P_s * float(np.sqrt(np.mean(quick.residual**2)))


def mistake(measurement: Measurement, plant: Plant, *, command: Sampling = HELD) -> str:
    """Sentence on the likeliest mistake in the columns; empty if no correction makes the fit far better."""
    signals = stage_signals(measurement.part(0, round(SECONDS / measurement.period)), plant, command)
    as_given = quick_fit_error(signals, plant)
    candidates = corrected(signals, plant.conditions.P_atm).items()
    error, best = min((quick_fit_error(right, plant), text) for text, right in candidates)
    if error >= BETTER * as_given:
        return ""
    return (
        f"{measurement.name}: {best}: a quick fit of {MODEL} is then off by {error / 1e3:.3g} kPa RMS,"
        f" and by {as_given / 1e3:.3g} kPa as the columns are"
    )


def check_columns(measurement: Measurement, plant: Plant, *, command: Sampling = HELD) -> None:
    """Raise an `InputError` if a model follows a measurement far better with a column corrected."""
    if text := mistake(measurement, plant, command=command):
        raise InputError(f"{text}; --trust skips this check")
