"""Rate of one chamber's pressure by any model, on floats, arrays and symbols."""

from importlib import import_module
from typing import Any

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.equations.branches import choices, joined_branches
from pneumo.equations.named_model import model_and_index
from pneumo.equations.system import System, chamber_rates
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side
from pneumo.physics.models import Model


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
    system = System(*model_and_index(model, n), plant)
    known = {"u": u, "x": x, "v": v, f"P_{side}": P}
    kinds = {type(value).__module__.split(".")[0] for value in known.values()}

    def chosen(condition: Any, yes: Any, no: Any) -> Any:
        if "casadi" in kinds:
            return import_module("casadi").if_else(condition, yes, no)
        if "sympy" in kinds:
            return import_module("sympy").Piecewise((yes, condition), (no, True))
        return np.where(condition, yes, no)

    def evaluated(function: Any, known: dict[str, Any]) -> Any:
        return joined_branches(choices(function, known), chosen)

    with np.errstate(invalid="ignore"):  # roots of negative numbers, where another branch is chosen
        return chamber_rates(system, Side[side], known, evaluated)[0]
