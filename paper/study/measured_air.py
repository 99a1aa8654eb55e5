"""Every model on measured air with flow: a chamber behind an on/off valve, and a vessel (decision 101)."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from paper.study.closed_records import T_WALL, THINNED, read_closed_record
from pneumo.errors import ResultError
from pneumo.fitting.fit_result import FitResult, rms_of_chambers
from pneumo.fitting.record.columns import Column
from pneumo.fitting.rig.rig_file import Rig, factor, key, read_rig
from pneumo.fitting.rig.rig_file import rig as read_rig_of
from pneumo.fitting.rig.rig_fit import judged, judged_models
from pneumo.fitting.rig.rig_record import Points, Run, read_runs
from pneumo.fitting.rig.rig_replay import (
    ADIABATIC,
    RIG_MODELS,
    WALLS,
    errors,
    replay_run,
    rms,
    run_errors,
)
from pneumo.physics.models import MODELS

PULSES, DISCHARGE, FILLING, NITROGEN = "pulses", "discharge", "filling", "nitrogen"
VESSELS = (DISCHARGE, FILLING, NITROGEN)
SHOWN = ("M1", "M5", "M6", "M8", "full order")  # in figures
MOST_SHOWN = 150  # samples of a replay
WALL_FULL = [name for name in WALLS if name != ADIABATIC]
FREE_N, FREE_C_D, FREE_VOLUME = (0.5, 6.0), (0.1, 2.0), (0.5e-6, 4e-4)  # decision 101
LAG = (0.0, 20.0)  # s, of a thermometer
STORE_K, STORE_C = (0.0, 100.0), (0.0, 5000.0)  # W/K and J/K, of a heat store
SKIN_K, SKIN_C = (0.0, 2000.0), (0.0, 3e5)  # of a skin of the wall, between the gas and the rest of the wall
SPRING_STORE = (0.0, 2000.0)  # W/K and J/K, of a heat store in the gas spring
VESSEL_SKIN_C = (10.0, 3e5)  # J/K: a thinner one takes ever smaller steps, as a better conductance does
LEAST_THROUGH = 1e-3  # W/K, below which nothing flows through a skin to the wall
SPRINGS = ("2021-07-26", "2022-01-28", "friction")  # records of data/mbari with closed chambers
SPRING_BOUNDS = {"dead_volume_mL": [5e3, 1.5e5], "k_0_W_per_K": [0, 400], "T_start_K": [200, 400]}
ROD_MM = 38.1  # in chamber B
FULL_ORDER = "full order"
OPEN = {"low": -np.inf, "high": np.inf}  # ends of an interval
EQ_7 = "full order, eq (7)"
LAWS_OF_WALL = ("constant", "eq (7)", "store beside the gas", "skin of the wall")
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
    for name in VESSELS:
        vessel = read_rig(tank / f"{name}.yaml")
        found[name] = vessel, read_runs(tank / f"{name}.nc", vessel)
    vessel, (run,) = found[NITROGEN]
    top, bottom = run.T, nitrogen_points(data, "T_low")
    if top is None:
        raise ResultError(f"{tank / 'nitrogen.nc'}: no gas temperature")
    mean = (top.values + np.interp(top.t, *bottom)) / 2
    found[NITROGEN] = vessel, [run._replace(T=Points(top.t, mean))]
    return found


def nitrogen_points(data: Path, name: str) -> Points:
    """Measured temperature of the vessel of nitrogen, K, by name: T, T_low, T_wall or T_outer."""
    with xr.open_dataset(data / "tank" / "nitrogen.nc", decode_times=False) as points:
        return Points(points[f"t_{name}"].values, points[name].values)


def with_skin(rig: Rig, k: tuple[float, float] = SKIN_K, c: tuple[float, float] = SKIN_C) -> Rig:
    """Return the rig with a skin of the wall between the gas and the rest of the wall.

    The rest of the wall keeps its temperature. `k` and `c` are the bounds of a fit for the skin's
    conductances, W/K, and heat capacity, J/K.
    """
    return rig.changed(k_0=0.0, store_k=k, store_c=c, store_back=k)


def as_store(skin: Mapping[str, float]) -> dict[str, float]:
    """Parameters of a heat store beside the gas that has the same response as a skin of the wall."""
    k, back = skin["store_k"], skin["store_back"]
    both = max(k + back, LEAST_THROUGH)
    through = k * back / both
    c = skin["store_c"] * (k / both) ** 2
    return {**skin, "k_0": through, "store_k": k - through, "store_c": c, "store_back": 0.0}


def as_skin(store: Mapping[str, float]) -> dict[str, float]:
    """Inverse of `as_store`."""
    k, through = store["store_k"] + store["k_0"], max(store["k_0"], LEAST_THROUGH)
    back = k * through / max(k - through, LEAST_THROUGH)
    c = store["store_c"] * ((k + back) / k) ** 2
    return {**store, "k_0": 0.0, "store_k": k, "store_c": c, "store_back": back}


def measured_air(data: Path, progress: Callable[[str], None] = lambda _text: None) -> xr.Dataset:
    """Errors and estimates of every model on every record of the folder ``data``, by (case, model).

    `other_P`, Pa, and `other_T`, K, are errors on the other run of the vessel of air, with the parameters
    fitted to this one. `T_wall_error`, K, is the error of the skin's temperature against that measured on
    the wall of the vessel of nitrogen. The models of `SHOWN` also replay one run of each record: of the
    pulses one that was not fitted, of the vessels the fitted one.
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
    for name in VESSELS:
        rig = rigs[name][0]
        cases[name] = name, rig, RIG_MODELS, False
        if name != NITROGEN:
            cases[f"{name}, free"] = name, rig.changed(n=FREE_N, C_d=FREE_C_D), RIG_MODELS, False
            cases[f"{name}, lag"] = name, rig.changed(T_lag=LAG), WALL_FULL, True
        k, c = (SKIN_K, SKIN_C) if name == NITROGEN else (STORE_K, STORE_C)
        cases[f"{name}, store"] = name, rig.changed(store_k=k, store_c=c), WALL_FULL, False
        cases[f"{name}, skin"] = name, with_skin(rig, k, VESSEL_SKIN_C), [FULL_ORDER], False
    parts, fits = list[xr.Dataset](), dict[str, FitResult]()
    for case, (name, rig, models, temperature) in cases.items():
        runs = rigs[name][1]
        fit = judged_models(
            rig, runs, models, temperature, lambda text, case=case: progress(f"{case}: {text}")
        )
        fits[case], part = fit, kept(fit)
        if name in (DISCHARGE, FILLING):
            other = FILLING if name == DISCHARGE else DISCHARGE
            part = part.merge(_on_other(fit, rig, *rigs[other]))
        if case == f"{NITROGEN}, skin":
            replayed = replay_run(rig, FULL_ORDER, values_of(fit, rig, FULL_ORDER), runs[0])
            off = rms(errors(replayed.T_store, nitrogen_points(data, "T_wall")))
            part["T_wall_error"] = ("model", [off], {"units": "K"})
        parts.append(part.reindex(model=list(RIG_MODELS)))
    joined = xr.concat(parts, xr.Variable("case", list(cases)), join="outer")
    for name, (rig, runs) in rigs.items():
        joined = joined.merge(_shown(fits[name], name, rig, runs[-1]))
    joined["shown"] = ("shown", list(SHOWN))
    return joined.merge(gas_spring(data / "mbari", progress))


