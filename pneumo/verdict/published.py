"""The numbers that the paper printed, from ``paper/2006/published/table1.csv`` ... ``table9.csv``.

Every array carries two coordinates beside its values: ``printed``, the string with the printed digits, and
``half_unit``, half a unit in the last of those digits, so that ``abs(reproduced - table) <= table.half_unit``
says "equal as printed". In a dataset they are called ``mean_error_printed``, ``mean_error_half_unit``
and so on.
"""

import itertools
from collections.abc import Mapping
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

FOLDER = Path(__file__).resolve().parents[2] / "paper" / "2006" / "published"

STATISTICS = {  # name in the tables -> (name in the datasets, long name, unit)
    "mu": ("mean_error", "expected value of the pressure error", "Pa"),
    "sigma": ("std", "standard deviation of the pressure error", "Pa"),
    "mse": ("mse", "average mean square error of the pressure", "Pa2"),
}


def read_table(number: int, folder: Path = FOLDER) -> pd.DataFrame:
    """Read one printed table, every cell a string.

    Parameters
    ----------
    number
        Number of the table in the paper, 1 to 9.
    folder
        Folder that holds ``table1.csv`` ... ``table9.csv``.

    Returns
    -------
    pandas.DataFrame
        One line per cell: ``row``, ``column``, ``printed``, ``note``, then the keys of that table.

    Raises
    ------
    ValueError
        If the paper has no table of that number.
    FileNotFoundError
        If the folder or the file is missing.
    """
    if number not in range(1, 10):
        raise ValueError(f"number = {number!r}: the paper has Tables 1 to 9")
    path = folder / f"table{number}.csv"
    if not path.is_file():
        raise FileNotFoundError(
            f"Table {number} is not in {folder}: the published tables are read from paper/2006/published, "
            "the folder beside the package in a source checkout"
        )
    return pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8")


def half_unit(printed: str, digits: int | None = None) -> float:
    """Half a unit in the last printed digit: how far a number can be from the one it was rounded from.

    Parameters
    ----------
    printed
        A number as printed, such as ``"1.02e4"``, ``"140"`` or ``"-0.047"``.
    digits
        Significant digits that the authors rounded to where they filled up with zeros. Zeros after that
        many digits then don't count as digits; any other digit does.

    Returns
    -------
    float
        Half a unit, in the unit of the number.

    Raises
    ------
    ValueError
        If ``printed`` is no finite number.

    Examples
    --------
    >>> half_unit("1.02e4"), half_unit("140"), half_unit("-0.047")
    (50.0, 0.5, 0.0005)
    >>> half_unit("3000", digits=2), half_unit("46.0", digits=2), half_unit("27.5", digits=2)
    (50.0, 0.5, 0.05)
    """
    try:
        number = Decimal(printed)
    except InvalidOperation:
        raise ValueError(f"printed = {printed!r}: not a number") from None
    _, figures, exponent = number.as_tuple()
    if not isinstance(exponent, int):
        raise ValueError(f"printed = {printed!r}: not a finite number")
    if digits is not None:
        filled = len(figures) - digits
        while filled > 0 and figures[-1] == 0:
            figures, exponent, filled = figures[:-1], exponent + 1, filled - 1
    return float(Decimal(5).scaleb(exponent - 1))


def table5() -> xr.DataArray:
    """Table 5: settling times in s by (experiment, quantity); NaN where the scan is unreadable.

    Quantities are ``P_A``, ``P_B``, ``T_A``, ``T_B``; experiments carry ``cylinder``, ``type`` and ``k_0``.
    """
    cells = read_table(5)
    times = _with_experiments(_array(cells, {"experiment": "row", "quantity": "column"}), cells)
    return times.rename("settling_time").assign_attrs(long_name="settling time", units="s")


def table6() -> xr.DataArray:
    """Table 6: simulation times in s by (experiment), which carries ``cylinder``, ``type`` and ``k_0``."""
    cells = read_table(6)
    times = _with_experiments(_array(cells, {"experiment": "row"}), cells)
    return times.rename("simulation_time").assign_attrs(long_name="simulation time", units="s")


