"""Linear models of chambers or actuator at an operating point, for control design."""

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.equations.system import System, rates, system
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side
from pneumo.physics.models import Model
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics, beyond_dead_band

if TYPE_CHECKING:
    from control import StateSpace

IMAGINARY_STEP = 1e-30  # small without loss, since a complex step takes no difference


class Linear(NamedTuple):
    """Matrices of dy/dt = A y + B w; states y and inputs w are deviations from the operating point."""

    A: np.ndarray  #: shape (states, states)
    B: np.ndarray  #: shape (states, inputs)
    C: np.ndarray  #: identity: the outputs are the states
    D: np.ndarray  #: zero


def derivatives(system: System, state: Sequence[float], inputs: Sequence[float]) -> np.ndarray:
    """Matrices A and B of the linear model side by side, at a state and inputs; exact to rounding."""
    point, columns = [*state, *inputs], list[list[float]]()
    for k in range(len(point)):
        stepped = [complex(value, IMAGINARY_STEP * (j == k)) for j, value in enumerate(point)]
        changed = rates(system, stepped[: len(state)], stepped[len(state) :])
        columns.append([rate.imag / IMAGINARY_STEP for rate in changed])
    return np.array(columns).T


def _check_point(system: System, point: dict[str, float]) -> None:
    plant, u, x, v = system.plant, *(point[name] for name in ("u", "x", "v"))
    c = plant.conditions
    cylinder = plant.cylinder
    u_max = plant.valve.u_max
    paths = plant.valve.paths
    opening, half = beyond_dead_band(u, system.dynamics.null, system.dynamics.dead_band), cylinder.stroke / 2
    shut = not paths.knots and opening == 0
    problems = {
        f"{point}: must be finite numbers": not np.isfinite(list(point.values())).all(),
        "u = 0: eq (2) has a kink there; take a small u of either sign, such as 1e-6": shut and u == 0,
        f"u = {u:g} V: the valve is shut there, and eq (2) has a kink": shut and u != 0,
        f"u = {u:g} V: the valve's curve has a kink there": {opening, -opening} & {*paths.u},
        f"u = {u:g} V: beyond the limiter at {u_max:g} V nothing depends on it": abs(u) > u_max,
        f"x = {x:g} m: must be within half the stroke, {half:g} m": abs(x) > half,
    }
    if system.piston:
        stops = f"the end stops, {cylinder.x_min:g} and {cylinder.x_max:g} m"
        problems[f"x = {x:g} m: must be between {stops}"] = not cylinder.x_min < x < cylinder.x_max
        stuck = v == 0 and cylinder.coulomb > 0
        problems["v = 0: Coulomb friction has no derivative there; take a small v"] = stuck
    for side in Side:
        P, T = point[f"P_{side.name}"], point[f"T_{side.name}"]
        openings = max(side.sign * opening, 0.0), max(-side.sign * opening, 0.0)
        if paths.knots:
            openings = paths.openings(side.sign * opening, side)
        ports = zip((c.P_s, c.P_atm), openings, strict=True)
        name = f"P_{side.name} = {P:g} Pa"
        problems[f"{name}: must be positive (absolute)"] = not P > 0
        problems[f"T_{side.name} = {T:g} K: must be positive (absolute)"] = not T > 0
        singular = P in [P_port for P_port, open_now in ports if open_now + plant.valve.leak > 0]
        problems[f"{name}: eq (1) has no derivative at equal pressures"] = singular
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
    T_A: float | None = None,
    T_B: float | None = None,
    states: Literal["chambers", "actuator"] = "chambers",
    dynamics: ValveDynamics = PROPORTIONAL,
) -> "Linear | StateSpace":
    """Linear model of both chambers, or of the whole actuator, at an operating point.

    Derivatives are taken of the same equations as in the replays, by a complex step: exact to rounding. For
    the chambers, the states are (P_A, P_B) and the inputs (u, x, v). For the actuator, with eq (3), the
    states are (x, v, P_A, P_B) and the inputs (u, force). The full order has the states P_A, T_A, P_B, T_B in
    place of the pressures. The outputs are the states.

    Parameters
    ----------
    model : Model or str
        A row of `MODELS`, one of your own, the name of one in `MODELS`, or "full" for the full order.
    n : float or None
        Polytropic index; None where the model has none.
    plant : Plant
        Gas, valve, conditions, cylinder and k_0.
    u : float
        Command, V. Not 0: the valve's area, k_xu ``|u|``, has no derivative there. The opening of a
        valve with a lag is taken to have reached it.
    P_A, P_B : float
        Pressures, Pa. The point need not be an equilibrium.
    x, v : float
        Piston position, m, and velocity, m/s.
    T_A, T_B : float
        Temperatures, K, for the full order only; T_0 by default.
    states : {"chambers", "actuator"}
        "chambers": position and velocity are inputs; "actuator": they are states.
    dynamics : ValveDynamics
        Lag, null offset and dead band of the valve. A lag adds the state `opening` before the pressures. A
        dead time is not in the linear model.

    Returns
    -------
    control.StateSpace or Linear
        A `control.StateSpace` where python-control is installed, else `Linear`; both have A, B, C and D.

    Raises
    ------
    InputError
        If there is no such model, n is out of range, or the right-hand side has no derivative at the point.
    """
    if states not in ("chambers", "actuator"):
        raise InputError(f"states = {states!r}: must be 'chambers' or 'actuator'")
    linearised = system(model, n, plant, piston=states == "actuator", dynamics=dynamics)
    if linearised.model and not (T_A is None and T_B is None):
        raise InputError(f"T_A, T_B: {linearised.name} computes temperatures from pressures; leave them out")
    T_0 = plant.conditions.T_0
    point = {"u": u, "x": x, "v": v, "P_A": P_A, "P_B": P_B, "opening": u, "force": 0.0}
    point |= {"T_A": T_0 if T_A is None else T_A, "T_B": T_0 if T_B is None else T_B}
    _check_point(linearised, point)
    names, inputs = linearised.states, linearised.inputs
    at = ([point[name] for name in part] for part in (names, inputs))
    A, B = np.hsplit(derivatives(linearised, *at), [len(names)])
    C, D = np.eye(len(names)), np.zeros(B.shape)
    if find_spec("control") is None:
        return Linear(A, B, C, D)
    control = import_module("control")
    return control.StateSpace(A, B, C, D, states=names, inputs=inputs, outputs=names)
