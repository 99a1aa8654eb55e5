"""Numbers and tables of which-model.md."""

from pathlib import Path

import numpy as np
import xarray as xr
from fragments import table

import pneumo
from pneumo.physics.models import MODELS
from pneumo.statistics.averages import at_n, best_n, concatenated

TRANSPORTS = ("published", "exact")
LEVELS = ("adiabatic", "typical", "isothermal")
GOOD = ["M5", "M6", "M7", "M8", "M9", "M10"]
STEPS = {
    "temperature by eq (6), not constant": ("M5", "M2"),
    "mixing, without explicit wall heat": ("M6", "M5"),
    "explicit wall heat, without mixing": ("M7", "M5"),
    "mixing, with explicit wall heat": ("M8", "M7"),
    "explicit wall heat, with mixing": ("M8", "M6"),
    "wall area that follows the piston": ("M9", "M8"),
    "conductance that follows P and T as well": ("M10", "M9"),
}
PAIRS = (("M6", "M5"), ("M6", "M7"), ("M8", "M7"), ("M10", "M8"))
HEAD = [f"{level}, {transport}" for level in LEVELS for transport in TRANSPORTS]


def over_levels(results: Path) -> xr.Dataset:
    """Mean square error and constant n by (transport, level, model)."""
    parts = []
    for transport in TRANSPORTS:
        with xr.open_dataset(results / transport / "statistics.nc") as statistics:
            parts.append(statistics[["mse", "constant_n"]].sel(level=list(LEVELS)).load())
    return xr.concat(parts, xr.Variable("transport", list(TRANSPORTS)))


def by_experiment(results: Path) -> xr.DataArray:
    """Mean square error at each experiment's best n by (transport, experiment, model)."""
    parts = []
    for transport in TRANSPORTS:
        cells = concatenated(pneumo.open_grid(results / transport))
        parts.append(at_n(cells, best_n(cells["mse"]))["mse"])
    return xr.concat(parts, xr.Variable("transport", list(TRANSPORTS)))


def tables(levels: xr.Dataset, mse: xr.DataArray) -> dict[str, str]:
    """Tables of the page by name."""
    cells = [(level, transport) for level in LEVELS for transport in TRANSPORTS]

    def one(model: str, level: str, transport: str) -> str:
        found = levels.sel(model=model, level=level, transport=transport)
        n = f" ({found['constant_n'].item():g})" if MODELS[model].has_n else ""
        mse = found["mse"].item() / 1e6
        return f"{mse:.0f}{n}" if mse >= 100 else f"{mse:#.3g}{n}"

    def ratio(better: str, than: str, level: str, transport: str) -> str:
        at = levels["mse"].sel(level=level, transport=transport)
        return f"{(at.sel(model=better) / at.sel(model=than)).item():.2f}"

    steps = [
        [step, f"{new}/{old}", *(ratio(new, old, *cell) for cell in cells)]
        for step, (new, old) in STEPS.items()
    ]
    experiments = []
    for name in mse["experiment"].values:
        at = mse.sel(experiment=name, transport="exact")
        quotients = [f"{(at.sel(model=a) / at.sel(model=b)).item():.2f}" for a, b in PAIRS]
        best = str(at.sel(model=GOOD).idxmin("model").item())
        experiments.append(
            [name, at["cylinder"].item(), at["loop"].item(), f"{at['k_0'].item():g}", *quotients, best]
        )
    head = ["experiment", "cylinder", "loop", "k_0 (W/K)", *("/".join(pair) for pair in PAIRS), "lowest MSE"]
    return {
        "levels": table(
            ["model", *HEAD],
            [[model, *(one(model, *cell) for cell in cells)] for model in levels["model"].values],
        ),
        "steps": table(["refinement", "quotient", *HEAD], steps),
        "experiments": table(head, experiments),
    }


