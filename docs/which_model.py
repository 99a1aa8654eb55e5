"""Numbers and tables of which-model.md."""

from pathlib import Path

import numpy as np
import xarray as xr
from fragments import span, table

import pneumo
from pneumo.papers.paper_2006.summary import LEVELS
from pneumo.physics.models import MODELS
from pneumo.publish.text.formatting import with_interval
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


def percent_with_interval(values: xr.DataArray) -> str:
    """Fraction in per cent with its interval, from value, low and high."""
    return "{:.0f} % ({:.0f} to {:.0f})".format(*100 * values.values)


def cylinder_tables(runs: xr.Dataset) -> dict[str, str]:
    """Tables of the random cylinders by name, from results/cylinders.nc."""
    by_loop = []
    for pair in runs["pair"].values:
        for loop in runs["loop_of"].values:
            ratios = runs["ratio"].sel(pair=pair, loop_of=loop)
            cells = [with_interval(ratios.sel(criterion=c).values) for c in runs["criterion"].values]
            below_one = runs["share"].sel(statement=f"{pair} < 1", loop_of=loop)
            by_loop.append([pair, loop, *cells, percent_with_interval(below_one)])
    exchange = runs.sel(group="exchange")
    by_third = [
        [f"{at['third_from']:.3g} to {at['third_to']:.3g}"]
        + [with_interval(at["third_ratio"].sel(pair=pair).values) for pair in runs["pair"].values]
        for third in runs["third"].values
        for at in [exchange.sel(third=third)]
    ]
    heads = ["ratio", "loop", "of means", "geometric mean", "of mean ranks", "cylinders below one"]
    return {
        "exchange": table(["exchange", *runs["pair"].values], by_third),
        "cylinders": table(heads, by_loop),
    }


def cylinder_numbers(runs: xr.Dataset) -> dict[str, str]:
    """Numbers of the random cylinders by name, from results/cylinders.nc."""
    much = runs.sel(group="exchange", third="highest")
    enough = runs["share"].sel(statement="M6 enough")
    below, above = runs["rule_model"].values
    return {
        "cylinders": f"{runs['held_out'].size:,}",
        "runs": f"{runs['counts'].size:,}",
        "compared": f"{(runs['held_out'] == 0).sum().item():,}",
        "failed": f"{(runs['counts'] == 0).sum().item()}",
        "rule threshold": f"{runs['rule_threshold'].item():.3g}",
        "rule below": str(below),
        "rule above": str(above),
        "rule error": with_interval(runs["rule_error"].sel(choice="rule").values),
        "rule always M8": with_interval(runs["rule_error"].sel(choice="M8").values),
        "rule quotient": with_interval(runs["rule_quotient"].values, 3),
        "much air": f"{much['third_from']:.3g}",
        "M8/M7 much air": with_interval(much["third_ratio"].sel(pair="M8/M7").values),
        **{
            f"M6 enough {loop}": percent_with_interval(enough.sel(loop_of=loop))
            for loop in ("open", "closed")
        },
    }
