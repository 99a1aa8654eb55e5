"""Numbers and tables of at-work.md."""

import numpy as np
import xarray as xr
from fragments import span, table

from pneumo.evidence.at_work.at_work_statistics import (
    ENOUGH,
    RESAMPLING_SEED,
    USES,
    carried_at,
    correlations,
    predicts,
    with_bounds,
)
from pneumo.publish.text.formatting import with_interval
from pneumo.statistics.intervals import Interval, student_interval

SENSORS = {"none": "no pressure", "one": "P_A", "both": "both pressures"}
CONTROL = ("none", "both")
FIXED = 33.0  # rad/s, the slower bandwidth that the page shows beside the tuned one
REFINED = ["M6", "M7", "M8", "M10"]
BEST, WITHOUT_WALL = "M8", ["M1", "M2", "M5", "M6"]
OBSERVERS, CONTROLLERS = ([use for use in USES if use.startswith(kind)] for kind in ("obs", "con"))
CONTROL_HEADS = {  # of the controllers' quantities -> unit in SI, digits
    "whole task (mm)": ("tracking_error", 1e-3, 2),
    "sine and handling (µm)": ("following_error", 1e-6, 0),
    "command (V)": ("effort", 1.0, 2),
    "air (g)": ("air", 1e-3, 2),
}


def over_plants(errors: xr.DataArray, unit: float = 1.0) -> Interval:
    """Geometric mean over plants and seeds, with the interval over the seeds."""
    logarithms = np.log(errors.transpose("plant", "seed").values / unit).mean(axis=0)
    return student_interval(logarithms).exponential()


def ratio(upper: xr.DataArray, lower: xr.DataArray, digits: int = 2) -> str:
    """Geometric mean of the ratio of paired errors over plants and seeds, with its interval."""
    return with_interval(over_plants(upper / lower), digits)


def observer_table(statistics: xr.Dataset, loop: str) -> str:
    """Errors of replays and observers of one loop, kPa."""
    at = statistics.sel(loop=loop)
    rows = [
        [model, with_interval(over_plants(at["replay_error"].sel(carried=model), 1e3))]
        + [
            with_interval(over_plants(at["estimation_error"].sel(carried=model, sensors=s), 1e3))
            for s in SENSORS
        ]
        for model in at["carried"].values
    ]
    return table(["model", "replay", *(f"observer, {text}" for text in SENSORS.values())], rows)


def controller_table(statistics: xr.Dataset) -> str:
    """Errors, command and air of the controllers, and of P control."""
    rows = [
        [model, SENSORS[sensors]]
        + [
            with_interval(
                over_plants(statistics[name].sel(carried=model, control_sensors=sensors), unit), digits
            )
            for name, unit, digits in CONTROL_HEADS.values()
        ]
        for sensors in CONTROL
        for model in statistics["carried"].values
    ]
    baseline = [
        with_interval(over_plants(statistics[f"baseline_{name}"], unit), digits)
        for name, unit, digits in CONTROL_HEADS.values()
    ]
    return table(["model", "measured", *CONTROL_HEADS], [*rows, ["P control", "x alone", *baseline]])


def correlation_row(statistics: xr.Dataset, use: str) -> list[str]:
    """Mean rank correlation at each k_0 of the models, and what it says where k_0 is right."""
    at = statistics["mean_correlation"].sel(use=use)
    cells = [with_interval(at.sel(factor=factor).values) for factor in statistics["factor"].values]
    return [use, *cells, predicts(at.sel(factor=1.0, bound="low").item())]


def correlation_of(statistics: xr.Dataset, use: str, models: list[str]) -> str:
    """Rank correlation of some models alone, with the right k_0: mean over the plants, with its interval."""
    at, used = carried_at(statistics, 1.0).sel(model=models), USES[use]
    errors = at[used.error].sel(used.at).transpose("plant", "model", "seed").values
    replays = at["replay_error"].sel(loop=used.replayed).transpose("plant", "model", "seed").values
    rng = np.random.default_rng(RESAMPLING_SEED)
    resampled = [correlations(*pair, used.paired, rng) for pair in zip(replays, errors, strict=True)]
    return with_interval(with_bounds(np.mean(resampled, axis=0)))


