"""Numbers and tables of measured air with flow, on measurements.md."""

from pathlib import Path

import numpy as np
import xarray as xr
from fragments import span, table

from paper.study.closed_records import read_closed_record
from paper.study.measured_air import (
    EQ_7,
    LAWS_OF_WALL,
    NITROGEN,
    SPRING_STORE,
    SPRINGS,
    VESSELS,
    nitrogen_points,
    records,
)
from pneumo.catalogue import measured_conductances
from pneumo.fit.rig.rig_replay import ADIABATIC, rms
from pneumo.physics.cylinder import wetted_area
from pneumo.physics.models import MODELS

DATA = Path(__file__).parents[1] / "data"
FULL = "full order"
T_START = 288.0  # K, of the nitrogen and its vessel
CONSTANT_T = ["M1", "M2", "M3"]


def cell(value: xr.DataArray, form: str) -> str:
    """A number in a table; nothing where there is none."""
    return "" if np.isnan(value.item()) else f"{value.item():{form}}"


def kilopascals(air: xr.Dataset, variable: str, case: str, model: str) -> str:
    """An error of pressure, kPa."""
    return cell(air[variable].sel(case=case, model=model) / 1e3, ".2f")


def estimate(air: xr.Dataset, case: str, model: str, parameter: str, form: str = ".3g") -> str:
    """An estimate, in bold where it is on a bound; a dash where the record does not determine it."""
    at = {"case": case, "model": model, "parameter": parameter}
    text, low = cell(air["estimate"].sel(at), form), air["low"].sel(at).item()
    if text and np.isinf(low):
        return "–"
    return f"**{text}**" if text and np.isnan(low) else text


def storage_rows(air: xr.Dataset) -> list[list[str]]:
    """Errors held out by record and law of wall heat, with the store's conductances and heat capacity."""
    rows = list[list[str]]()
    for case in VESSELS:
        of_laws = [(case, FULL), (case, EQ_7), (f"{case}, store", FULL), (f"{case}, skin", FULL)]
        k = estimate(air, f"{case}, store", FULL, "store_k_W_per_K", ".2f")
        c = estimate(air, f"{case}, store", FULL, "store_c_J_per_K", ".0f")
        rows.append([case, *(kilopascals(air, "held_out", *law) for law in of_laws), k, c])
    for record in SPRINGS:
        for chamber in "AB":
            part = air.sel(record=record, chamber=chamber)
            held_out = [cell(part["spring_held_out"].sel(wall=law) / 1e3, ".1f") for law in LAWS_OF_WALL]
            of_store = part["spring_c"].sel(wall=LAWS_OF_WALL[2])
            c = cell(of_store, ".0f") if of_store < SPRING_STORE[1] else f"**{of_store.item():.0f}**"
            rows.append([f"gas spring `{record}`, {chamber}", *held_out, "", c])
    return rows


def tables(air: xr.Dataset) -> dict[str, str]:
    """Tables by name."""
    models = [str(name) for name in air["model"].values]
    pulses = [
        [
            name,
            kilopascals(air, "held_out", "pulses", name),
            estimate(air, "pulses", name, "n"),
            estimate(air, "pulses", name, "k_0_W_per_K"),
            kilopascals(air, "held_out", "pulses, free", name),
            estimate(air, "pulses, free", name, "n"),
            kilopascals(air, "held_out", "pulses, no hose", name),
            estimate(air, "pulses, no hose", name, "dead_volume_mL", ".0f"),
        ]
        for name in models
    ]
    vessel = [
        [
            name,
            kilopascals(air, "fitted", "discharge", name),
            kilopascals(air, "held_out", "discharge", name),
            cell(air["T_error"].sel(case="discharge", model=name), ".0f"),
            estimate(air, "discharge", name, "C_d"),
            estimate(air, "discharge", name, "n"),
            estimate(air, "discharge", name, "k_0_W_per_K"),
            kilopascals(air, "other_P", "filling", name),
            kilopascals(air, "fitted", "discharge, free", name),
            estimate(air, "discharge, free", name, "C_d"),
            estimate(air, "discharge, free", name, "n"),
        ]
        for name in models
    ]
    filling = [
        [
            name,
            kilopascals(air, "fitted", "filling", name),
            kilopascals(air, "held_out", "filling", name),
            cell(air["T_error"].sel(case="filling", model=name), ".0f"),
            estimate(air, "filling", name, "C_d"),
            kilopascals(air, "other_P", "discharge", name),
            kilopascals(air, "fitted", "filling, free", name),
            estimate(air, "filling, free", name, "C_d"),
            estimate(air, "filling, free", name, "n"),
        ]
        for name in models
    ]
    head = [
        "model",
        "fitted",
        "held out",
        "T (K)",
        "C_d",
        "n",
        "k (W/K)",
        "from the filling",
        "free: fitted",
        "C_d",
        "n",
    ]
    return {
        "pulses": table(
            ["model", "held out", "n", "k (W/K)", "free: held out", "n", "no hose: held out", "V_d (mL)"],
            pulses,
        ),
        "discharge": table(head, vessel),
        "storage": table(
            ["record", *LAWS_OF_WALL, "of the store: k (W/K)", "c (J/K)"],
            storage_rows(air),
        ),
        "nitrogen": table(
            ["model", "fitted", "held out", "T (K)", "C_d", "n", "k (W/K)"],
            [
                [
                    name,
                    *(
                        cell(air[error].sel(case=NITROGEN, model=name) / 1e3, ".0f")
                        for error in ("fitted", "held_out")
                    ),
                    cell(air["T_error"].sel(case=NITROGEN, model=name), ".0f"),
                    estimate(air, NITROGEN, name, "C_d"),
                    estimate(air, NITROGEN, name, "n"),
                    estimate(air, NITROGEN, name, "k_0_W_per_K"),
                ]
                for name in models
            ],
        ),
        "filling": table([*head[:5], "from the discharge", "free: fitted", "C_d", "n"], filling),
    }


