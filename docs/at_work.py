"""Numbers and tables of at-work.md."""

import numpy as np
import xarray as xr
from fragments import table

from pneumo.evidence.at_work.at_work_statistics import ENOUGH, USES, carried_at, predicts
from pneumo.statistics.intervals import Interval, student_interval

SENSORS = {"none": "no pressure", "one": "P_A", "both": "both pressures"}
CONTROL = ("none", "both")
FIXED = 33.0  # rad/s, the slower bandwidth that the page shows beside the tuned one
BEST, WITH_WALL, WITHOUT_WALL = "M8", ("M7", "M8", "M10"), ["M1", "M2", "M5", "M6"]
OBSERVERS, CONTROLLERS = ([use for use in USES if use.startswith(kind)] for kind in ("obs", "con"))


def over_plants(errors: xr.DataArray, scale: float) -> Interval:
    """Geometric mean over plants and seeds, with the interval over the seeds."""
    logarithms = np.log(errors.transpose("plant", "seed").values / scale).mean(axis=0)
    return student_interval(logarithms).exponential()


def told(interval: Interval, digits: int) -> str:
    """Value and interval in words."""
    return "{:.{d}f} ({:.{d}f} to {:.{d}f})".format(*interval, d=digits)


def ratio(upper: xr.DataArray, lower: xr.DataArray, digits: int = 2) -> str:
    """Geometric mean of the ratio of paired errors over plants and seeds, with its interval."""
    return told(over_plants(upper / lower, 1.0), digits)


def observer_rows(found: xr.Dataset, loop: str) -> list[list[str]]:
    """Errors of replays and observers of one loop, kPa, a row for each carried model."""
    at = found.sel(loop=loop)
    return [
        [str(name), told(over_plants(at["replay_error"].sel(carried=name), 1e3), 2)]
        + [told(over_plants(at["estimation_error"].sel(carried=name, sensors=s), 1e3), 2) for s in SENSORS]
        for name in found["carried"].values
    ]


def controller_rows(found: xr.Dataset) -> list[list[str]]:
    """Errors, command and air of the controllers, a row for each carried model and the baseline."""
    names = {"tracking_error": (1e-3, 2), "following_error": (1e-6, 0), "effort": (1.0, 2), "air": (1e-3, 2)}
    rows = [
        [str(name), SENSORS[sensors]]
        + [told(over_plants(own[v], scale), d) for v, (scale, d) in names.items()]
        for sensors in CONTROL
        for name in found["carried"].values
        for own in [found.sel(carried=name, control_sensors=sensors)]
    ]
    baseline = [told(over_plants(found[f"baseline_{v}"], scale), d) for v, (scale, d) in names.items()]
    return [*rows, ["P control", "x alone", *baseline]]


def correlation_row(found: xr.Dataset, use: str) -> list[str]:
    """Mean rank correlation at each carried k_0, and what it says where k_0 is right."""
    at = found["mean_correlation"].sel(use=use)
    cells = [told(Interval(*at.sel(factor=factor).values), 2) for factor in found["factor"].values]
    return [use, *cells, predicts(at.sel(factor=1.0, bound="low").item())]


def tables(found: xr.Dataset) -> dict[str, str]:
    """Tables of the page by name."""
    plants, right = found["plant"].values, found.sel(factor=1.0)
    deviation = found["observable_deviation"].sel(carried=BEST) / 1e3
    pairs = [
        [str(p), *("{:.3g}, {:.3g}".format(*deviation.sel(plant=p, sensors=s).values) for s in SENSORS)]
        for p in plants
    ]
    head = ["carried", "replay", *(f"observer, {words}" for words in SENSORS.values())]
    cheapest = [[use, *right["cheapest"].sel(use=use).values.tolist()] for use in USES]
    return {
        "observability": table(["plant", *SENSORS.values()], pairs),
        "open": table(head, observer_rows(found, "open")),
        "closed": table(head, observer_rows(found, "closed")),
        "controller": table(
            ["carried", "measured", "whole task (mm)", "sine and handling (µm)", "command (V)", "air (g)"],
            controller_rows(found),
        ),
        "correlation": table(
            ["use", "k_0 halved", "k_0 right", "k_0 doubled", "the ranking"],
            [correlation_row(found, use) for use in USES],
        ),
        "cheapest": table(["use", *map(str, plants)], cheapest),
    }


