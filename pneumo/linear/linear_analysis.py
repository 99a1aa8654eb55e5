"""Natural frequency and damping of an actuator, from linear models."""

from itertools import product

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Plant
from pneumo.equations.system import system
from pneumo.errors import InputError
from pneumo.linear.linear_model import derivatives
from pneumo.physics.models import Model


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
        If there is no such model, n is out of range, a position not between the stops or a pressure not
        positive.
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
        A_B = derivatives(smooth, [known[name] for name in smooth.states], [0.0] * 3)
        poles = np.linalg.eigvals(A_B[:, : len(A_B)])
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
