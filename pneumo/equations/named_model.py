"""Models by name, with their polytropic index."""

from typing import Any

from pneumo.arguments import number
from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError, shown
from pneumo.physics.models import FULL, MODELS, Lane, Model, full_order_lane, lane

FULL_ORDER = FULL.name  # in place of a model's name
N_MAX = 3.0  # as in the configuration's schema


def model_row(model: Model | str, *others: str) -> Model:
    """The `Model` of a name; a `Model` is returned as it is.

    `InputError` if there is no such name; `others` are names beside those of models, for its text.
    """
    given: Any = model  # callers without a type checker give anything
    if isinstance(given, Model):
        return given
    if not isinstance(given, str) or given not in MODELS:
        raise InputError(f"model {shown(model)}: no such model; there are {', '.join((*MODELS, *others))}")
    return MODELS[given]


def model_and_index(model: Model | str, n: float | None, *others: str) -> tuple[Model, float]:
    """The named or given `Model`, and n as a float; 1 if n is None and the model has no polytropic index.

    Raises
    ------
    InputError
        If there is no such model, or n is missing or outside 0 to `N_MAX`.
    """
    row = model_row(model, *others)
    if n is None and row.has_n:
        raise InputError(f"n: {row.name} needs a polytropic index, above 0 and at most {N_MAX:g}")
    return row, 1.0 if n is None else number("n", n, 0.0, N_MAX, above=True)


def lane_for(model: Model | str, n: float | None, plant: Plant) -> Lane:
    """Coefficients of a model at n for the plant's gas, or of the full order, which has no n.

    Errors are those of `model_and_index`.
    """
    if model == FULL_ORDER:
        if n is not None:
            raise InputError(f"n = {shown(n)}: the full order has no n; give None")
        return full_order_lane(plant.gas.gamma, plant.wall)
    return lane(*model_and_index(model, n, FULL_ORDER), plant.gas.gamma)
