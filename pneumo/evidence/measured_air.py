"""Every model on measured air with flow: a chamber behind an on/off valve, and a vessel (decision 101)."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.fit.closed.thermal_laws import T_WALL, THINNED, read_closed_record
from pneumo.fit.record.columns import Column
from pneumo.fit.rig.rig_file import Rig, factor, key, read_rig
from pneumo.fit.rig.rig_file import rig as read_rig_of
from pneumo.fit.rig.rig_fit import (
    ADIABATIC,
    FULL,
    RIG_MODELS,
    judged,
    judged_models,
    replay_run,
    rms,
    run_errors,
)
from pneumo.fit.rig.rig_record import Points, Run, read_runs
from pneumo.physics.models import MODELS

PULSES, DISCHARGE, FILLING = "pulses", "discharge", "filling"
SHOWN = ("M1", "M5", "M6", "M8", "full order")  # in figures
MOST_SHOWN = 150  # samples of a replay
WALL_FULL = [name for name in FULL if name != ADIABATIC]
FREE_N, FREE_C_D, FREE_VOLUME = (0.5, 6.0), (0.1, 2.0), (0.5e-6, 4e-4)  # decision 101
LAG = (0.0, 20.0)  # s, of a thermometer
STORE_K, STORE_C = (0.0, 100.0), (0.0, 5000.0)  # W/K and J/K, of a heat store
SPRINGS = ("2021-07-26", "2022-01-28", "friction")  # records of data/mbari with closed chambers
SPRING_BOUNDS = {"dead_volume_mL": [5e3, 1.5e5], "k_0_W_per_K": [0, 400], "T_start_K": [200, 400]}
ROD_MM = 38.1  # in chamber B
FULL_ORDER = "full order"
GAUGE = {
    "t": Column(column="t", unit="s"),
    "x": Column(column="x", unit="m"),
    "P_A": Column(column="p", unit="Pa(g)"),
}


def records(data: Path) -> dict[str, tuple[Rig, list[Run]]]:
    """Rig and runs of each record, from the folder ``data``."""
    valve, tank = data / "valve_driven", data / "tank"
    rig = read_rig(valve / "rig.yaml")
    found = {PULSES: (rig, read_runs(valve / "pulses.nc", rig, GAUGE, from_edges=True))}
    for name in (DISCHARGE, FILLING):
        vessel = read_rig(tank / f"{name}.yaml")
        found[name] = vessel, read_runs(tank / f"{name}.nc", vessel)
    return found


def measured_air(data: Path, progress: Callable[[str], None] = lambda _text: None) -> xr.Dataset:
    """Errors and estimates of every model on every record of the folder ``data``, by (case, model).

    `other_P` and `other_T` are errors on the other run of the vessel, with the parameters of this one. Of
    `SHOWN`, a run that was not fitted (of the pulses) or was (of the vessel) is replayed.
    """
    rigs = records(data)
    with_n = [name for name, model in MODELS.items() if model.has_n]
    hose = ("hose_volume", "hose_C")
    cases = {
        PULSES: (PULSES, rigs[PULSES][0], RIG_MODELS, False),
        "pulses, free": (PULSES, rigs[PULSES][0].changed(n=FREE_N, dead_volume=FREE_VOLUME), with_n, False),
        "pulses, no hose": (
            *(PULSES, rigs[PULSES][0].without(*hose).changed(dead_volume=FREE_VOLUME), RIG_MODELS, False),
        ),
    }
    for name in (DISCHARGE, FILLING):
        rig = rigs[name][0]
        cases[name] = name, rig, RIG_MODELS, False
        cases[f"{name}, free"] = name, rig.changed(n=FREE_N, C_d=FREE_C_D), RIG_MODELS, False
        cases[f"{name}, lag"] = name, rig.changed(T_lag=LAG), WALL_FULL, True
        store = rig.changed(store_k=STORE_K, store_c=STORE_C)
        cases[f"{name}, store"] = name, store, WALL_FULL, False
    parts = list[xr.Dataset]()
    for case, (name, rig, models, temperature) in cases.items():
        runs = rigs[name][1]
        part = judged_models(
            rig, runs, models, temperature, lambda text, case=case: progress(f"{case}: {text}")
        )
        if name != PULSES:
            other = FILLING if name == DISCHARGE else DISCHARGE
            part = part.merge(_on_other(part, rig, *rigs[other]))
        parts.append(part.reindex(model=list(RIG_MODELS)))
    joined = xr.concat(parts, xr.Variable("case", list(cases)), join="outer")
    for name, (rig, runs) in rigs.items():
        joined = joined.merge(_shown(joined.sel(case=name), name, rig, runs[-1]))
    joined["shown"] = ("shown", list(SHOWN))
    return joined.merge(gas_spring(data / "mbari", progress))


def gas_spring(folder: Path, progress: Callable[[str], None] = lambda _text: None) -> xr.Dataset:
    """Each chamber of the closed gas spring by the full order, without and with a heat store beside the gas.

    Errors `spring_fitted`, `spring_held_out`, Pa, conductance `spring_k`, W/K, and the store's heat capacity
    `spring_c`, J/K, by (record, chamber, store). The first 60 % of a record are fitted.
    """
    rows = list[list[list[tuple[float, ...]]]]()
    for record in SPRINGS:
        signals = read_closed_record(folder / f"{record}.nc")
        chambers = list[list[tuple[float, ...]]]()
        for side, x in enumerate(signals.uncovered):
            P = signals.P[side]
            run = Run(signals.h, x - x.min(), np.nan, np.nan, Points(signals.t[::THINNED], P[::THINNED]))
            rod = 0.0 if side == 0 else ROD_MM
            about = {
                "gas": "nitrogen",
                "bore_mm": 1e3 * signals.bore,
                "rod_mm": rod,
                "T_surroundings_K": T_WALL,
            }
            start = [0.97e-5 * float(P[0]), 1.03e-5 * float(P[0])]
            rig = read_rig_of({**about, **SPRING_BOUNDS, "P_start_bar": start}, str(folder))
            without = judged(rig, FULL_ORDER, [run])
            near = without.estimate.values | {"store_k": STORE_K[1] / 2, "store_c": 50.0}
            with_store = rig.changed(store_k=(0.0, 2000.0), store_c=(0.0, 2000.0))
            both = without, judged(with_store, FULL_ORDER, [run], near=near)
            chambers.append(
                [
                    (j.estimate.rms, j.held_out, *(j.estimate.values[n] for n in ("k_0", "store_c")))
                    for j in both
                ]
            )
            errors = " and ".join(f"{result.held_out / 1e3:.2f}" for result in both)
            progress(f"{record} {'AB'[side]}: {errors} kPa held out, without and with a store")
        rows.append(chambers)
    names = {"spring_fitted": "Pa", "spring_held_out": "Pa", "spring_k": "W K-1", "spring_c": "J K-1"}
    by = ("record", "chamber", "store")
    values = np.moveaxis(np.array(rows), -1, 0)
    return xr.Dataset(
        {name: (by, part, {"units": unit}) for (name, unit), part in zip(names.items(), values, strict=True)},
        {"record": list(SPRINGS), "chamber": ["A", "B"], "store": ["none", "beside the gas"]},
    )


def _values(part: xr.Dataset, rig: Rig, model: str) -> dict[str, float]:
    """All quantities of a rig with the estimates of a model, SI units."""
    values = {name: low for name, (low, _) in rig.ends.items()}
    for name in values:
        if key(name) in part["parameter"]:
            estimate = part["estimate"].sel(model=model, parameter=key(name)).item()
            values[name] = estimate * factor(name) if np.isfinite(estimate) else values[name]
    return values


def _on_other(part: xr.Dataset, rig: Rig, other: Rig, runs: list[Run]) -> xr.Dataset:
    """Errors on the other run of the vessel; its pressures and temperature before it starts are its own."""
    own = {
        name: float(np.mean(other.ends[name]))
        for name in ("P_start", "P_surroundings", "T_surroundings", "T_start")
    }
    rows = [
        [rms(error) for error in run_errors(rig, model, _values(part, rig, model) | own, runs[0])]
        for model in part["model"].values
    ]
    P, T = np.transpose(rows)
    return xr.Dataset({"other_P": ("model", P, {"units": "Pa"}), "other_T": ("model", T, {"units": "K"})})


def _shown(part: xr.Dataset, name: str, rig: Rig, run: Run) -> xr.Dataset:
    """A run as it was measured and as the models of `SHOWN` replay it."""
    replays = [replay_run(rig, model, _values(part, rig, model), run) for model in SHOWN]
    t, thin = f"t_{name}", max(1, len(run.t) // MOST_SHOWN)
    shown = xr.Dataset(
        {
            f"P_{name}": (("shown", t), [replayed.P.values[::thin] for replayed in replays], {"units": "Pa"}),
            f"measured_P_{name}": (f"tp_{name}", run.P.values, {"units": "Pa"}),
        },
        {t: (t, run.t[::thin], {"units": "s"}), f"tp_{name}": (f"tp_{name}", run.P.t, {"units": "s"})},
    )
    if run.T is not None:
        shown[f"T_{name}"] = (
            ("shown", t),
            [replayed.T.values[::thin] for replayed in replays],
            {"units": "K"},
        )
        shown[f"measured_T_{name}"] = (f"tt_{name}", run.T.values, {"units": "K"})
        shown.coords[f"tt_{name}"] = (f"tt_{name}", run.T.t, {"units": "s"})
    return shown
