"""Make the NetCDF files of this folder: `python data/tank/convert.py FOLDER_OF_YML_FILES`."""

import sys
from pathlib import Path

import xarray as xr
import yaml

COMMIT = "1040d758b819533451086baa5cf2a47b4292a22f"
RUNS = {  # file here: file there, what it is
    "discharge": ("Air_790kPa_21mm", "A vessel of air that empties through an orifice"),
    "filling": ("Air_3-7kPa_271mm", "A vessel of thin air that fills through an orifice"),
    "nitrogen": ("N2_Exp_I1", "A vessel of nitrogen at 150 bar that empties through an orifice"),
}
TEMPERATURES = {
    "gas_mean": ("T", "gas temperature"),
    "gas_high": ("T", "gas temperature; of nitrogen, at the top"),
    "gas_low": ("T_low", "gas temperature, at the bottom"),
    "wall_inner": ("T_wall", "temperature of the wall's inner face"),
    "wall_outer": ("T_outer", "temperature of the wall's outer face"),
}


def converted(file: Path, title: str) -> xr.Dataset:
    """Digitised points of one run with the vessel's size, in SI units, with where they are from."""
    text = yaml.safe_load(file.read_text(encoding="utf-8"))
    vessel, valve, measured = text["vessel"], text["valve"], text["validation"]
    points = {"P": (measured["pressure"]["time"], [bar * 1e5 for bar in measured["pressure"]["pres"]])}
    meaning = {"P": "absolute pressure"}
    for original, (name, words) in TEMPERATURES.items():
        if original in measured["temperature"]:
            points[name] = tuple(measured["temperature"][original].values())
            meaning[name] = words
    data = xr.Dataset()
    for name, (t, values) in points.items():
        time = {"units": "s", "long_name": f"time of the points of {name}"}
        unit = {"units": "Pa" if name == "P" else "K", "long_name": meaning[name]}
        pairs = sorted(zip(t, values, strict=True))
        data[name] = (f"t_{name}", [value for _, value in pairs], unit)
        data.coords[f"t_{name}"] = (f"t_{name}", [t for t, _ in pairs], time)
    data.attrs = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": title,
        "summary": "Measured points, digitised from a figure of a publication that the source does not name",
        "source": f"https://github.com/andr1976/HydDown, commit {COMMIT}, validation/{file.name}",
        "license": "MIT; its text is beside this file",
        "history": "Units changed from bar to Pa, points sorted by time; no other change",
        "gas": {"air": "air", "N2": "nitrogen"}[text["initial"]["fluid"]],
        "orientation": vessel["orientation"],
        "length_m": vessel["length"],
        "diameter_m": vessel["diameter"],
        "wall_m": vessel["thickness"],
        "wall_heat_capacity_J_per_kgK": float(vessel["heat_capacity"]),
        "wall_density_kg_per_m3": float(vessel["density"]),
        "orifice_m": valve["diameter"],
        "P_outside_Pa": float(valve["back_pressure"]),
        "P_start_Pa": float(text["initial"]["pressure"]),
        "T_start_K": text["initial"]["temperature"],
    }
    return data


def main(folder: Path) -> None:
    """Convert the three files."""
    for name, (original, title) in RUNS.items():
        converted(folder / f"{original}.yml", title).to_netcdf(Path(__file__).with_name(f"{name}.nc"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
