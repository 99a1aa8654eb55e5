"""Steps with known results, for the test programs of exported code."""

from typing import NamedTuple

import numpy as np

from pneumo.equations.system import System, step

COUNT = 16
H = 1e-3  # s
TOLERANCE = {  # of test programs, relative
    "double": 1e-12,  # some hundred roundings of 1.1e-16
    "float": 1e-4,  # the same of 6e-8, and rates that cancel
}


class KnownStep(NamedTuple):
    """A step of h s with its result: inputs at its start and end, state before and after."""

    start: list[float]
    end: list[float]
    h: float
    before: list[float]
    after: list[float]


def known_steps(system: System) -> list[KnownStep]:
    """Steps from random states with their results, computed in Python.

    With a piston, one of them runs into an end stop and one stays at rest on it.
    """
    rng, c, cylinder = np.random.default_rng(2006), system.plant.conditions, system.plant.cylinder
    flow = 0.04 * system.plant.valve.k_xu * system.plant.valve.u_max * c.P_s / c.T_0**0.5
    most = {"u": 1.2 * system.plant.valve.u_max, "m": flow, "v": 1.0, "force": 100.0}
    most["opening"] = system.plant.valve.u_max
    most["x"] = 0.98 * min(cylinder.stroke / 2, -cylinder.x_min, cylinder.x_max)

    def draw(name: str) -> float:
        base = name.split("_")[0]
        low, high = {"P": (c.P_atm, c.P_s), "T": (0.8 * c.T_0, 1.2 * c.T_0)}.get(base, (-1.0, 1.0))
        return float(rng.uniform(low, high)) * most.get(base, 1.0)

    steps = list[KnownStep]()
    for i in range(COUNT):
        start, end = ([draw(quantity) for quantity in system.inputs] for _ in range(2))
        state = [draw(quantity) for quantity in system.states]
        if system.piston and i == 0:
            state[:2] = cylinder.x_max - H / 2, 1.0
        if system.piston and i == 1:
            state[:2] = cylinder.x_min, 0.0
            start[-1] = end[-1] = -1e4  # N: held whatever the pressures
        steps.append(KnownStep(start, end, H, state, step(system, state, start, end, H)))
    return steps
