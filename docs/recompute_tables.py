"""Tables 5, 7, 8 and 9 of the paper from the files in results/, with xarray and NumPy alone."""

import sys
from pathlib import Path

import numpy as np
import xarray as xr

QUANTITIES = ("P_A", "P_B", "T_A", "T_B")
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


def averages(cells: xr.Dataset) -> xr.Dataset:
    """Rows of Table 7 or 9: eqs (14) to (16), with a sample variance of the means of the experiments."""
    mean, mse = cells["mean_error"], cells["mse"]
    variance = (mse - mean**2).mean("experiment") + mean.var("experiment", ddof=1)
    return xr.Dataset({"mu": mean.mean("experiment"), "sigma": variance**0.5, "mse": mse.mean("experiment")})


def tables(results: Path) -> dict[str, dict]:
    """Every table, by experiment or by level."""
    runs = {file.stem: xr.load_dataset(file) for file in sorted((results / "settling").glob("*.nc"))}
    files = sorted((results / "published/replay").glob("*.nc"))
    parts = [xr.open_dataset(file)[["mean_error", "mse"]] for file in files]
    cells = xr.concat(parts, "experiment", coords=["k_0"], compat="override").mean("chamber")
    best = cells["mse"].idxmin("n")
    rows = {"overall": averages(cells.sel(n=best))}
    for level, k_0 in LEVELS.items():
        part = cells.sel(experiment=cells["k_0"].round(2).isin(k_0))
        rows[level] = averages(part.sel(n=part["mse"].mean("experiment").idxmin("n")))
    settled = {name: [settling_time(run, q) for q in QUANTITIES] for name, run in runs.items()}
    return {"table 5": settled, "table 8": best, "tables 7 and 9": rows}


if __name__ == "__main__":
    for name, table in tables(Path(sys.argv[1] if sys.argv[1:] else "results")).items():
        print(name, table, sep="\n")