def numbers(found: xr.Dataset) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    right = found.sel(factor=1.0)
    own, estimation = carried_at(found, 1.0), carried_at(found, 1.0)["estimation_error"].sel(loop="closed")
    slow = own["following_at_bandwidth"].sel(bandwidth_tried=FIXED)
    made = {
        f"M5/M8 {sensors}": ratio(*(estimation.sel(sensors=sensors, model=m) for m in ("M5", "M8")))
        for sensors in SENSORS
    }
    made |= {
        f"M1/M8 {sensors}": ratio(*(estimation.sel(sensors=sensors, model=m) for m in ("M1", "M8")), digits=1)
        for sensors in SENSORS
    }
    for sensors in CONTROL:
        uses = (f"controller, {kind}, {sensors}" for kind in ("tracking", "following"))
        for kind, use in zip(("tracking", "following"), uses, strict=True):
            worst = right["loss"].sel(use=use, bound="estimate").max()
            made[f"worst {kind} {sensors}"] = f"{100 * (worst.item() - 1):.1f}"
        at = slow.sel(control_sensors=sensors)
        geometric = np.exp(np.log(at).mean("plant"))
        made[f"slow {sensors}"] = "{:.0f} to {:.0f}".format(
            *(1e6 * v for v in (geometric.min(), geometric.max()))
        )
    air = own["air"].sel(control_sensors="both")
    follow = own["following_error"].sel(control_sensors="both", model="M1")
    made |= {
        "air M1/M8": ratio(air.sel(model="M1"), air.sel(model="M8")),
        "plants": f"{found.sizes['plant']}",
        "baseline": ratio(found["baseline_following_error"], follow, digits=0),
        "observers": f"{len(OBSERVERS) * found.sizes['plant']}",
        "controllers": f"{len(CONTROLLERS) * found.sizes['plant']}",
        "hardly": f"{right['hardly_matters'].sel(use=CONTROLLERS).sum().item()}",
        "wrong k_0": f"{100 * (loss_by_wrong_k_0(found) - 1):.0f}",
        "rank observers": "{:.2f} to {:.2f}".format(*rank_of(right, OBSERVERS)),
        "rank following": "{:.2f}".format(rank_of(right, ["controller, following, none"])[0]),
    }
    loss = right["loss"].sel(use=OBSERVERS)
    for model in WITH_WALL:
        own = loss.sel(compared=model)
        made[f"lost {model}"] = f"{100 * (np.exp(np.log(own.sel(bound='estimate')).mean().item()) - 1):.0f}"
        made[f"enough {model}"] = f"{(own.sel(bound='high') < ENOUGH).sum().item()}"
    enough = loss.sel(compared=WITHOUT_WALL, bound="high") < ENOUGH
    made["enough without wall heat"] = f"{enough.any('compared').sum().item()}"
    return made


def rank_of(right: xr.Dataset, uses: list[str]) -> tuple[float, float]:
    """Lowest and highest mean rank correlation between replay errors and errors of the uses."""
    values = right["mean_correlation"].sel(use=uses, bound="estimate")
    return values.min().item(), values.max().item()


def loss_by_wrong_k_0(found: xr.Dataset) -> float:
    """Error of the observer that carries `BEST` with k_0 off by a factor 2 over that with the right one.

    The largest of all loops and sets of sensors, geometric means over plants and seeds.
    """
    errors = np.log(found["estimation_error"]).mean(("plant", "seed"))
    right = errors.sel(carried=BEST)
    wrong = errors.sel(carried=[f"{BEST}, 0.5 k_0", f"{BEST}, 2 k_0"])
    return float(np.exp((wrong - right).max()))
