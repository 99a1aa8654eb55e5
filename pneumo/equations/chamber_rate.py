"""Rate of one chamber's pressure by any model, on floats, arrays and symbols."""

from collections.abc import Callable
from importlib import import_module
from math import isfinite
from typing import Any

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.equations.branches import choices, joined_branches
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.models import MODELS, Lane, Model, lane
from pneumo.physics.valve import limited
from pneumo.simulation.reference import lane_rate

N_MAX = 3.0  # as in the configuration's schema


def model_row(model: Model | str) -> Model:
    """The `Model` of a name; a `Model` is returned as it is. `InputError` if there is no such name."""
    if isinstance(model, Model):
        return model
    if model not in MODELS:
        raise InputError(f"model {model!r}: no such model; there are {', '.join(MODELS)}")
    return MODELS[model]


def model_and_index(model: Model | str, n: float | None) -> tuple[Model, float]:
    """The named or given `Model`, and n as a float; 1 if n is None and the model has no polytropic index.

    Raises
    ------
    InputError
        If there is no such model, or n is missing or outside 0 to `N_MAX`.
    """
    row = model_row(model)
    if n is None and row.has_n:
        raise InputError(f"n: {row.name} needs a polytropic index")
    n = 1.0 if n is None else n
    if not (isfinite(n) and 0 < n <= N_MAX):
        raise InputError(f"n = {n:g}: must be greater than 0 and at most {N_MAX:g}")
    return row, float(n)


def lane_for(model: Model | str, n: float | None, plant: Plant) -> Lane:
    """Coefficients of a model at n for the plant's gas; errors are those of `model_and_index`."""
    return lane(*model_and_index(model, n), plant.gas.gamma)


def chamber_rate(
    model: Model | str, n: float | None, plant: Plant, u: Any, x: Any, v: Any, P: Any, side: str = "A"
) -> Any:
    """Rate of a chamber's pressure by a reduced model, Pa/s, from the command: eqs (1), (2), (6) and (10).

    The result is a float, array or symbol, as the arguments are.

    Parameters
    ----------
    model : Model or str
        A row of `MODELS`, one of your own, or the name of one in `MODELS`.
    n : float or None
        Polytropic index; None where the model has none.
    plant : Plant
        Gas, valve, conditions, cylinder and k_0.
    u, x, v, P : float, NumPy array, CasADi or SymPy symbol
        Command, V, which this function limits; piston position, m, and velocity, m/s, both positive where
        they enlarge chamber A; the chamber's pressure, Pa.
    side : {"A", "B"}
        Which chamber.

    Raises
    ------
    InputError
        If there is no such model or side, or n is missing or out of range.
    """
    if side not in Side.__members__:
        raise InputError(f"side = {side!r}: must be 'A' or 'B'")
    row, of_side = lane_for(model, n, plant), Side[side]
    sign, chamber = of_side.sign, chamber_of(plant.cylinder, of_side)

    def rate(u: Any, x: Any, v: Any, P: Any) -> Any:
        return lane_rate(limited(sign * u, plant.valve.u_max), sign * x, sign * v, P, chamber, plant, row)

    with np.errstate(invalid="ignore"):  # roots of negative numbers, where another branch is chosen
        return joined_branches(choices(rate, u, x, v, P), _chooser(u, x, v, P))


def _chooser(*arguments: Any) -> Callable[[Any, Any, Any], Any]:
    """Function (condition, yes, no) that chooses between values, for CasADi, SymPy or NumPy.

    The type of the arguments decides which.
    """
    kinds = {type(a).__module__.split(".")[0] for a in arguments}
    if "casadi" in kinds:
        return import_module("casadi").if_else
    if "sympy" in kinds:
        piecewise = import_module("sympy").Piecewise
        return lambda condition, yes, no: piecewise((yes, condition), (no, True))
    return np.where