def values_of(fit: FitResult, rig: Rig, model: str) -> dict[str, float]:
    """All quantities of a rig with the estimates of a model, SI units."""
    found = {name: interval.value for name, interval in fit.estimates(model).items()}
    return {name: low for name, (low, _) in rig.ends.items()} | found


def kept(fit: FitResult) -> xr.Dataset:
    """Errors of a fit by model, and estimates in the units of a rig's file; bounds have no interval.

    An open end is infinite, and an end is NaN where the estimate is on a bound of the search.
    """
    data, names = fit.data, [str(name) for name in fit.data["parameter"].values]
    units = xr.DataArray([factor(name) for name in names], dims="parameter")
    free = data["estimate"].notnull() & (data["at_bound"] == 0)
    ends = {name: data[name].where(data[name].notnull() | ~free, sign) for name, sign in OPEN.items()}
    columns = {"estimate": data["estimate"], **ends}
    errors = {name: np.sqrt((data[f"rms_{name}"] ** 2).mean("chamber")) for name in ("fitted", "held_out")}
    found = xr.Dataset({name: column / units for name, column in columns.items()} | errors)
    found["T_error"] = data["rms_temperature"]
    return found.assign_coords(parameter=[key(name) for name in names]).drop_vars(
        "parameter_unit", errors="ignore"
    )


