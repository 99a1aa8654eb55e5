"""Tables 5, 7, 8 and 9 from the files in results/, beside the printed ones: with xarray and pandas alone.

Run it in a checkout after `make reproduce`: python docs/recompute_tables.py
"""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

RESULTS, PRINTED = Path("results"), Path("paper/2006/published")
LEVELS = {"adiabatic": (0.02, 0.1), "typical": (0.1, 0.5), "isothermal": (0.5, 2.5)}  # k_0, W/K


def settling_time(run: xr.Dataset, quantity: str) -> float:
    """Time from the release, s, after which P_A, P_B, T_A or T_B stays within 1 % of its change."""
    free = run.sel(t=slice(run["release_time"].item(), None))
    series = free[quantity[0]].sel(chamber=quantity[-1])
    if quantity[0] == "P":
        off = abs(series - series[-1])
        band = 0.01 * off[0]
    else:
        off = abs(series - run["T_amb"])
        band = 0.01 * off.max()
    settled = np.flatnonzero(off > band)[-1] + 1
    return float(free["t"][settled] - run["release_time"])


def averages(cells: xr.Dataset) -> pd.DataFrame:
    """Rows of Table 7 or 9: eqs (14) to (16), with a sample variance of the means of the experiments."""
    mean, mse = cells["mean_error"], cells["mse"]
    variance = (mse - mean**2).mean("experiment") + mean.var("experiment", ddof=1)
    rows = {"mu": mean.mean("experiment"), "sigma": variance**0.5, "mse": mse.mean("experiment")}
    return pd.DataFrame({name: column.to_series() for name, column in rows.items()})


def recomputed(results: Path) -> dict[str, pd.DataFrame]:
    """Tables 5, 7, 8 and each level of Table 9, from the files of a study."""
    runs = {file.stem: xr.load_dataset(file) for file in sorted((results / "settling").glob("*.nc"))}
    settled = {
        name: {q: settling_time(run, q) for q in ("P_A", "P_B", "T_A", "T_B")} for name, run in runs.items()
    }
    files = sorted((results / "published/replay").glob("*.nc"))
    parts = [xr.open_dataset(file)[["mean_error", "mse"]] for file in files]
    cells = xr.concat(parts, "experiment", coords=["k_0"], compat="override").mean("chamber")
    best_n = cells["mse"].idxmin("n")
    tables = {
        "Table 5": pd.DataFrame(settled).T,
        "Table 7": averages(cells.sel(n=best_n)),
        "Table 8": best_n.to_pandas(),
    }
    for level, k_0 in LEVELS.items():
        part = cells.sel(experiment=cells["k_0"].round(2).isin(k_0))
        constant_n = part["mse"].mean("experiment").idxmin("n")
        tables[f"Table 9, {level}"] = averages(part.sel(n=constant_n))
    return tables


def printed(name: str, folder: Path) -> pd.DataFrame:
    """Table of the paper by its name in `recomputed`, in the same units."""
    number, _, level = name.removeprefix("Table ").partition(", ")
    cells = pd.read_csv(folder / f"table{number}.csv")
    if level:
        cells = cells[cells["level"] == level]
    values = cells["printed"].astype(float) * cells.get("scale", 1.0)
    return cells.assign(value=values).pivot(index="row", columns="column", values="value")


def beside(table: pd.DataFrame, of_paper: pd.DataFrame) -> pd.DataFrame:
    """Columns that both tables have, each with the printed numbers to its right."""
    columns = [name for name in table if name in of_paper]
    both = {name: {"here": table[name], "printed": of_paper[name]} for name in columns}
    return pd.concat({name: pd.DataFrame(pair) for name, pair in both.items()}, axis=1).loc[table.index]


if __name__ == "__main__":
    for name, table in recomputed(RESULTS).items():
        print(f"\n{name}\n{beside(table, printed(name, PRINTED)).to_string(float_format='{:.4g}'.format)}")
