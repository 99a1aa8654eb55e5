"""Reading a measurement: columns by name and unit from CSV or NetCDF, and what is wrong with them said."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pneumo.configuration.experiment import Plant
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.errors import InputError, printable

GAUGE = "(g)"  # behind a unit of pressure: above atmospheric
_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
_PRESSURE = {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "mbar": 1e2, "bar": 1e5, "psi": 6894.757}
ANR = 1.185  # kg/m^3, air at the reference atmosphere of ISO 8778
_FLOW = {"kg/s": 1.0, "g/s": 1e-3, "kg/h": 1 / 3600, "dm3/s(ANR)": 1e-3 * ANR, "l/min(ANR)": 1e-3 / 60 * ANR}
UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "u": {"V": 1.0, "mV": 1e-3},
    "x": _LENGTH,
    "v": {f"{unit}/s": scale for unit, scale in _LENGTH.items()},
    "P_A": _PRESSURE,
    "P_B": _PRESSURE,
    "m_A": _FLOW,
    "m_B": _FLOW,
    "T": {"K": 1.0, "degC": 1.0},
}
ZERO_CELSIUS = 273.15
REQUIRED = ("t", "x", "P_A", "P_B")
COMMAND, FLOWS = ("u",), ("m_A", "m_B")  # one of the two
HEADER = re.compile(
    r"^\s*(?P<name>\w+?)\s*(?:[\[(](?P<unit>.+)[\])]|_(?P<suffix>[A-Za-z]+(?:_per_s|/s)?(?:_g)?))\s*$"
)
GAP, UNEVEN = (
    3.0,
    1e-3,
)  # periods between samples that are a gap; unevenness worth saying
FEWEST = 100  # samples
OF_SUPPLY = 1.3  # pressure over the supply's that a sensor may show
TOO_LARGE = 3.0  # range over what is possible at which another unit is likelier
HINTS = ("Pa", "hPa", "kPa", "bar", "psi", "MPa")


class Column(BaseModel):
    """Where a quantity stands in a file, and its unit there."""

    model_config = ConfigDict(extra="forbid")
    column: Annotated[str, Field(min_length=1, max_length=200)]
    unit: Annotated[str, Field(max_length=20)]


Quantity = Literal["t", "u", "x", "v", "P_A", "P_B", "m_A", "m_B", "T"]
MAPPING = TypeAdapter(dict[Quantity, Column])


class Measurement(NamedTuple):
    """Signals in SI units, uniform in time.

    Attributes
    ----------
    name : str
        File that they were read from.
    period : float
        Time between samples, s.
    u, x : numpy.ndarray
        Command, V (zero where flows were measured in its place), and position from mid-stroke, m, shape
        (samples,).
    P : numpy.ndarray
        Absolute pressures, Pa, shape (chamber, samples).
    v : numpy.ndarray or None
        Velocity, m/s, where it was measured.
    T : float
        Mean temperature of the surroundings, K; NaN where it was not measured.
    notes : tuple of str
        What a reader should know.
    m : numpy.ndarray or None
        Mass flows into the chambers, kg/s, shape (chamber, samples), where they were measured.
    """

    name: str
    period: float
    u: np.ndarray
    x: np.ndarray
    P: np.ndarray
    v: np.ndarray | None
    T: float
    notes: tuple[str, ...]
    m: np.ndarray | None = None

    @property
    def t(self) -> np.ndarray:
        """Time from the first sample, s."""
        return self.period * np.arange(len(self.u))


def read_mapping(path: Path) -> dict[str, Column]:
    """Read which column is what: `P_A: {column: "pressure 1", unit: kPa}`.

    Raises
    ------
    InputError
        If a key is no quantity, or column or unit is missing.
    """
    try:
        return {str(name): column for name, column in MAPPING.validate_python(read_yaml(path)).items()}
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"] if part != "[key]")
        raise InputError(
            f"{path}: {printable(field)}: must be one of {', '.join(UNITS)}, each with column and unit"
        ) from None


def _columns(names: list[str], units: Mapping[str, str]) -> dict[str, Column]:
    """What each column is by its header: `P_A_kPa`, `P_A [kPa]` or `P_A (bar(g))`."""
    found: dict[str, Column] = {}
    for name in names:
        match = HEADER.match(name)
        quantity = name.strip() if name.strip() in UNITS else match["name"] if match else ""
        if quantity not in UNITS:
            continue
        unit = units.get(name) or (match and (match["unit"] or match["suffix"])) or ""
        if quantity in found:
            raise InputError(f"columns {found[quantity].column!r} and {name!r}: both are {quantity}")
        found[quantity] = Column(column=name, unit=unit.replace("_per_s", "/s").replace("_g", GAUGE).strip())
    return found


def _table(path: Path) -> tuple[pd.DataFrame, dict[str, str], int]:
    """Columns of a file as text or numbers, their units, and the line of the first sample."""
    try:
        if path.suffix == ".nc":
            with xr.open_dataset(path.absolute(), engine="netcdf4", decode_times=False) as data:
                signals = [name for name in data.variables if data[name].ndim == 1]
                units = {str(n): str(data[n].attrs.get("units", "")).replace(" s-1", "/s") for n in signals}
                return pd.DataFrame({str(n): data[n].values for n in signals}), units, 0
        with path.open(encoding="utf-8-sig", newline="") as file:
            first = file.readline()
        separator = max(",;\t", key=first.count)
        table = pd.read_csv(
            path,
            sep=separator,
            dtype=str,
            encoding="utf-8-sig",
            keep_default_na=False,
            skip_blank_lines=False,
        )
        return table, {}, 2
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError, LookupError, RuntimeError) as error:
        text = printable(" ".join(str(error).split()), 200)
        raise InputError(
            f"{path}: not a readable {'NetCDF' if path.suffix == '.nc' else 'CSV'} file ({text})"
        ) from None


def _place(line: int, index: int) -> str:
    """Where a sample stands, in the words of its file."""
    return f"line {index + line}" if line else f"sample {index}"


def _numbers(path: Path, column: Any, quantity: str, line: int) -> np.ndarray:
    """A column as finite numbers."""
    numbers = np.asarray(pd.to_numeric(column, errors="coerce"), dtype=float)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if len(bad):
        shown = printable(str(column.iloc[bad[0]]), 30) or "empty"
        more = f", and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise InputError(
            f"{path}: {_place(line, int(bad[0]))}, column {quantity}: {shown!r}:"
            f" must be a finite number{more}"
        )
    return numbers


def _si(values: np.ndarray, quantity: str, unit: str, P_atm: float) -> np.ndarray:
    """Convert to SI units; a unit that ends with `GAUGE` counts from the atmosphere."""
    gauge = unit.endswith(GAUGE) and UNITS[quantity] is _PRESSURE
    scaled = values * UNITS[quantity][unit.removesuffix(GAUGE).strip() if gauge else unit]
    return scaled + (P_atm if gauge else ZERO_CELSIUS if unit == "degC" else 0.0)


def read_measurement(
    path: Path | str, plant: Plant, mapping: Mapping[str, Column] | None = None, *, from_end: bool = False
) -> Measurement:
    """Read a measurement and check it against the cylinder and supply that it is of.

    Parameters
    ----------
    path : path-like
        CSV with a header, its separator a comma, a semicolon or a tab; or NetCDF (.nc).
    plant : Plant
        Cylinder, valve and supply as configured.
    mapping : mapping of str to Column, optional
        Where each quantity stands; by header where left out.
    from_end : bool
        Whether the position counts from the end where chamber A is smallest, and not from mid-stroke.

    Raises
    ------
    InputError
        With one line that says where and what is wrong, and what is expected.
    """
    path = Path(path)
    table, units, line = _table(path)
    names = [str(name) for name in table.columns]
    columns = dict(mapping) if mapping else _columns(names, units)
    measured_flow = any(quantity in columns for quantity in FLOWS)
    for quantity in REQUIRED + (FLOWS if measured_flow else COMMAND):
        if quantity not in columns:
            there = ", ".join(printable(name, 30) for name in names[:12])
            raise InputError(
                f"{path}: no column {quantity}; expected a header such as"
                f" {quantity}_{next(iter(UNITS[quantity]))}, or --columns; there are {there}"
            )
    values: dict[str, np.ndarray] = {}
    for quantity, (name, unit) in ((q, (c.column, c.unit)) for q, c in columns.items()):
        if name not in names:
            raise InputError(f"{path}: no column {printable(name)!r}, which the mapping has for {quantity}")
        allowed = list(UNITS[quantity]) + (["bar(g)"] if UNITS[quantity] is _PRESSURE else [])
        bare = unit.removesuffix(GAUGE).strip() if UNITS[quantity] is _PRESSURE else unit
        if bare not in UNITS[quantity]:
            what = f"unknown unit {printable(unit, 20)!r}" if unit else "no unit in the header"
            raise InputError(
                f"{path}: column {printable(name, 30)}: {what}; it is one of {', '.join(allowed)}"
            )
        values[quantity] = _si(
            _numbers(path, table[name], quantity, line), quantity, unit, plant.conditions.P_atm
        )
    if from_end:
        values["x"] = values["x"] - plant.cylinder.stroke / 2
    if len(values["t"]) < FEWEST:
        raise InputError(f"{path}: {len(values['t'])} samples: must be at least {FEWEST}")
    notes: list[str] = []
    if measured_flow:
        if "u" in values:
            notes.append("column u: not used, since the flows m_A and m_B were measured")
        values["u"] = np.zeros_like(values["t"])
    period = _time(path, values["t"], line, notes)
    _plausible(path, values, plant, line, notes, from_end)
    values = _even(values, period)
    _velocity(path, values, period, notes)
    T = float(np.mean(values["T"])) if "T" in values else np.nan
    P = np.array([values["P_A"], values["P_B"]])
    m = np.array([values[name] for name in FLOWS]) if measured_flow else None
    return Measurement(str(path), period, values["u"], values["x"], P, values.get("v"), T, tuple(notes), m)


def _time(path: Path, t: np.ndarray, line: int, notes: list[str]) -> float:
    """Period of a time column that increases without gaps, s."""
    steps = np.diff(t)
    back = np.flatnonzero(steps <= 0)
    if len(back):
        k = int(back[0])
        raise InputError(
            f"{path}: {_place(line, k + 1)}, column t: {t[k + 1]:.9g} s follows {t[k]:.9g} s:"
            " time must increase"
        )
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP * usual)
    if len(gaps):
        k = int(gaps[0])
        more = f"; {len(gaps) - 1} more gaps" if len(gaps) > 1 else ""
        raise InputError(
            f"{path}: {_place(line, k + 1)}, column t: a gap of {steps[k]:.4g} s after"
            f" t = {t[k]:.6g} s, where samples are {usual:.4g} s apart:"
            f" cut the file there and fit one part{more}"
        )
    period = float(t[-1] - t[0]) / (len(t) - 1)
    uneven = float(np.max(np.abs(t - t[0] - period * np.arange(len(t))))) / period
    if uneven > UNEVEN:
        notes.append(
            f"time is not uniform: samples stand up to {uneven:.2g} periods of {period:.4g} s beside"
            " a uniform grid; signals are interpolated to it"
        )
    return period


def _even(values: dict[str, np.ndarray], period: float) -> dict[str, np.ndarray]:
    """Signals at uniform times; a command keeps the value of the sample before."""
    t = values["t"] - values["t"][0]
    grid = period * np.arange(len(t))
    if np.max(np.abs(t - grid)) <= UNEVEN * period:
        return values
    before = np.clip(np.searchsorted(t, grid + UNEVEN * period, side="right") - 1, 0, None)
    return {
        name: grid if name == "t" else signal[before] if name == "u" else np.interp(grid, t, signal)
        for name, signal in values.items()
    }


def _plausible(
    path: Path, values: dict[str, np.ndarray], plant: Plant, line: int, notes: list[str], from_end: bool
) -> None:
    """Refuse what cannot be, and say what is unlikely."""
    c, half, u_max = plant.conditions, plant.cylinder.stroke / 2, plant.valve.u_max
    for name in ("P_A", "P_B"):
        _pressure(path, name, values[name], plant, line, notes)
    x = values["x"]
    beyond = np.flatnonzero(np.abs(x) > 1.05 * half)
    if len(beyond):
        k = int(beyond[0])
        shift = half if from_end else 0.0
        span = f"{shift - half:g} to {shift + half:g} m"
        hint = "" if from_end or x.min() < -0.1 * half else "; does it count from the end? --x-from end"
        if np.ptp(x) > 2.2 * half:
            hint = "; is the unit right?"
        raise InputError(
            f"{path}: {_place(line, k)}, column x: {x[k] + shift:.4g} m is outside the stroke, {span}{hint}"
        )
    share = float(np.mean(np.abs(values["u"]) > u_max))
    if share:
        notes.append(f"column u: beyond the limiter's {u_max:g} V in {100 * share:.2g} % of samples; limited")
    for name in ("x", "P_A", "P_B", *(FLOWS if "m_A" in values else COMMAND)):
        if np.ptp(values[name]) == 0:
            raise InputError(f"{path}: column {name}: {values[name][0]:.4g} in every sample: nothing to fit")
    if "T" in values and not 200 < np.mean(values["T"]) < 400:
        raise InputError(
            f"{path}: column T: {np.mean(values['T']):.4g} K on average: must lie between 200 and 400 K;"
            " is it degC?"
        )
    if not c.P_atm < c.P_s:
        raise InputError(f"P_s = {c.P_s:g} Pa: must exceed P_atm")


def _pressure(path: Path, name: str, P: np.ndarray, plant: Plant, line: int, notes: list[str]) -> None:
    """Compare a pressure with what supply and atmosphere allow."""
    c = plant.conditions
    top, low = float(np.percentile(P, 99)), float(np.percentile(P, 1))
    for unit in HINTS:
        scale = _PRESSURE[unit]
        for factor in (scale, 1 / scale):
            fits = 0.5 * c.P_atm < top * factor < OF_SUPPLY * c.P_s and low * factor > 0.5 * c.P_atm
            wrong = top > TOO_LARGE * c.P_s or top < c.P_atm / TOO_LARGE
            if factor != 1 and wrong and fits:
                as_if = f"{unit} for Pa" if factor > 1 else f"Pa for {unit}"
                raise InputError(
                    f"{path}: column {name}: {low:.4g} to {top:.4g} Pa, where {c.P_atm:.4g}"
                    f" (atmosphere) to {c.P_s:.4g} (supply) are possible: is it {as_if}?"
                )
    below = np.flatnonzero(0.5 * c.P_atm >= P)
    if len(below):
        k = int(below[0])
        raise InputError(
            f"{path}: {_place(line, k)}, column {name}: {P[k]:.4g} Pa is far below the atmosphere's"
            f" {c.P_atm:.4g} Pa: must be absolute; a gauge's unit is written bar(g)"
        )
    if top > OF_SUPPLY * c.P_s:
        raise InputError(
            f"{path}: column {name}: up to {top:.4g} Pa, far above the supply's {c.P_s:.4g} Pa"
            " (P_s_Pa, absolute)"
        )
    if low < 0.9 * c.P_atm:
        notes.append(f"column {name}: down to {low:.4g} Pa, below the atmosphere: is it absolute?")


def _velocity(path: Path, values: dict[str, np.ndarray], period: float, notes: list[str]) -> None:
    """Compare a measured velocity with the position's; the fit takes the position's derivative."""
    if "v" not in values:
        return
    width = max(1, round(0.02 / period))  # over 20 ms noise is small beside a moving piston's way
    smooth = np.convolve(values["v"], np.ones(width) / width, mode="valid")
    way = (values["x"][width:] - values["x"][:-width]) / (width * period)
    smooth = smooth[: len(way)]
    slope = float(way @ smooth / max(way @ way, 1e-30))
    if not 0.8 < slope < 1.25:
        raise InputError(
            f"{path}: column v: {slope:.3g} times the derivative of x: must be 1; is its unit or sign right?"
        )
    notes.append(f"column v: {slope:.3g} times the derivative of x; the fit takes that of the smoothed x")