def tables(statistics: xr.Dataset) -> dict[str, str]:
    """Tables of the page by name."""
    plants, right = statistics["plant"].values, statistics.sel(factor=1.0)
    deviation = statistics["observable_deviation"].sel(carried=BEST) / 1e3
    observable = [
        [p, *("{:.3g}, {:.3g}".format(*deviation.sel(plant=p, sensors=s).values) for s in SENSORS)]
        for p in plants
    ]
    cheapest = [[use, *right["cheapest"].sel(use=use).values] for use in USES]
    heads = ["use", "k_0 halved", "k_0 right", "k_0 doubled", "the ranking"]
    return {
        "observability": table(["plant", *SENSORS.values()], observable),
        "open": observer_table(statistics, "open"),
        "closed": observer_table(statistics, "closed"),
        "controller": controller_table(statistics),
        "correlation": table(heads, [correlation_row(statistics, use) for use in USES]),
        "cheapest": table(["use", *plants], cheapest),
    }


def numbers(statistics: xr.Dataset) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    right, at_right_k_0 = statistics.sel(factor=1.0), carried_at(statistics, 1.0)
    estimation = at_right_k_0["estimation_error"].sel(loop="closed")
    slow = np.exp(np.log(at_right_k_0["following_at_bandwidth"].sel(bandwidth_tried=FIXED)).mean("plant"))
    air = at_right_k_0["air"].sel(control_sensors="both")
    following = at_right_k_0["following_error"].sel(control_sensors="both", model="M1")
    correlation = right["mean_correlation"].sel(bound="estimate")
    loss = right["loss"].sel(use=OBSERVERS)
    mean_loss = np.exp(np.log(loss.sel(bound="estimate")).mean(("use", "plant")))
    enough = loss.sel(bound="high") < ENOUGH
    result = {
        "plants": f"{statistics.sizes['plant']}",
        "slower": f"{FIXED:g}",
        "observers": f"{len(OBSERVERS) * statistics.sizes['plant']}",
        "controllers": f"{len(CONTROLLERS) * statistics.sizes['plant']}",
        "hardly": f"{right['hardly_matters'].sel(use=CONTROLLERS).sum().item()}",
        "air M1/M8": ratio(air.sel(model="M1"), air.sel(model="M8")),
        "baseline": ratio(statistics["baseline_following_error"], following, digits=0),
        "wrong k_0": f"{100 * (loss_by_wrong_k_0(statistics) - 1):.0f}",
        "rank observers": span(correlation.sel(use=OBSERVERS), 2),
        "rank following": f"{correlation.sel(use='controller, following, none').item():.2f}",
        "enough without wall heat": f"{enough.sel(compared=WITHOUT_WALL).any('compared').sum().item()}",
        **{
            f"lost {model}": f"{100 * (mean_loss.sel(compared=model).item() - 1):.0f}"
            for model in ("M8", "M10")
        },
        **{f"enough {m}": f"{enough.sel(compared=m).sum().item()}" for m in ("M7", "M8", "M10")},
    }
    for sensors in CONTROL:
        error = estimation.sel(sensors=sensors)
        for model, digits in (("M1", 1), ("M5", 2)):
            result[f"{model}/M8 {sensors}"] = ratio(error.sel(model=model), error.sel(model="M8"), digits)
        for kind in ("tracking", "following"):
            worst = right["loss"].sel(use=f"controller, {kind}, {sensors}", bound="estimate").max()
            result[f"worst {kind} {sensors}"] = f"{100 * (worst.item() - 1):.1f}"
        result[f"slow {sensors}"] = span(1e6 * slow.sel(control_sensors=sensors), 0)
    for use in OBSERVERS:
        result[f"refined {use}"] = correlation_of(statistics, use, REFINED)
    return result


def loss_by_wrong_k_0(statistics: xr.Dataset) -> float:
    """Error of the observer that uses `BEST` with k_0 off by a factor 2 over that with the right one.

    The largest of all loops and sets of sensors, geometric means over plants and seeds.
    """
    errors = np.log(statistics["estimation_error"]).mean(("plant", "seed"))
    wrong = errors.sel(carried=[f"{BEST}, 0.5 k_0", f"{BEST}, 2 k_0"])
    return float(np.exp((wrong - errors.sel(carried=BEST)).max()))