def with_ends(air: xr.Dataset, case: str, parameter: str, form: str = ".2g") -> str:
    """Estimate of the full order with its interval."""
    values = (
        air[name].sel(case=case, model=FULL, parameter=parameter).item()
        for name in ("estimate", "low", "high")
    )
    value, low, high = values
    return f"{value:{form}} ({max(low, 0):{form}} to {high:{form}})"


def spring_text(air: xr.Dataset, record: str, chamber: str) -> str:
    """Errors held out of a chamber of the gas spring, with a constant conductance and with a heat store."""
    errors = air["spring_held_out"].sel(
        record=record, chamber=chamber, wall=[LAWS_OF_WALL[0], LAWS_OF_WALL[2]]
    )
    return " to ".join(f"{error:.1f}" for error in errors.values / 1e3)


def nitrogen_numbers(air: xr.Dataset) -> dict[str, str]:
    """Numbers of the nitrogen's vessel."""
    held, T = air["held_out"].sel(case=NITROGEN) / 1e3, air["T_error"].sel(case=NITROGEN)
    walls = {name: np.ptp(nitrogen_points(DATA, name).values) for name in ("T_wall", "T_outer")}
    top, bottom = (nitrogen_points(DATA, name) for name in ("T", "T_low"))
    apart = top.values - np.interp(top.t, *bottom)
    return {
        "constant": span(held.sel(model=CONSTANT_T), 0),
        **{name: f"{held.sel(model=name).item():.0f}" for name in ("M6", "M8", "M10")},
        "full": f"{held.sel(model=FULL).item():.0f}",
        "eq 7": f"{held.sel(model=EQ_7).item():.0f}",
        "T full": f"{T.sel(model=FULL).item():.0f}",
        "T eq 7": f"{T.sel(model=EQ_7).item():.0f}",
        "wall": f"{walls['T_wall']:.0f}",
        "outer": f"{walls['T_outer']:.0f}",
        "apart": f"{apart.max():.0f}",
        "cold wall": f"{rms(nitrogen_points(DATA, 'T_wall').values - T_START):.0f}",
        "skin wall": f"{air['T_wall_error'].sel(case=f'{NITROGEN}, skin', model=FULL).item():.0f}",
    }


