"""Numbers and tables of measurements.md, from paper/evidence/measured_air.nc and measurements.nc."""

import numpy as np
import xarray as xr

from paper.study.text.markdown_tables import markdown_table as table
from pneumo.physics.models import MODELS

FULL = "full order"
EQ_7 = "full order, eq (7)"
NITROGEN = "nitrogen"
CONSTANT_T = ["M1", "M2", "M3"]
WITHOUT_WALL_HEAT = ["isothermal", "adiabatic", "free n"]
CONSTANT_K = "wall heat, constant"
HELD_OUT = {  # column -> variable, case
    "on/off valve": ("held_out", "pulses"),
    "discharge": ("held_out", "discharge"),
    "filling": ("held_out", "filling"),
    "discharge from filling": ("other_P", "filling"),
    "filling from discharge": ("other_P", "discharge"),
    "nitrogen": ("held_out", NITROGEN),
}


def span(values: xr.DataArray, digits: int) -> str:
    """Lowest and highest value."""
    return f"{values.min().item():.{digits}f} to {values.max().item():.{digits}f}"


def three_digits(value: float) -> str:
    """A number to three digits, or all of these before the point; empty for NaN."""
    return "" if np.isnan(value) else f"{value:.0f}" if value >= 100 else f"{value:#.3g}".removesuffix(".")


def held_out_table(air: xr.Dataset) -> str:
    """Errors of pressure that no fit used, kPa, by model and record."""
    rows = []
    for model in map(str, air["model"].values):
        errors = [air[name].sel(case=case, model=model).item() / 1e3 for name, case in HELD_OUT.values()]
        rows.append([model, *map(three_digits, errors)])
    return table(["model", *HELD_OUT], rows)


def numbers(air: xr.Dataset) -> dict[str, str]:
    """Numbers and tables of the records with flow."""
    held, other = air["held_out"] / 1e3, air["other_P"] / 1e3
    discharge, T = held.sel(case="discharge"), air["T_error"].sel(case="discharge")
    T_filling = air["T_error"].sel(case="filling")
    # Fitted to the discharge: the larger error, on its part held out or on the filling.
    worse = xr.where(discharge > other.sel(case="discharge"), discharge, other.sel(case="discharge"))
    assert worse.sel(model=[FULL, EQ_7]).max() < worse.drop_sel(model=[FULL, EQ_7]).min()  # as the page says
    wall = air.sel(case="filling", model=FULL, parameter="k_0_W_per_K")
    assert not (np.isfinite(wall["low"]) and np.isfinite(wall["high"]))  # open, as the page says
    of_air = held.sel(model=FULL, case=["pulses", "discharge", "filling"])
    nitrogen = air.sel(case=NITROGEN)
    assert nitrogen["held_out"].sel(model=FULL) < nitrogen["held_out"].sel(model=EQ_7)
    assert nitrogen["T_error"].sel(model=FULL) > nitrogen["T_error"].sel(model=EQ_7)
    eq_6 = [
        name for name in air["model"].values if name in MODELS and MODELS[name].temperature == "polytropic"
    ]
    spring = air["spring_held_out"].sel(chamber="A", wall=["constant", "store beside the gas"]) / 1e3
    return {
        "hose": span(held.sel(case="pulses"), 1),
        "no_hose": span(held.sel(case="pulses, no hose"), 1),
        "full": span(of_air, 1),
        "discharge_constant": span(discharge.sel(model=CONSTANT_T), 0),
        "discharge_full": f"{discharge.sel(model=FULL).item():.1f}",
        "discharge_M8": f"{discharge.sel(model='M8').item():.1f}",
        "filling_M1": f"{held.sel(case='filling', model='M1').item():.2f}",
        "filling_full": f"{held.sel(case='filling', model=FULL).item():.2f}",
        "other_full": f"{other.sel(case='discharge', model=FULL).item():.1f}",
        "back_full": f"{other.sel(case='filling', model=FULL).item():.1f}",
        "one_way_others": f"{worse.drop_sel(model=[FULL, EQ_7]).min().item():.1f}",
        "T_eq_6": span(T.sel(model=eq_6), 0),
        "T_eq_6_filling": span(T_filling.sel(model=eq_6), 0),
        "T_full_filling": f"{T_filling.sel(model=FULL).item():.0f}",
        "T_full": f"{T.sel(model=FULL).item():.0f}",
        **{
            f"spring_{record.replace('-', '_')}": " to ".join(
                f"{error:.1f}" for error in spring.sel(record=record).values
            )
            for record in ("friction", "2022-01-28")
        },
        "table_held_out": held_out_table(air),
    }


def gas_spring_numbers(measured: xr.Dataset) -> dict[str, str]:
    """Numbers and tables of the gas spring, without leakage."""
    values, held_out = (measured[name].sel(leakage="none") for name in ("value", "held_out_rms"))
    squares = (held_out**2).mean("chamber")
    ratio = (squares.sel(law=WITHOUT_WALL_HEAT).min("law") / squares.sel(law=CONSTANT_K)) ** 0.5
    laws, names = measured["law"].values, measured["record"].values
    rows = [
        [
            law,
            *(
                "{:.1f}, {:.1f}".format(*held_out.sel(law=law, record=record).values / 1e3)
                for record in names
            ),
        ]
        for law in laws
    ]
    k = values.sel(law=CONSTANT_K)
    return {
        "ratio": span(ratio, 1),
        "n": span(values.sel(law="free n", parameter="n"), 2),
        "k_A": span(k.sel(parameter="k_A"), 0),
        "k_B": span(k.sel(parameter="k_B"), 0),
        "table_held_out": table(["law", *map(str, names)], rows),
    }