def table7() -> xr.Dataset:
    """Table 7: ``mean_error``, ``std`` (Pa) and ``mse`` (Pa2) by (model), each experiment at its best n."""
    return _statistics(read_table(7), {"model": "row"})


def table8() -> xr.DataArray:
    """Table 8: best polytropic index by (experiment, model).

    Experiments carry ``cylinder``, ``type`` and ``k_0``.
    """
    cells = read_table(8)
    best = _with_experiments(_array(cells, {"experiment": "row", "model": "column"}), cells)
    return best.rename("best_n").assign_attrs(long_name="n of the lowest mean square error", units="1")


def table9() -> xr.Dataset:
    """Table 9: ``mean_error``, ``std`` (Pa) and ``mse`` (Pa2) by (level, model), each at its best constant n.

    Levels are ``adiabatic``, ``typical`` and ``isothermal``; ``k_0_low`` and ``k_0_high`` belong to them.
    """
    cells = read_table(9)
    levels = cells.drop_duplicates("level")
    return _statistics(cells, {"level": "level", "model": "row"}, digits=2).assign_coords(
        k_0_low=("level", levels["k_0_low"].astype(float).to_numpy(), {"units": "W K-1"}),
        k_0_high=("level", levels["k_0_high"].astype(float).to_numpy(), {"units": "W K-1"}),
    )


def _array(cells: pd.DataFrame, keys: Mapping[str, str], digits: int | None = None) -> xr.DataArray:
    """Put a complete table into an array.

    Parameters
    ----------
    cells
        Lines of a table, in the order of ``keys``.
    keys
        Dimension of the array -> column of the table that names its labels.
    digits
        See `half_unit`.
    """
    labels = {dim: list(dict.fromkeys(cells[key])) for dim, key in keys.items()}
    expected = list(itertools.product(*labels.values()))
    found = list(zip(*(cells[key] for key in keys.values()), strict=True))
    if found != expected:
        wrong = sorted(set(expected) ^ set(found)) or "their order"
        raise ValueError(f"cells by {tuple(keys)} are not one of each, in order; look at {wrong}")

    scale = cells["scale"].astype(float) if "scale" in cells else pd.Series(1.0, index=cells.index)
    readable = ~cells["note"].str.startswith("unreadable")
    values = cells["printed"].where(readable, "nan").astype(float) * scale
    half_units = cells["printed"].map(lambda printed: half_unit(printed, digits)).where(readable) * scale

    shape = tuple(len(names) for names in labels.values())
    return xr.DataArray(
        values.to_numpy(float).reshape(shape),
        dims=tuple(labels),
        coords={
            **labels,
            "printed": (tuple(labels), np.array(cells["printed"].tolist()).reshape(shape)),
            "half_unit": (tuple(labels), half_units.to_numpy(float).reshape(shape)),
        },
    )


def _with_experiments(values: xr.DataArray, cells: pd.DataFrame) -> xr.DataArray:
    experiments = cells.drop_duplicates("row")
    return values.assign_coords(
        cylinder=("experiment", experiments["cylinder"].tolist()),
        type=("experiment", experiments["type"].tolist(), {"long_name": "open or closed loop"}),
        k_0=("experiment", experiments["k_0"].astype(float).to_numpy(), {"units": "W K-1"}),
    )


def _statistics(cells: pd.DataFrame, keys: Mapping[str, str], digits: int | None = None) -> xr.Dataset:
    dataset = xr.Dataset()
    for symbol, (name, long_name, unit) in STATISTICS.items():
        values = _array(cells.loc[cells["column"] == symbol, :], keys, digits)
        values = values.rename(printed=f"{name}_printed", half_unit=f"{name}_half_unit")
        dataset[name] = values.assign_attrs(long_name=long_name, units=unit)
    return dataset
