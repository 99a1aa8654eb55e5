"""Random cylinders drawn from stated ranges, for the map of regimes and for trials of the fit."""

from collections.abc import Callable, Mapping
from math import pi
from typing import NamedTuple, TypeAlias

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Cylinder, heat_area
from pneumo.selection.plants import plant

U_MAX = 10.0  # V

Draw: TypeAlias = Callable[[np.random.Generator], float]


class Size(NamedTuple):
    """Bore and stroke, m, and the rod's area, m^2."""

    bore: float
    stroke: float
    rod_area: float


class Ranges(NamedTuple):
    """Ranges that a cylinder is drawn from; the map of regimes and the trials of the fit have their own."""

    size: Callable[[np.random.Generator], Size]
    #: In this order: ``P_s``, absolute supply pressure, Pa; ``speed`` at full command, m/s; ``dead`` volume
    #: over half the stroke's; ``acceleration``, m/s^2; ``viscous`` and (left out: none) ``coulomb`` friction
    #: at that speed over the reference force; ``lambda_0``, W/(m^2 K).
    draws: Mapping[str, Draw]
    strokes_per_second: float  #: limit of the speed
    reference_force: float  #: over the supply pressure on the bore's area
    accelerating_force: float  #: over the reference force; it gives the mass the drawn acceleration
    P_atm: float  #: Pa


def log_uniform(low: float, high: float) -> Draw:
    """Return a function of a generator that draws log-uniformly, `low` to `high`."""
    return lambda rng: float(np.exp(rng.uniform(*np.log((low, high)))))


def uniform(low: float, high: float) -> Draw:
    """Return a function of a generator that draws uniformly, `low` to `high`."""
    return lambda rng: rng.uniform(low, high)


def random_plant(rng: np.random.Generator, ranges: Ranges) -> tuple[Plant, dict[str, float]]:
    """Draw a plant, and return it with the drawn value of each of `Ranges.draws`.

    The speed is at most `Ranges.strokes_per_second`. The valve's coefficient is 1 m^2/V: the caller sizes it
    for the speed.
    """
    bore, stroke, rod_area = ranges.size(rng)
    area = pi / 4 * bore**2
    drawn = {name: draw(rng) for name, draw in ranges.draws.items()}
    drawn["speed"] = min(drawn["speed"], ranges.strokes_per_second * stroke)
    P_s = drawn["P_s"]
    force = ranges.reference_force * P_s * area
    V_d = drawn["dead"] * area * stroke / 2
    cylinder = Cylinder(
        bore,
        stroke,
        area,
        area - rod_area,
        V_d,
        V_d,
        M=ranges.accelerating_force * force / drawn["acceleration"],
        k_f=drawn["viscous"] * force / drawn["speed"],
        x_min=-stroke / 2,
        x_max=stroke / 2,
        load=-rod_area * ranges.P_atm,
        coulomb=drawn.get("coulomb", 0.0) * force,
    )
    k_0 = drawn["lambda_0"] * heat_area(0.0, cylinder)  # (12)
    return plant(cylinder, k_xu=1.0, u_max=U_MAX, P_s=P_s, k_0=k_0, P_atm=ranges.P_atm), drawn
