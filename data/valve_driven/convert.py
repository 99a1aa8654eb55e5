"""Make the NetCDF file of this folder: `python data/valve_driven/convert.py data.mat`."""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.io import loadmat

DIGIT = {"x": 125e-3 / 612, "p": 933.54}  # m and Pa, by which the instruments counted
ABOUT = {
    "Conventions": "CF-1.11, ACDD-1.3",
    "title": "A cylinder that lifts a mass, driven by an on/off valve",
    "summary": "Position and the driven chamber's pressure during eight pulses of the valve; 10 s at 1 kHz",
    "source": "https://github.com/jefersonjlima/wbident, tests/data.mat, added in commit c33319b and deleted"
    " in fbc80ac; read from the history of a44a788f94dc007e24aa55071949ff82a70cf5ca",
    "license": "MIT; its text is beside this file",
    "history": "From mm and V (10 V = 10 bar gauge) to SI, in digits of the instruments; nothing else",
    "bore_m": 25e-3,
    "rod_m": 5e-3,
    "stroke_m": 125e-3,
    "mass_kg": 1.469,
    "gas": "air",
}


def main(file: Path) -> None:
    """Convert the file."""
    original = loadmat(file)
    data = xr.Dataset(
        {
            "x": ("t", original["desl"].ravel() * 1e-3, {"units": "m", "long_name": "position"}),
            "p": (
                "t",
                original["press"].ravel() * 1e5,
                {"units": "Pa", "long_name": "gauge pressure of the driven chamber"},
            ),
        },
        {"t": ("t", original["t"].ravel(), {"units": "s", "long_name": "time"})},
        ABOUT,
    )
    packed = {"zlib": True, "complevel": 9, "shuffle": True, "_FillValue": -1}
    encoding = {name: packed | {"dtype": "int16", "scale_factor": digit} for name, digit in DIGIT.items()}
    encoding["t"] = packed | {"dtype": "int32", "scale_factor": 1e-3}
    target = Path(__file__).with_name("pulses.nc")
    data.to_netcdf(target, encoding=encoding)
    with xr.open_dataset(target) as stored:  # nothing is lost
        for name, digit in DIGIT.items():
            assert np.abs(stored[name] - data[name]).max() < 1e-3 * digit, name


if __name__ == "__main__":
    main(Path(sys.argv[1]))
