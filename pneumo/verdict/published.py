"""The numbers that the paper printed, from ``published/table1.csv`` ... ``table9.csv``.

Every array carries two coordinates beside its values: ``printed``, the string with the printed digits, and
``half_unit``, half a unit in the last of those digits, so that ``abs(reproduced - table) <= table.half_unit``
says "equal as printed". In a dataset they are called ``mean_error_printed``, ``mean_error_half_unit``
and so on.
"""

import csv
import itertools
from collections.abc import Mapping, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.verdict import PAPER_FOLDER, PaperError, paper_file

STATISTICS = {  # name in the tables -> (name in the datasets, long name, unit)
    "mu": ("mean_error", "expected value of the pressure error", "Pa"),
    "sigma": ("std", "standard deviation of the pressure error", "Pa"),
    "mse": ("mse", "average mean square error of the pressure", "Pa2"),
}

Cell = Mapping[str, str]


def read_table(number: int, folder: Path = PAPER_FOLDER) -> list[dict[str, str]]:
    """Read the cells of one printed table, every value a string.

    Each has ``row``, ``column``, ``printed`` and ``note``, then the keys of that table. A table that the
    paper does not have, or whose file is missing, raises `PaperError`.
    """
    if number not in range(1, 10):
        raise PaperError(f"number = {number!r}: the paper has Tables 1 to 9")
    with paper_file(folder, f"published/table{number}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def half_unit(printed: str, digits: int | None = None) -> float:
    """Half a unit in the last printed digit: the largest error of rounding.

    Parameters
    ----------
    printed : str
        A number as printed.
    digits : int, optional
        Significant digits that the authors rounded to where they filled up with zeros. Zeros after that
        many digits then don't count as digits; any other digit does.

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
        number = Decimal("nan")
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
    return _by_experiment(5, "settling_time", "settling time", "s", {"quantity": "column"})


def table6() -> xr.DataArray:
    """Table 6: simulation times in s by (experiment), which carries ``cylinder``, ``type`` and ``k_0``."""
    return _by_experiment(6, "simulation_time", "simulation time", "s", {})


def table7() -> xr.Dataset:
    """Table 7: ``mean_error``, ``std`` (Pa) and ``mse`` (Pa2) by (model), each experiment at its best n."""
    return _statistics(read_table(7), {"model": "row"})


def table8() -> xr.DataArray:
    """Table 8: best polytropic index by (experiment, model).

    Experiments carry ``cylinder``, ``type`` and ``k_0``.
    """
    return _by_experiment(8, "best_n", "n of the lowest mean square error", "1", {"model": "column"})


def table9() -> xr.Dataset:
    """Table 9: ``mean_error``, ``std`` (Pa) and ``mse`` (Pa2) by (level, model), each at its best constant n.

    Levels are ``adiabatic``, ``typical`` and ``isothermal``; ``k_0_low`` and ``k_0_high`` belong to them.
    """
    cells = read_table(9)
    levels = {cell["level"]: cell for cell in cells}.values()
    bounds = {
        name: ("level", [float(cell[name]) for cell in levels], {"units": "W K-1"})
        for name in ("k_0_low", "k_0_high")
    }
    return _statistics(cells, {"level": "level", "model": "row"}, digits=2).assign_coords(bounds)


def _array(cells: Sequence[Cell], keys: Mapping[str, str], digits: int | None = None) -> xr.DataArray:
    """Put a complete table into an array; `keys` give each dimension's key in the cells, in their order."""
    labels = {dim: list(dict.fromkeys(cell[key] for cell in cells)) for dim, key in keys.items()}
    expected = list(itertools.product(*labels.values()))
    present = [tuple(cell[key] for key in keys.values()) for cell in cells]
    if present != expected:
        wrong = sorted(set(expected) ^ set(present)) or "their order"
        raise ValueError(f"cells by {tuple(keys)} are not one of each, in order; look at {wrong}")

    values = np.full((2, len(cells)), np.nan)  # the number and its half unit
    for i, cell in enumerate(cells):
        if not cell["note"].startswith("unreadable"):
            number = np.array([float(cell["printed"]), half_unit(cell["printed"], digits)])
            values[:, i] = number * float(cell.get("scale", 1))
    shape = tuple(len(names) for names in labels.values())
    columns = {"printed": np.array([cell["printed"] for cell in cells]), "half_unit": values[1]}
    coords = {name: (tuple(labels), column.reshape(shape)) for name, column in columns.items()}
    return xr.DataArray(values[0].reshape(shape), labels | coords, tuple(labels))


def _by_experiment(
    number: int, name: str, long_name: str, unit: str, keys: Mapping[str, str]
) -> xr.DataArray:
    """Table of one quantity by experiment and `keys`."""
    cells = read_table(number)
    experiments = {cell["row"]: cell for cell in cells}.values()
    k_0 = [float(cell["k_0"]) for cell in experiments]
    return (
        _array(cells, {"experiment": "row", **keys})
        .assign_coords(
            cylinder=("experiment", [cell["cylinder"] for cell in experiments]),
            type=("experiment", [cell["type"] for cell in experiments], {"long_name": "open or closed loop"}),
            k_0=("experiment", k_0, {"units": "W K-1"}),
        )
        .rename(name)
        .assign_attrs(long_name=long_name, units=unit)
    )


def _statistics(cells: Sequence[Cell], keys: Mapping[str, str], digits: int | None = None) -> xr.Dataset:
    """Table of mean, standard deviation and mean square as a dataset."""
    dataset = xr.Dataset()
    for symbol, (name, long_name, unit) in STATISTICS.items():
        values = _array([cell for cell in cells if cell["column"] == symbol], keys, digits)
        values = values.rename(printed=f"{name}_printed", half_unit=f"{name}_half_unit")
        dataset[name] = values.assign_attrs(long_name=long_name, units=unit)
    return dataset
