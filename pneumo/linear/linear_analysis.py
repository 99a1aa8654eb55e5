"""Natural frequency and damping of an actuator, and the longest stable steps, from linear models."""

from itertools import product

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Plant
from pneumo.equations.system import METHODS, System, system
from pneumo.errors import InputError
from pneumo.linear.linear_model import state_matrix
from pneumo.physics.models import Model
from pneumo.simulation.tableau import Tableau

# Where stable steps are asked for; at equal pressures of port and chamber the slope of eq (1) is infinite.
ABOVE_ATMOSPHERE, BELOW_SUPPLY, FASTEST = 1.05, 0.95, 1.0
STABLE_RANGE = (
    f"{ABOVE_ATMOSPHERE:g} P_atm < P < {BELOW_SUPPLY:g} P_s, any position and command, |v| <= {FASTEST:g} m/s"
)


def natural_modes(
    model: Model | str, n: float | None, plant: Plant, x: np.ndarray, P: np.ndarray
) -> xr.Dataset:
    """Natural frequency, Hz, and damping ratio of the piston on the air of both chambers, valve closed.

    Returns `natural_frequency` and `damping` by (x, P). The linear model is taken at rest, at every position
    x, m, and every pressure P_A = P, Pa, with the P_B that balances P_A on the piston, and T = T_0. Coulomb
    friction is left out. Values are NaN where the piston does not oscillate.

    Raises
    ------
    InputError
        If there is no such model, n is bad, a position is not between the stops or a pressure not positive.
    """
    closed, cylinder = system(model, n, plant, valve=False, piston=True), plant.cylinder
    x, P = np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(P, float))
    for position in x[~((x > cylinder.x_min) & (x < cylinder.x_max))]:
        stops = f"{cylinder.x_min:g} and {cylinder.x_max:g} m"
        raise InputError(f"x = {position:g} m: must be between the end stops, {stops}")
    for pressure in P[~(P > 0)]:
        raise InputError(f"P = {pressure:g} Pa: must be positive (absolute)")
    smooth = closed._replace(plant=plant._replace(cylinder=cylinder._replace(coulomb=0.0)))
    T_0 = plant.conditions.T_0
    modes = np.full((2, len(x), len(P)), np.nan)
    for (i, position), (j, P_A) in product(enumerate(x.tolist()), enumerate(P.tolist())):
        known = {"x": position, "v": 0.0, "P_A": P_A, "P_B": P_A * cylinder.A_A / cylinder.A_B}
        known |= {"T_A": T_0, "T_B": T_0}
        poles = np.linalg.eigvals(state_matrix(smooth, [known[name] for name in smooth.states], [0.0] * 3))
        pole = poles[np.argmax(poles.imag)]
        if pole.imag > 0:
            modes[:, i, j] = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    frequency = ("x", "P"), modes[0], {"units": "Hz", "long_name": "natural frequency"}
    damping = ("x", "P"), modes[1], {"units": "1", "long_name": "damping ratio"}
    return xr.Dataset(
        {"natural_frequency": frequency, "damping": damping}, {"x": x, "P": P}, {"model": closed.name}
    )


def operating_range(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Grid for a map of `natural_modes`: positions over the stroke, m, pressures from P_atm to P_s, Pa."""
    cylinder, c = plant.cylinder, plant.conditions
    margin = 0.01 * (cylinder.x_max - cylinder.x_min)
    return np.linspace(cylinder.x_min + margin, cylinder.x_max - margin, 21), np.linspace(c.P_atm, c.P_s, 11)


def stability_function(method: Tableau, z: np.ndarray) -> np.ndarray:
    """Stability function of a Runge-Kutta method: factor of a mode with pole z / h over one step h."""
    stages, power, result = len(method.b), np.ones(len(method.b)), np.ones_like(z, dtype=complex)
    for k in range(1, stages + 1):
        result = result + (method.b @ power) * z**k
        power = method.A @ power
    return result


def _reach(method: Tableau, directions: np.ndarray) -> np.ndarray:
    """Distance from 0 to the border of a method's stability region, in given directions.

    Directions are complex numbers of magnitude 1.
    """
    radii = np.linspace(0.01, 6.0, 600)
    inside = np.abs(stability_function(method, directions[:, None] * radii)) <= 1 + 1e-12
    return radii[np.argmin(inside, axis=1)] - radii[0]


def stable_steps(system: System) -> dict[str, float]:
    """Longest stable step of each integration method, s, over the operating range `STABLE_RANGE`.

    Unstable modes are ignored: they grow with any step.
    """
    c, cylinder, u_max = system.plant.conditions, system.plant.cylinder, system.plant.valve.u_max
    half = 0.999 * min(cylinder.stroke / 2, cylinder.x_max, -cylinder.x_min)
    axes = {
        "x": (-half, 0.0, half),
        "v": (-FASTEST, 1e-6, FASTEST),
        "u": (-u_max, u_max),
        "P_A": np.linspace(ABOVE_ATMOSPHERE * c.P_atm, BELOW_SUPPLY * c.P_s, 3).tolist(),
    }
    poles = list[complex]()
    for x, v, u, P_A in product(*axes.values()):
        for P_B in axes["P_A"] if system.piston else (P_A,):
            known = {"x": x, "v": v, "u": u, "opening": u, "P_A": P_A, "P_B": P_B, "T_A": c.T_0, "T_B": c.T_0}
            at = [[known.get(name, 0.0) for name in names] for names in (system.states, system.inputs)]
            poles += np.linalg.eigvals(state_matrix(system, *at)).tolist()
    decaying = np.array([pole for pole in poles if pole.real < -1e-9 * abs(pole)])
    return {
        name: float(np.min(_reach(m, decaying / abs(decaying)) / abs(decaying)))
        for name, m in METHODS.items()
    }