def spring_chamber(folder: Path, record: str, side: int) -> tuple[Rig, Run]:
    """Rig and run of one closed chamber of the gas spring."""
    signals = read_closed_record(folder / f"{record}.nc")
    x, P = signals.uncovered[side], signals.P[side]
    run = Run(signals.h, x - x.min(), np.nan, np.nan, Points(signals.t[::THINNED], P[::THINNED]))
    about = {
        "gas": "nitrogen",
        "bore_mm": 1e3 * signals.bore,
        "rod_mm": 0.0 if side == 0 else ROD_MM,
        "T_surroundings_K": T_WALL,
        "P_start_bar": [0.97e-5 * float(P[0]), 1.03e-5 * float(P[0])],
    }
    return read_rig_of({**about, **SPRING_BOUNDS}, str(folder)), run


def gas_spring(folder: Path, progress: Callable[[str], None] = lambda _text: None) -> xr.Dataset:
    """Fit the full order, with each law of wall heat, to each closed chamber of the gas spring.

    By (record, chamber, wall): errors `spring_fitted` and `spring_held_out`, Pa; `spring_k`, conductance
    from the gas to the wall or its skin, W/K; `spring_c`, heat capacity of the store or skin, J/K. The first
    60 % of a record are fitted.
    """
    rows = list[list[list[tuple[float, ...]]]]()
    for record in SPRINGS:
        chambers = list[list[tuple[float, ...]]]()
        for side in range(2):
            rig, run = spring_chamber(folder, record, side)
            constant = judged(rig, FULL_ORDER, [run])
            near = constant.values
            store = rig.changed(store_k=SPRING_STORE, store_c=SPRING_STORE)
            beside = near | {"store_k": STORE_K[1] / 2, "store_c": 50.0}
            skin = near | {"store_k": near["k_0"], "store_c": 1e3, "store_back": near["k_0"]}
            by_store = judged(store, FULL_ORDER, [run], near=beside)
            by_skin = judged(with_skin(rig), FULL_ORDER, [run], near=skin)
            # Both are the same response: a search that ended higher begins again where the other ended.
            if rms_of_chambers(by_skin.rms) < rms_of_chambers(by_store.rms):
                again = judged(store, FULL_ORDER, [run], near=as_store(by_skin.values))
                by_store = min(by_store, again, key=lambda law: rms_of_chambers(law.rms))
            else:
                again = judged(with_skin(rig), FULL_ORDER, [run], near=as_skin(by_store.values))
                by_skin = min(by_skin, again, key=lambda law: rms_of_chambers(law.rms))
            laws = (constant, judged(rig, EQ_7, [run], near=near), by_store, by_skin)
            chambers.append(
                [
                    (*(rms_of_chambers(e) for e in (j.rms, j.held_out)), j.values[k], j.values["store_c"])
                    for j, k in zip(laws, ("k_0", "k_0", "k_0", "store_k"), strict=True)
                ]
            )
            of_laws = ", ".join(f"{rms_of_chambers(law.held_out) / 1e3:.2f}" for law in laws)
            progress(f"{record} {'AB'[side]}: {of_laws} kPa held out: {', '.join(LAWS_OF_WALL)}")
        rows.append(chambers)
    names = {"spring_fitted": "Pa", "spring_held_out": "Pa", "spring_k": "W K-1", "spring_c": "J K-1"}
    by = ("record", "chamber", "wall")
    values = np.moveaxis(np.array(rows), -1, 0)
    return xr.Dataset(
        {name: (by, part, {"units": unit}) for (name, unit), part in zip(names.items(), values, strict=True)},
        {"record": list(SPRINGS), "chamber": ["A", "B"], "wall": list(LAWS_OF_WALL)},
    )


def _on_other(fit: FitResult, rig: Rig, other: Rig, runs: list[Run]) -> xr.Dataset:
    """Errors on the other run of the vessel, whose own start and surroundings are used."""
    columns = {
        name: float(np.mean(other.ends[name]))
        for name in ("P_start", "P_surroundings", "T_surroundings", "T_start")
    }
    rows = [
        [rms(error) for error in run_errors(rig, model, values_of(fit, rig, model) | columns, runs[0])]
        for model in fit.models
    ]
    P, T = np.transpose(rows)
    errors = {"other_P": ("model", P, {"units": "Pa"}), "other_T": ("model", T, {"units": "K"})}
    return xr.Dataset(errors, {"model": fit.models})


def _shown(fit: FitResult, name: str, rig: Rig, run: Run) -> xr.Dataset:
    """A run as it was measured and as the models of `SHOWN` replay it."""
    replays = [replay_run(rig, model, values_of(fit, rig, model), run) for model in SHOWN]
    t, thin = f"t_{name}", max(1, len(run.t) // MOST_SHOWN)
    shown = xr.Dataset(
        {
            f"P_{name}": (
                ("shown", t),
                [replayed.pressures[0].values[::thin] for replayed in replays],
                {"units": "Pa"},
            ),
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