def numbers(air: xr.Dataset) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    held, other = air["held_out"] / 1e3, air["other_P"] / 1e3
    pulses, bare = held.sel(case="pulses"), held.sel(case="pulses, no hose")
    discharge, T = held.sel(case="discharge"), air["T_error"].sel(case="discharge")
    worse_way = other.sel(case=["discharge", "filling"]).max("case")
    assert worse_way["model"].values[worse_way.values.argmin()] == FULL  # as the page says
    replayed = [name for name in MODELS if name in air["model"].values]  # of those that there were
    eq_6 = [name for name in replayed if MODELS[name].temperature == "polytropic"]
    c = air["spring_c"].sel(wall=LAWS_OF_WALL[2])
    lag = air["estimate"].sel(case="discharge, lag", model=FULL, parameter="T_lag_s").item()
    return {
        "hose": span(pulses, 1),
        "no hose": span(bare, 1),
        "pulses M1": f"{pulses.sel(model='M1').item():.2f}",
        "pulses M3": f"{pulses.sel(model='M3').item():.2f}",
        "pulses M6": f"{pulses.sel(model='M6').item():.2f}",
        "pulses M8": f"{pulses.sel(model='M8').item():.2f}",
        "pulses full": f"{pulses.sel(model=FULL).item():.2f}",
        "pulses adiabatic": f"{pulses.sel(model=ADIABATIC).item():.2f}",
        "pulses k high": f"{air['high'].sel(case='pulses', model=FULL, parameter='k_0_W_per_K').item():.1f}",
        "pulses hose": with_ends(air, "pulses", "hose_volume_mL"),
        "pulses P_s": with_ends(air, "pulses", "P_s_bar", ".3g"),
        "discharge constant": span(discharge.sel(model=CONSTANT_T), 0),
        "discharge M6": f"{discharge.sel(model='M6').item():.1f}",
        "discharge M8": f"{discharge.sel(model='M8').item():.1f}",
        "discharge M10": f"{discharge.sel(model='M10').item():.1f}",
        "discharge full": f"{discharge.sel(model=FULL).item():.1f}",
        "discharge k": with_ends(air, "discharge", "k_0_W_per_K"),
        "discharge free M5": f"{held.sel(case='discharge, free', model='M5').item():.1f}",
        "discharge free n": estimate(air, "discharge, free", "M5", "n", ".1f").strip("*"),
        "discharge free C_d": estimate(air, "discharge, free", "M5", "C_d", ".2f").strip("*"),
        "T eq 6": span(T.sel(model=eq_6), 0),
        "other full": f"{other.sel(case='discharge', model=FULL).item():.1f}",
        "other M1": f"{other.sel(case='discharge', model='M1').item():.1f}",
        "other full T": f"{air['other_T'].sel(case='discharge', model=FULL).item():.0f}",
        "other eq 6": span(other.sel(case="discharge", model=eq_6), 0),
        "back full": f"{other.sel(case='filling', model=FULL).item():.1f}",
        "back eq 7": f"{other.sel(case='filling', model=EQ_7).item():.1f}",
        "back M": span(other.sel(case="filling", model=replayed), 0),
        "both ways others": f"{worse_way.drop_sel(model=FULL).min().item():.0f}",
        "T full": f"{T.sel(model=FULL).item():.0f}",
        "T lag": f"{air['T_error'].sel(case='discharge, lag', model=FULL).item():.0f}",
        "lag": f"{lag:.0f}",
        **{f"spring {record}": spring_text(air, record, "A") for record in SPRINGS},
        **{f"spring c A {record}": f"{c.sel(record=record, chamber='A').item():.0f}" for record in SPRINGS},
        "spring c B": span(c.where(c < SPRING_STORE[1]).sel(chamber="B"), 0),
        "store": f"{held.sel(case='discharge, store', model=FULL).item():.1f}",
        "filling": span(held.sel(case="filling"), 1),
        **{f"nitrogen {name}": text for name, text in nitrogen_numbers(air).items()},
    }


def two_digits(value: float) -> str:
    """A number to two digits or, where it has more before the point, to all of these."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"


def wall_table(air: xr.Dataset, gas_spring: xr.Dataset) -> str:
    """Measured wall conductances by size, beside the catalogue's.

    lambda_0 = k / A_q, with A_q of a plain cylinder of the gas's volume (`wetted_area`).
    """
    rows = [
        (f"{m.cylinder}, {m.type}", m.bore, m.V_f, m.A_q, m.k_0, "catalogue, 2007")
        for m in measured_conductances()
    ]
    rigs = records(DATA)
    travel = np.mean([run.x.mean() for run in rigs["pulses"][1]])
    bore = rigs["pulses"][0].ends["bore"][0]

    def estimate_of(case: str, parameter: str) -> float:
        return air["estimate"].sel(case=case, model=FULL, parameter=parameter).item()

    V = estimate_of("pulses", "dead_volume_mL") * 1e-6 + np.pi / 4 * bore**2 * travel
    rows.append(
        (
            "behind an on/off valve",
            bore,
            V,
            wetted_area(V, bore),
            estimate_of("pulses", "k_0_W_per_K"),
            "`pulses`",
        )
    )
    for name, case in (("vessel", "discharge"), ("vessel, nitrogen", NITROGEN)):
        with xr.open_dataset(DATA / f"tank/{case}.nc", decode_times=False) as tank:
            bore, V = tank.attrs["diameter_m"], rigs[case][0].ends["volume"][0]
        rows.append((name, bore, V, wetted_area(V, bore), estimate_of(case, "k_0_W_per_K"), f"`{case}`"))
    values = gas_spring["value"].sel(law="wall heat, constant", leakage="none")
    for record in gas_spring["record"].values:
        signals = read_closed_record(DATA / f"mbari/{record}.nc")
        for side, area in zip("AB", signals.areas, strict=True):
            at = values.sel(record=record)
            V = at.sel(parameter=f"V_d_{side}").item() + area * signals.uncovered["AB".index(side)].mean()
            k = at.sel(parameter=f"k_{side}").item()
            rows.append(
                (f"gas spring, {side}", signals.bore, V, wetted_area(V, signals.bore), k, f"`{record}`")
            )
    return table(
        ["gas in", "bore (mm)", "V (L)", "k (W/K)", "λ (W/(m² K))", "λ V/A (W/(m K))", "from"],
        [
            [
                name,
                f"{1e3 * d:.0f}",
                f"{1e3 * V:.3g}",
                two_digits(k),
                two_digits(k / A),
                f"{k / A * V / A:.2f}",
                source,
            ]
            for name, d, V, A, k, source in rows
        ],
    )