def numbers(levels: xr.Dataset, mse: xr.DataArray) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    found = {}
    for transport in TRANSPORTS:
        for new, old in PAIRS:
            quotient = mse.sel(model=new, transport=transport) / mse.sel(model=old, transport=transport)
            key = f"{new}/{old} {transport}"
            found[f"{key} lowest"] = f"{quotient.min().item():.2f}"
            found[f"{key} highest"] = f"{quotient.max().item():.2f}"
            found[f"{key} below one"] = f"{(quotient < 1).sum().item()}"
            found[f"{key} geometric"] = f"{np.exp(np.log(quotient).mean()).item():.2f}"
    classical = levels["mse"].sel(model=["M1", "M2", "M3", "M4"]).min("model") / levels["mse"].sel(model="M5")
    found["classical over M5"] = f"{classical.min().item():.1f}"
    by_level = levels["mse"].sel(transport="exact")
    for level in LEVELS:
        quotient = by_level.sel(model="M8", level=level) / by_level.sel(model="M7", level=level)
        found[f"M8/M7 {level}"] = f"{quotient.item():.2f}"
    exact = mse.sel(model="M8", transport="exact")
    found["largest"] = str(exact.idxmax("experiment").item())
    found["its share"] = f"{100 * (exact.max() / exact.sum()).item():.0f}"
    good = levels["constant_n"].sel(model=GOOD)
    for level in LEVELS:
        n = good.sel(level=level)
        found[f"n {level}"] = f"{n.min().item():g} to {n.max().item():g}"
    return found


def with_interval(values: xr.DataArray) -> str:
    """Value with its interval, from value, low and high."""
    return "{:.2f} ({:.2f} to {:.2f})".format(*values.values)


def share_with_interval(values: xr.DataArray) -> str:
    """Share in per cent with its interval, from value, low and high."""
    return "{:.0f} % ({:.0f} to {:.0f})".format(*100 * values.values)


def cylinder_tables(runs: xr.Dataset) -> dict[str, str]:
    """Tables of the random cylinders by name, from results/cylinders.nc."""
    ratio, share, pairs = runs["ratio"], runs["share"], runs["pair"].values
    by_loop = [
        [
            pair,
            loop,
            *(
                with_interval(ratio.sel(pair=pair, loop_of=loop, criterion=c))
                for c in runs["criterion"].values
            ),
            share_with_interval(share.sel(statement=f"{pair} < 1", loop_of=loop)),
        ]
        for pair in pairs
        for loop in runs["loop_of"].values
    ]
    exchange = runs.sel(group="exchange")
    by_third = [
        [f"{at['third_from']:.3g} to {at['third_to']:.3g}"]
        + [with_interval(at["third_ratio"].sel(pair=pair)) for pair in pairs]
        for third in runs["third"].values
        for at in [exchange.sel(third=third)]
    ]
    head = ["ratio", "loop", "of means", "geometric mean", "of mean ranks", "cylinders below one"]
    return {"exchange": table(["exchange", *pairs], by_third), "cylinders": table(head, by_loop)}


def cylinder_numbers(runs: xr.Dataset) -> dict[str, str]:
    """Numbers of the random cylinders by name, from results/cylinders.nc."""
    much = runs.sel(group="exchange", third="highest")
    enough = runs["share"].sel(statement="M6 enough")
    below, above = runs["rule_model"].values
    return {
        "runs": f"{runs['counts'].size:,}",
        "compared": f"{(runs['held_out'] == 0).sum().item():,}",
        "rule threshold": f"{runs['rule_threshold'].item():.3g}",
        "rule below": str(below),
        "rule above": str(above),
        "rule error": with_interval(runs["rule_error"].sel(choice="rule")),
        "rule always M8": with_interval(runs["rule_error"].sel(choice="M8")),
        "rule quotient": "{:.3f} ({:.3f} to {:.3f})".format(*runs["rule_quotient"].values),
        "failed": f"{(runs['counts'] == 0).sum().item()}",
        "much air": f"{much['third_from']:.3g}",
        "M8/M7 much air": with_interval(much["third_ratio"].sel(pair="M8/M7")),
        **{f"M6 enough {loop}": share_with_interval(enough.sel(loop_of=loop)) for loop in ("open", "closed")},
    }
