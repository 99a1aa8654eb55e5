"""Samples with known estimates, for the test programs of exported observers."""

from typing import NamedTuple

import numpy as np

from pneumo.equations.system import System, step
from pneumo.export.observer_noise import ObserverNoise
from pneumo.linear.observer import ekf

SAMPLE, COUNT = 1e-3, 60  # s; samples


class KnownEstimate(NamedTuple):
    """One sample: the command held from it on, its readings, and the estimate corrected by these."""

    u: float
    readings: list[float]
    estimate: list[float]


def known_estimates(system: System, noise: ObserverNoise) -> list[KnownEstimate]:
    """Estimates of `pneumo.ekf` on a short simulated run, with which test programs compare an observer.

    Readings of x are rounded to 0.01 mm, those of pressure have the noise's deviation.
    """
    plant, rng = system.plant, np.random.default_rng(2006)
    c = plant.conditions
    u = np.repeat(plant.valve.u_max * rng.uniform(-0.5, 0.5, COUNT // 10), 10)
    state, states = system.state(x=0.0, v=0.0, P=c.P_0, T=c.T_0), list[list[float]]()
    for command in u.tolist():
        states.append(state)
        state = step(system, state, [command, 0.0], [command, 0.0], SAMPLE)
    run = dict(zip(system.states, np.transpose(states), strict=True))
    x = np.round(run["x"] / 1e-5) * 1e-5
    P = [run[name] + noise.pressure_deviation * rng.standard_normal(COUNT) for name in ("P_A", "P_B")]
    read = P[: noise.pressures]
    seen = ekf(
        "full" if system.model is None else system.model,
        system.n if system.model and system.model.has_n else None,
        plant,
        SAMPLE,
        u=u,
        x=x,
        P_A=read[0] if noise.pressures else None,
        P_B=read[1] if noise.pressures == len(P) else None,
        force_noise=noise.force,
        pressure_noise=noise.pressure,
        x_deviation=noise.x_deviation,
        pressure_deviation=noise.pressure_deviation,
    )
    estimates = np.column_stack([getattr(seen, name) for name in system.states])
    rows = zip(u.tolist(), np.column_stack([x, *read]).tolist(), estimates.tolist(), strict=True)
    return [KnownEstimate(*row) for row in rows]
