"""Make the NetCDF files of this folder: `python data/mbari/convert.py FOLDER_OF_EXP_FILES`."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

INCH, PSI = 0.0254, 6894.757293168  # m, Pa
COMMIT = "71fe25a249e74a220e1448354f979f42a7ae9208"
NAMES = {
    "2021-07-26": "2021.07.26T10.51.44",
    "2022-01-28": "2022.01.28T16.46.31",
    "2022-12-21-vented": "2022.12.21T15.44.24_VentedSpring",
    "friction": "FrictionIDMovesWithBiasCurr",
}
SIGNALS = {  # name: column, unit there in SI, unit, what it is
    "x": ("Pos(in)", INCH, "m", "position from the end where chamber A is smallest"),
    "P_A": (
        "UpperSpringPressure(psia)",
        PSI,
        "Pa",
        "absolute pressure of chamber A, the upper one, without rod",
    ),
    "P_B": (
        "LowerSpringPressure(psia)",
        PSI,
        "Pa",
        "absolute pressure of chamber B, the lower one, with the rod",
    ),
}


def converted(file: Path) -> xr.Dataset:
    """Time, position and both pressures of an .exp file, in SI units, with where they are from."""
    names = file.open(encoding="utf-8").readline().lstrip("#").strip().split(",")
    table = pd.read_csv(file, sep=r"\s+", skiprows=1, names=names, index_col=False)
    data = xr.Dataset(coords={"t": ("t", table["time(s)"].to_numpy(), {"units": "s", "long_name": "time"})})
    for name, (column, scale, unit, meaning) in SIGNALS.items():
        data[name] = ("t", table[column].to_numpy() * scale, {"units": unit, "long_name": meaning})
    data.attrs = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": f"Gas spring of a wave energy converter, tested: {file.stem.removeprefix('mbari_')}",
        "summary": "Two closed chambers of nitrogen on one piston, moved by a hydraulic machine; 50 Hz",
        "institution": "Monterey Bay Aquarium Research Institute; Open Source Robotics Foundation",
        "source": f"https://github.com/osrf/mbari_wec_gz, commit {COMMIT},"
        f" buoy_tests/test_inputdata/{file.name.removeprefix('mbari_')}",
        "license": "Apache-2.0; its text stands beside this file",
        "history": "Four of eighteen columns, from inch and psia to SI units; no other change",
        "bore_m": 5 * INCH,
        "rod_m": 1.5 * INCH,
        "stroke_m": 2.03,
        "gas": "nitrogen",
    }
    return data


def main(folder: Path) -> None:
    """Convert the four files."""
    for name, original in NAMES.items():
        data = converted(next(folder.glob(f"*{original}.exp")))
        # What the instrument wrote: multiples of 0.001 inch and 0.001 psi.
        packed = {"dtype": "int32", "zlib": True, "complevel": 9, "shuffle": True, "_FillValue": None}
        encoding = {key: packed | {"scale_factor": 1e-3 * scale} for key, (_, scale, *_) in SIGNALS.items()}
        encoding["t"] = packed | {"scale_factor": 0.01}
        data.to_netcdf(Path(__file__).with_name(f"{name}.nc"), encoding=encoding)
        assert np.isfinite(data.to_array()).all(), name


if __name__ == "__main__":
    main(Path(sys.argv[1]))
