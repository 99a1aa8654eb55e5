"""Numbers and figure of at-work.md from results/: `python docs/at_work.py` writes them anew."""

import shutil
from pathlib import Path

import numpy as np
import xarray as xr
from fragments import filled, table

from pneumo.evidence.at_work_statistics import USES, carried_at, predicts
from pneumo.statistics.intervals import Interval, student_interval
from pneumo.storage.kept_evidence import KEPT

PAGE = Path(__file__).with_name("at-work.md")
RESULTS = Path(__file__).parents[1] / "results"
SENSORS = {"none": "no pressure", "one": "P_A", "both": "both pressures"}
CONTROL = ("none", "both")
FIXED = 33.0  # rad/s, the slower bandwidth that the page shows beside the tuned one
BEST, WITHOUT_WALL = "M8", ["M1", "M2", "M5", "M6"]


def stored() -> xr.Dataset:
    """Models at work: of results/, else as kept with the source."""
    return xr.load_dataset(next(p for p in (RESULTS / "at_work.nc", KEPT / "at_work.nc") if p.exists()))


def over_plants(errors: xr.DataArray, scale: float) -> Interval:
    """Geometric mean over plants and seeds, with the interval over the seeds."""
    logarithms = np.log(errors.transpose("plant", "seed").values / scale).mean(axis=0)
    return Interval(*(float(np.exp(end)) for end in student_interval(logarithms)))


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
        "observers M1 to M6": f"{observers_without_wall(right)}",
        "observers": f"{sum(use.startswith('observer') for use in USES) * found.sizes['plant']}",
    }
    return made


def observers_without_wall(right: xr.Dataset) -> int:
    """In how many uses of plants a model without k_0 loses less than 10 % in an observer."""
    observers = [use for use in USES if use.startswith("observer")]
    return int(right["cheapest"].sel(use=observers).isin(WITHOUT_WALL).sum().item())


def refreshed(text: str, found: xr.Dataset) -> str:
    """The page with everything between markers made anew; `KeyError` if a marker's name is unknown."""
    return filled(text, {"table": tables(found), "result": numbers(found)})


if __name__ == "__main__":
    PAGE.write_text(refreshed(PAGE.read_text(encoding="utf-8"), stored()), encoding="utf-8")
    shutil.copyfile(RESULTS / "figures" / "at_work.svg", PAGE.parent / "static" / "at_work.svg")
