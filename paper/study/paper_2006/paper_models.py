"""The paper's ten models and their rows of Table 1, derived from the table of models."""

from pneumo.physics.models import MODELS, Model
from pneumo.selection.ranking import cost

PAPER_MODELS = {f"M{i}": MODELS[f"M{i}"] for i in range(1, 11)}  # not those that are added to the table


def table_1_row(model: Model) -> dict[str, str]:
    """Row of Table 1 as printed: column -> cell."""
    # As printed: gamma by its value for air, 1.4, where wall heat is not explicit (M3), else as a letter.
    name = {"gamma": "γ" if model.wall != "none" else "1.4"}
    indices = {model.n_V, model.n_in, model.n_out}
    words = (name.get(index, index) if isinstance(index, str) else f"{index:g}" for index in indices)
    return {
        "wall_heat": "✓" if model.wall != "none" else "×",
        "mixing": "✓" if model.mixing else "×",
        "temperature": model.temperature.capitalize(),
        "index": ", ".join(sorted(words)),
    }


def processes(name: str) -> int:
    """Number of processes in a model: changing temperature, mixing, and up to three steps of wall heat."""
    walls, changing_temperature, _, mixing = cost(PAPER_MODELS[name])
    return walls + changing_temperature + mixing
