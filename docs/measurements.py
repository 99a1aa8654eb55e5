"""Numbers and tables of measurements.md."""

from pathlib import Path

import numpy as np
import xarray as xr
from fragments import span, table

from paper.study.closed_records import PART, read_closed_record

DATA = Path(__file__).parents[1] / "data" / "mbari"
SIMPLE = ["isothermal", "adiabatic", "free n"]
WALL = ["wall heat, constant", "wall heat, root of PT"]


def speeds(record: Path) -> tuple[float, float]:
    """RMS speed of the piston, m/s, in the part of a record that is fitted and in the rest."""
    signals = read_closed_record(record)
    v = np.gradient(signals.x, signals.t)
    first = int(PART * len(v))
    return float(np.sqrt(np.mean(v[:first] ** 2))), float(np.sqrt(np.mean(v[first:] ** 2)))


def tables(statistics: xr.Dataset) -> dict[str, str]:
    """Tables of the page by name."""
    records, laws = statistics["record"].values, statistics["law"].values
    held_out, no_leakage = statistics["held_out_rms"] / 1e3, statistics["value"].sel(leakage="none")

    def pair(law: str, record: str, leakage: str) -> str:
        return "{:.1f}, {:.1f}".format(*held_out.sel(law=law, record=record, leakage=leakage).values)

    def values(law: str, record: str) -> list[str]:
        at = no_leakage.sel(law=law, record=record)
        get = {name: at.sel(parameter=name).item() for name in statistics["parameter"].values}
        n = "" if np.isnan(get["n"]) else f"{get['n']:.2f}"
        k = "" if np.isnan(get["k_A"]) else f"{get['k_A']:.0f}, {get['k_B']:.0f}"
        return [f"{1e3 * get['V_d_A']:.1f}, {1e3 * get['V_d_B']:.1f}", n, k]

    leakages = [("none", "without"), ("past the piston", "with")]
    head = ["law", *(f"{record}, {words} leakage" for record in records for _, words in leakages)]
    rows = [[law, *(pair(law, record, name) for record in records for name, _ in leakages)] for law in laws]
    shown = ["free n", *WALL]
    return {
        "held out": table(head, rows),
        "values": table(
            ["record", "law", "dead volumes (L)", "n", "k (W/K)"],
            [[record, law, *values(law, record)] for record in records for law in shown],
        ),
    }


def numbers(statistics: xr.Dataset) -> dict[str, str]:
    """Numbers in the page's sentences by name."""
    held_out = statistics["held_out_rms"].sel(leakage="none") / 1e3
    record = held_out.sel(record="2022-01-28")
    both = np.sqrt((held_out**2).mean("chamber"))
    ratio = both.sel(law=SIMPLE).min("law") / both.sel(law=WALL[0])
    fitted = statistics["fitted_rms"].sel(leakage="none") / 1e3
    friction = statistics["error"].sel(law=WALL[0], record="friction") / 1e3
    k = statistics["value"].sel(law=WALL[0], leakage="none", parameter=["k_A", "k_B"])

    return {
        "simple": span(record.sel(law=SIMPLE), 0),
        "wall": span(record.sel(law=WALL), 1),
        "ratio": span(ratio, 1),
        "k_A": span(k.sel(parameter="k_A"), 0),
        "k_B": span(k.sel(parameter="k_B"), 0),
        "friction wall": span(held_out.sel(record="friction", law=WALL), 0),
        "friction wall fitted": span(fitted.sel(record="friction", law=WALL), 1),
        "friction mean": "{:.1f} and {:.1f}".format(*friction.mean("t").values),
        "friction largest": f"{np.abs(friction).max().item():.0f}",
        "friction speed": "{:.2f} and {:.2f}".format(*speeds(DATA / "friction.nc")),
        "n": span(statistics["value"].sel(law="free n", leakage="none", parameter="n"), 2),
    }
