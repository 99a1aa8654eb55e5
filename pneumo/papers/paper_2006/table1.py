"""Table 1 of the paper, generated from the table of models."""

from typing import NamedTuple

from pneumo.physics.models import MODELS, Model


class Features(NamedTuple):
    """One row of Table 1.

    Attributes
    ----------
    model : str
        Paper's name, M1 ... M10.
    wall_heat, mixing : bool
        Explicit heat transfer through the walls; heat transfer by mixing.
    temperature : {"Constant", "Polytropic"}
        Temperature evolution.
    pressure_index : str
        The index, or the several indices in rising order.
    """

    model: str
    wall_heat: bool
    mixing: bool
    temperature: str
    pressure_index: str


def _pressure_index(model: Model) -> str:
    # As printed: gamma by its value for air, 1.4, where wall heat is not explicit (M3), else as a letter.
    name = {"gamma": "γ" if model.wall != "none" else "1.4"}
    indices = {model.n_V, model.n_in, model.n_out}
    return ", ".join(
        sorted(name.get(index, index) if isinstance(index, str) else f"{index:g}" for index in indices)
    )


def table_1() -> list[Features]:
    """Return the rows of Table 1, one for each model."""
    return [
        Features(
            model.name,
            model.wall != "none",
            model.mixing,
            model.temperature.capitalize(),
            _pressure_index(model),
        )
        for model in MODELS.values()
    ]
