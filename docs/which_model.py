"""Numbers and tables of which-model.md."""

from pathlib import Path

import numpy as np
import xarray as xr
from fragments import span, table

import pneumo
from paper.study.paper_2006.summary import LEVELS
from pneumo.physics.models import MODELS
from pneumo.simulation.signals import STUDY_SAMPLINGS
from pneumo.statistics.averages import at_n, best_n, concatenated
from pneumo.statistics.model_pairs import MODEL_PAIRS, REFINED_MODELS, REFINEMENT_STEPS

COLUMNS = [{"level": level, "transport": sampling} for level in LEVELS for sampling in STUDY_SAMPLINGS]
HEADS = [", ".join(column.values()) for column in COLUMNS]


def over_levels(results: Path) -> xr.Dataset:
    """Mean square error and constant n by (transport, level, model)."""
    parts = []
    for sampling in STUDY_SAMPLINGS:
        with xr.open_dataset(results / sampling / "statistics.nc") as statistics:
            parts.append(statistics[["mse", "constant_n"]].sel(level=list(LEVELS)).load())
    return xr.concat(parts, xr.Variable("transport", list(STUDY_SAMPLINGS)))


def by_experiment(results: Path) -> xr.DataArray:
    """Mean square error at each experiment's best n by (transport, experiment, model)."""
    parts = []
    for sampling in STUDY_SAMPLINGS:
        cells = concatenated(pneumo.open_grid(results / sampling))
        parts.append(at_n(cells, best_n(cells["mse"]))["mse"])
    return xr.concat(parts, xr.Variable("transport", list(STUDY_SAMPLINGS)))


def geometric(values: xr.DataArray) -> str:
    """Geometric mean."""
    return f"{np.exp(np.log(values).mean()).item():.2f}"


def tables(levels: xr.Dataset, mse: xr.DataArray) -> dict[str, str]:
    """Tables of the page by name."""

    def error_and_n(model: str, column: dict[str, str]) -> str:
        at = levels.sel(column | {"model": model})
        n = f" ({at['constant_n'].item():g})" if MODELS[model].has_n else ""
        error = at["mse"].item() / 1e6
        return f"{error:.0f}{n}" if error >= 100 else f"{error:#.3g}{n}"

    by_column = [levels["mse"].sel(column) for column in COLUMNS]
    steps = [
        [pair.refinement, pair.name, *(f"{pair.ratio(errors).item():.2f}" for errors in by_column)]
        for pair in REFINEMENT_STEPS
    ]
    exact = mse.sel(transport="exact")
    experiments = []
    for name in exact["experiment"].values:
        at = exact.sel(experiment=name)
        cells = [name, at["cylinder"].item(), at["loop"].item(), f"{at['k_0'].item():.2g}"]
        cells += [f"{pair.ratio(at).item():.2f}" for pair in MODEL_PAIRS.values()]
        experiments.append([*cells, at.sel(model=list(REFINED_MODELS)).idxmin("model").item()])
    summary = []
    for name, pair in MODEL_PAIRS.items():
        values = pair.ratio(exact)
        ends = [f"{end.item():.2f}" for end in (values.min(), values.max())]
        summary.append(
            [f"{name}, {pair.refinement}", *ends, geometric(values), str((values < 1).sum().item())]
        )
    summary_heads = ["over all experiments", "lowest", "highest", "geometric mean", "below one"]
    heads = ["experiment", "cylinder", "loop", "k_0 (W/K)", *MODEL_PAIRS, "lowest MSE"]
    return {
        "levels": table(
            ["model", *HEADS],
            [
                [model, *(error_and_n(model, column) for column in COLUMNS)]
                for model in levels["model"].values
            ],
        ),
        "steps": table(["refinement", "quotient", *HEADS], steps),
        "experiments": table(heads, experiments),
        "summary": table(summary_heads, summary),
    }


def numbers(levels: xr.Dataset, mse: xr.DataArray) -> dict[str, str]:
    """Numbers in the page's sentences and in README's by name."""
    exact = mse.sel(transport="exact")
    classical = levels["mse"].sel(model=["M1", "M2", "M3", "M4"]).min("model") / levels["mse"].sel(model="M5")
    good = levels["constant_n"].sel(model=list(REFINED_MODELS))
    M8, mixing = exact.sel(model="M8"), MODEL_PAIRS["M8/M7"]
    return {
        "experiments": f"{exact.sizes['experiment']}",
        "classical over M5": f"{np.floor(100 * classical.min().item()) / 100:.2f}",
        "M10 better": f"{(MODEL_PAIRS['M10/M8'].ratio(exact) < 1).sum().item()}",
        "M8/M7 published": geometric(mixing.ratio(mse.sel(transport="published"))),
        "largest": str(M8.idxmax("experiment").item()),
        "largest percent": f"{100 * (M8.max() / M8.sum()).item():.0f}",
        **{f"n {level}": span(good.sel(level=level), "g") for level in LEVELS},
    }
