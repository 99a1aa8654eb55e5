"""Linear model of both chambers at an operating point, for control design."""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.engineer.branches import complex_value
from pneumo.engineer.model_rate import SIDES, lane_for
from pneumo.errors import InputError
from pneumo.physics.models import Model
from pneumo.simulation.reference import lane_rate

if TYPE_CHECKING:
    from control import StateSpace

STATES, INPUTS = ("P_A", "P_B"), ("u", "x", "v")
IMAGINARY_STEP = 1e-30  # no difference is taken, so that nothing is lost however small it is


class Linear(NamedTuple):
    """Matrices of d/dt (P_A, P_B) = A (P_A, P_B) + B (u, x, v), all counted from the operating point.

    Attributes
    ----------
    A : numpy.ndarray
        1/s, shape (2, 2), diagonal.
    B : numpy.ndarray
        Pa/s per V, m and m/s, shape (2, 3).
    C, D : numpy.ndarray
        Identity and zero: the outputs are the two pressures, Pa.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


def _check_point(plant: Plant, u: float, x: float, v: float, P: dict[str, float]) -> None:
    c, u_max, half = plant.conditions, plant.valve.u_max, plant.cylinder.stroke / 2
    values = f"u = {u:g}, x = {x:g}, v = {v:g}, P = {tuple(P.values())}"
    problems = {
        f"{values}: must be finite numbers": not np.isfinite([u, x, v, *P.values()]).all(),
        "u = 0: eq (2) has a kink there; take a small u of either sign, such as 1e-6": u == 0,
        f"u = {u:g} V: beyond the limiter at {u_max:g} V nothing depends on it": abs(u) > u_max,
        f"x = {x:g} m: must be within half the stroke, {half:g} m": abs(x) > half,
    }
    for side, pressure in P.items():
        name, port = f"P_{side} = {pressure:g} Pa", c.P_s if SIDES[side] * u > 0 else c.P_atm
        problems[f"{name}: must be positive (absolute)"] = not pressure > 0
        problems[f"{name}: eq (1) has no derivative at equal pressures"] = pressure == port
    for text, wrong in problems.items():
        if wrong:
            raise InputError(text)


def linearise(
    model: Model | str,
    n: float | None,
    plant: Plant,
    *,
    u: float,
    P_A: float,
    P_B: float,
    x: float = 0.0,
    v: float = 0.0,
) -> "Linear | StateSpace":
    """Linear model of both chambers at an operating point, derivatives exact to rounding.

    The state is (P_A, P_B), the inputs are (u, x, v), the outputs the two pressures. The piston's
    equation (3) is linear already and is left to the user, who knows the load. The derivatives are those of
    the replays' right-hand side, by a complex step.

    Parameters
    ----------
    u : float
        Command, V; not 0, where the valve's area, k_xu ``|u|``, has no derivative.
    P_A, P_B : float
        Pressures, Pa. The point need not be an equilibrium.
    x, v : float
        Piston position, m, and velocity, m/s.

    Returns
    -------
    control.StateSpace or Linear
        The former where python-control is installed; both have A, B, C and D.

    Raises
    ------
    InputError
        If there is no such model, n is bad, or the right-hand side has no derivative at the point.
    """
    pressures = {"A": P_A, "B": P_B}
    _check_point(plant, u, x, v, pressures)
    row, cylinder = lane_for(model, n, plant), plant.cylinder
    A, B = np.zeros((2, 2)), np.zeros((2, 3))
    for i, (side, sign) in enumerate(SIDES.items()):
        area = cylinder.A_A if side == "A" else cylinder.A_B

        def derivative(k: int, P: float = pressures[side], sign: float = sign, area: float = area) -> float:
            outward = (sign * u, sign * x, sign * v, P)
            arguments = (complex(value, IMAGINARY_STEP * (j == k)) for j, value in enumerate(outward))
            return complex_value(lane_rate, *arguments, area, plant, row).imag / IMAGINARY_STEP

        A[i, i] = derivative(3)
        B[i] = [sign * derivative(k) for k in range(3)]
    C, D = np.eye(2), np.zeros((2, 3))
    if find_spec("control") is None:
        return Linear(A, B, C, D)
    control = import_module("control")
    return control.StateSpace(A, B, C, D, states=STATES, inputs=INPUTS, outputs=STATES)
