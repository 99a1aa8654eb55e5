"""Mistakes that no single column shows: chambers swapped, a wrong sign, gauge for absolute pressure."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.engineer.fit_parameters import Problem
from pneumo.engineer.least_squares import fit
from pneumo.engineer.record import Measurement
from pneumo.engineer.stage_signals import stage_signals
from pneumo.errors import InputError
from pneumo.physics.models import MODELS

SECONDS = 4.0  # of the record are enough to see a mistake
BETTER = 0.5  # rms error with a column corrected over that as given, below which a mistake is likelier
MODEL, INDEX = "M6", 1.2  # needs no k_0


class Mistake(NamedTuple):
    """A way to confuse columns: the text for the user, and the correction.

    `correct` takes a measurement and the atmosphere's pressure, Pa, and returns the measurement without the
    mistake, or None where it cannot have been made.
    """

    text: str
    correct: Callable[[Measurement, float], Measurement | None]


MISTAKES = (
    Mistake(
        "columns P_A and P_B look swapped (or u and x both have the wrong sign)",
        lambda m, _: m._replace(P=m.P[::-1]),
    ),
    Mistake(
        "column u seems to have the wrong sign: positive connects chamber A to the supply",
        lambda m, _: m._replace(u=-m.u) if m.m is None else None,
    ),
    Mistake(
        "columns m_A and m_B seem to have the wrong sign: positive flows into the chamber",
        lambda m, _: None if m.m is None else m._replace(m=-m.m),
    ),
    Mistake(
        "columns m_A and m_B look swapped",
        lambda m, _: None if m.m is None else m._replace(m=m.m[::-1]),
    ),
    Mistake(
        "column x seems to have the wrong sign: chamber A is largest where x is",
        lambda m, _: m._replace(x=-m.x),
    ),
    Mistake(
        "columns P_A and P_B seem to be gauge pressures: a gauge's unit is written bar(g) or kPa(g)",
        lambda m, P_atm: m._replace(P=m.P + P_atm),
    ),
)


def quick_fit_error(measurement: Measurement, plant: Plant, held: bool) -> float:
    """Root mean square error of a quick fit of valve coefficient and dead volumes, Pa."""
    last = min(len(measurement.u), round(SECONDS / measurement.period) + 1)
    u, x, P = measurement.u[:last], measurement.x[:last], measurement.P[:, :last]
    m = None if measurement.m is None else measurement.m[:, :last]
    record = stage_signals(measurement.period, u, x, P, plant.valve.u_max, held=held, m=m)
    quick = fit(Problem(MODELS[MODEL], plant, record, {"n": INDEX}), tolerance=1e-3, most=8)
    return plant.conditions.P_s * float(np.sqrt(np.mean(quick.residual**2)))


def check_columns(measurement: Measurement, plant: Plant, *, held: bool = True) -> None:
    """Refuse a measurement that a model follows far better with its columns corrected.

    Raises
    ------
    InputError
        With one line that names the mistake and both errors.
    """
    as_given = quick_fit_error(measurement, plant, held)
    corrected = {
        mistake.text: quick_fit_error(right, plant, held)
        for mistake in MISTAKES
        if (right := mistake.correct(measurement, plant.conditions.P_atm)) is not None
    }
    best = min(corrected, key=lambda text: corrected[text])
    if corrected[best] < BETTER * as_given:
        raise InputError(
            f"{measurement.name}: {best}: a quick fit of {MODEL} is off by"
            f" {corrected[best] / 1e3:.3g} kPa then, and by {as_given / 1e3:.3g} kPa as it is;"
            " --trust skips this check"
        )
