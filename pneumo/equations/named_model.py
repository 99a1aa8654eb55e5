"""Models by name, with their polytropic index."""

from math import isfinite

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.physics.models import MODELS, Lane, Model, lane

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
