"""Rates of one chamber by any model or the full order, on floats, arrays and symbols."""

from importlib import import_module
from typing import Any

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.equations.branches import choices, joined_branches
from pneumo.equations.system import chamber_rates, system
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side
from pneumo.physics.models import Model


def chamber_rate(
    model: Model | str,
    n: float | None,
    plant: Plant,
    u: Any,
    x: Any,
    v: Any,
    P: Any,
    side: str = "A",
    T: Any = None,
) -> Any:
    """Rate of a chamber's pressure, Pa/s, from the command: eqs (1), (2), (6) and (10).

    For the full order, eqs (4) and (5), the result is a pair: the rates of pressure and of temperature, K/s.
    Results are floats, arrays or symbols, as the arguments are.

    Parameters
    ----------
    model : Model or str
        A row of `MODELS`, one of your own, the name of one in `MODELS`, or "full" for the full order.
    n : float or None
        Polytropic index; None where the model has none.
    plant : Plant
        Gas, valve, conditions, cylinder and k_0.
    u, x, v, P : float, NumPy array, CasADi or SymPy symbol
        Command, V, which this function limits; piston position, m, and velocity, m/s, both positive where
        they enlarge chamber A; the chamber's pressure, Pa.
    side : {"A", "B"}
        Which chamber.
    T : float, NumPy array, CasADi or SymPy symbol
        The chamber's temperature, K; only for the full order, as reduced models take it from the pressure.

    Raises
    ------
    InputError
        If there is no such model or side, n is missing or out of range, or T is missing or not a state.
    """
    if side not in Side.__members__:
        raise InputError(f"side = {side!r}: must be 'A' or 'B'")
    chosen = system(model, n, plant)
    known = {"u": u, "x": x, "v": v, f"P_{side}": P}
    if "T" in chosen.chamber_states:
        if T is None:
            raise InputError(f"T: model {chosen.name!r} needs the chamber's temperature")
        known[f"T_{side}"] = T
    elif T is not None:
        raise InputError(f"T: {chosen.name} takes the temperature from the pressure; leave it out")
    kinds = {type(value).__module__.split(".")[0] for value in known.values()}

    def choose(condition: Any, yes: Any, no: Any) -> Any:
        if "casadi" in kinds:
            return import_module("casadi").if_else(condition, yes, no)
        if "sympy" in kinds:
            return import_module("sympy").Piecewise((yes, condition), (no, True))
        return np.where(condition, yes, no)

    def evaluated(function: Any, known: dict[str, Any]) -> Any:
        return joined_branches(choices(function, known), choose)

    with np.errstate(invalid="ignore"):  # roots of negative numbers, where another branch is chosen
        rates = chamber_rates(chosen, Side[side], known, evaluated)
    return tuple(rates) if len(rates) > 1 else rates[0]
