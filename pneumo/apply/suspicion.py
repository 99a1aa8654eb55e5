"""Mistakes that no single column shows: chambers swapped, a wrong sign, gauge for absolute pressure."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pneumo.apply.errors import ApplyError
from pneumo.apply.fitting import Problem, fit
from pneumo.apply.measurement import Measurement
from pneumo.apply.signals import signals
from pneumo.physics.experiment import Plant
from pneumo.physics.models import MODELS

SECONDS = 4.0  # of the record are enough to tell
BETTER = 0.5  # rms error over that of the signals as they are, below which a mistake is likelier
MODEL, INDEX = "M6", 1.2  # needs no k_0


class Mistake(NamedTuple):
    """How signals may have been confused.

    Attributes
    ----------
    text : str
        What the user is told.
    mend : callable
        From a measurement and the atmosphere's pressure to the measurement without the mistake.
    """

    text: str
    mend: Callable[[Measurement, float], Measurement]


MISTAKES = (
    Mistake(
        "columns P_A and P_B look swapped (or u and x both have the wrong sign)",
        lambda m, P_atm: m._replace(P=m.P[::-1]),
    ),
    Mistake(
        "column u seems to have the wrong sign: positive connects chamber A to the supply",
        lambda m, P_atm: m._replace(u=-m.u),
    ),
    Mistake(
        "column x seems to have the wrong sign: chamber A is largest where x is",
        lambda m, P_atm: m._replace(x=-m.x),
    ),
    Mistake(
        "columns P_A and P_B seem to be gauge pressures: a gauge's unit is written bar(g) or kPa(g)",
        lambda m, P_atm: m._replace(P=m.P + P_atm),
    ),
)


def misfit(measurement: Measurement, plant: Plant, held: bool) -> float:
    """Root mean square error of a quick fit of valve coefficient and dead volumes, Pa."""
    last = min(len(measurement.u), round(SECONDS / measurement.period) + 1)
    u, x, P = measurement.u[:last], measurement.x[:last], measurement.P[:, :last]
    record = signals(measurement.period, u, x, P, plant.valve.u_max, held=held)
    found = fit(Problem(MODELS[MODEL], plant, record, {"n": INDEX}), tolerance=1e-3, most=8)
    return plant.conditions.P_s * float(np.sqrt(np.mean(found.residual**2)))


def suspect(measurement: Measurement, plant: Plant, *, held: bool = True) -> None:
    """Refuse a measurement that makes far more sense with its columns put right.

    Raises
    ------
    ApplyError
        With one line that names the mistake and both errors.
    """
    as_it_is = misfit(measurement, plant, held)
    mended = [misfit(m.mend(measurement, plant.conditions.P_atm), plant, held) for m in MISTAKES]
    best = int(np.argmin(mended))
    if mended[best] < BETTER * as_it_is:
        raise ApplyError(
            f"{measurement.name}: {MISTAKES[best].text}: a quick fit of {MODEL} is off by"
            f" {mended[best] / 1e3:.3g} kPa then, and by {as_it_is / 1e3:.3g} kPa as it is;"
            " --trust skips this check"
        )
