"""The paper's ten models and their rows of Table 1, derived from the table of models."""

from pneumo.physics.models import MODELS, Model

PAPER_MODELS = {f"M{i}": MODELS[f"M{i}"] for i in range(1, 11)}  # whatever else the table of models holds


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
    """Number of processes that a model carries: changing temperature, mixing, three steps of wall heat."""
    model = PAPER_MODELS[name]
    walls = ("none", "k_0", "lambda_0 A_q", "lambda A_q").index(model.wall)
    return (model.temperature == "polytropic") + model.mixing + walls
