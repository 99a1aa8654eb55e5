"""Numbers and tables of models at work on plants that are known in part, for at-work.md: decision 76."""

import numpy as np
import xarray as xr
from fragments import table

from pneumo.evidence.at_work.partly_known import ROWS
from pneumo.evidence.at_work.partly_known_statistics import COMPARED, PARTS, PAYS, pays
from pneumo.publish.text.formatting import span_text, with_interval
from pneumo.publish.text.todays_answer import controllers, observers
from pneumo.statistics.intervals import student_interval

SENSORS = {"none": "no pressure", "one": "P_A", "both": "both pressures"}
CYLINDERS = {  # -> plants with that cylinder
    "D": ("E05-E06", "E09-E10", "E13-E14", "stick-slip"),
    "E": ("E07-E08", "E11-E12", "E15-E16", "sagging-supply"),
    "of `pneumo init`": ("open-closed",),
}
SHOWN = (
    *("full", "full, 0.5 k_0", "full, 2 k_0"),
    *("full, k_0 estimated from 2 k_0", "M8, k_0 estimated from 2 k_0"),
)
FULL = [row.name for row in COMPARED if not row.estimates_k_0]
STATES = [row.name for row in COMPARED if row.estimates_k_0]


def percent(scale: float) -> str:
    """Scale as a head of a table."""
    return "all known" if scale == 0 else f"{100 * scale:g} %"


def ratio_table(dataset: xr.Dataset, use: str, sensors: str, scale: str, outer: list[dict[str, str]]) -> str:
    """Errors over those of the best reduced model with the same k_0, by how much is not known."""
    ratios = dataset[f"{use}_over_reduced"].sel(part="all")
    rows = []
    for at in outer:
        for name in SHOWN:
            cells = [
                with_interval(
                    ratios.sel(at | {"compared": name, scale: s}).sel(bound=["value", "low", "high"]).values
                )
                for s in dataset[scale].values
            ]
            words = [text for key, text in at.items() if key == "loop"]
            rows.append([*words, SENSORS[at[sensors]], name, *cells])
    head = ["loop"] if "loop" in outer[0] else []
    return table([*head, "measured", "model", *(percent(s) for s in dataset[scale].values)], rows)


def tables(dataset: xr.Dataset) -> dict[str, str]:
    """Tables of the page by name."""
    outer = [{"loop": loop, "sensors": sensors} for loop in dataset["loop"].values for sensors in SENSORS]
    control = [{"control_sensors": sensors} for sensors in dataset["control_sensors"].values]
    return {
        "observers": ratio_table(dataset, "observer", "sensors", "scale", outer),
        "controllers": ratio_table(dataset, "controller", "control_sensors", "control_scale", control),
        "reach": reach_table(dataset),
    }


def reach(paying: np.ndarray, scales: np.ndarray) -> str:
    """Largest scale up to which something pays without a gap; "nowhere" where it does not if all is known."""
    last = int(np.argmin(np.append(paying, False)))
    return "nowhere" if last == 0 else percent(float(scales[last - 1]))


def reach_table(dataset: xr.Dataset) -> str:
    """Up to what share of `OFF` the full order and k_0 as a state pay, by the criterion."""
    paying, fixed = pays(dataset["observer_over_reduced"]), pays(dataset["observer_over_fixed"])
    full_states = [name for name in STATES if name.startswith("full")]
    columns = {
        "k_0 right": (paying, {"compared": ["full"]}),
        "k_0 told half": (paying, {"compared": ["full, 0.5 k_0"]}),
        "k_0 told twice": (paying, {"compared": ["full, 2 k_0"]}),
        "k_0 estimated": (paying, {"compared": full_states}),
        "k_0 estimated, against fixed": (fixed, {"state": full_states}),
        "M8: k_0 estimated, against fixed": (fixed, {"state": [s for s in STATES if s not in full_states]}),
    }
    rows = []
    for loop in dataset["loop"].values:
        for sensors, words in SENSORS.items():
            at = {"loop": loop, "sensors": sensors}
            cells = [
                reach(every.sel(at | rows_of).all(list(rows_of)).values, dataset["scale"].values)
                for every, rows_of in columns.values()
            ]
            rows.append([loop, words, *cells])
    by_column = dict(zip(columns, list(zip(*rows, strict=True))[2:], strict=True))
    for of_no_use in ("k_0 told twice", "M8: k_0 estimated, against fixed"):  # as the page says
        assert set(by_column[of_no_use]) == {"nowhere"}
    return table(["loop", "measured", *columns], rows)


def over_cylinders(dataset: xr.Dataset) -> str:
    """Of the cases in which the full order pays with k_0 right, those that stay with cylinders as samples."""
    paying = pays(dataset["observer_over_reduced"].sel(compared="full")).stack(
        case=["loop", "sensors", "scale"]
    )
    logs = np.log(dataset["estimation_error"]).mean("seed")
    cases, stay = paying["case"].values[paying.values], 0
    for loop, sensors, scale in cases:
        at = {"loop": loop, "sensors": sensors, "scale": scale}
        best = ROWS[dataset["observer_best_reduced"].sel(at | {"compared": "full"}).item()].name
        ratio = logs.sel(at | {"row": "full"}) - logs.sel(at | {"row": best})
        of_cylinders = [float(ratio.sel(plant=list(plants)).mean()) for plants in CYLINDERS.values()]
        stay += student_interval(np.array(of_cylinders)).high < np.log(PAYS)
    return f"{stay} of {len(cases)}"


def numbers(dataset: xr.Dataset) -> dict[str, str]:
    """Numbers of the page by name."""
    full_states = [name for name in STATES if name.startswith("full")]
    k_0 = dataset["k_0_found"].sel(row=full_states, scale=0.0)
    off = np.abs(np.log(k_0)).median(("plant", "seed", "row"))
    other = dataset["observer_over_reduced"].sel(compared=FULL)
    turned = (pays(other) != (other.sel(bound="high", part=PARTS[1]) < 0.95)).sum().item()

    def span(values: xr.DataArray) -> str:
        return span_text(values.values)

    return {
        "plants": f"{dataset.sizes['plant']}",
        **{f"full_{case.replace(' ', '_')}": text for case, text in observers(dataset).items()},
        "controller": controllers(dataset),
        "cylinders": f"{len(CYLINDERS)}",
        "over_cylinders": over_cylinders(dataset),
        "k_0_found_one": span(np.exp(off.sel(sensors="one"))),
        "k_0_found_both": span(np.exp(off.sel(sensors="both"))),
        "without_new_turns": f"{turned}",
        "cases": f"{other.isel(bound=0, part=0).size}",
    }
