"""The paper's tables and figures as arrays, from ``paper/2006/published``.

Every array of a table has two more coordinates: ``printed``, the printed digits as a string, and
``half_unit``, half a unit in the last of them; ``abs(reproduced - table) <= table.half_unit`` means equal as
printed. In a dataset they are called ``mean_error_printed``, ``mean_error_half_unit`` and so on.
"""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from paper.study import PAPERS
from paper_verdict.errors import PaperError
from paper_verdict.files import Entries, half_unit, read_cells, read_csv

PAPER_FOLDER = PAPERS / "2006"

STATISTICS = {  # name in the tables -> (name in the datasets, long name, unit)
    "mu": ("mean_error", "expected value of the pressure error", "Pa"),
    "sigma": ("std", "standard deviation of the pressure error", "Pa"),
    "mse": ("mse", "average mean square error of the pressure", "Pa2"),
}

Cell = Mapping[str, str]


def read_table(number: int, folder: Path = PAPER_FOLDER) -> list[Entries]:
    """Read the cells of one printed table, every value a string.

    Each has ``row``, ``column``, ``printed`` and ``note``, then the keys of that table. A table that the
    paper does not have, or whose file is missing, raises `PaperError`.
    """
    if number not in range(1, 10):
        raise PaperError(f"number = {number!r}: the paper has Tables 1 to 9")
    return read_cells(f"table{number}", folder)


def table5() -> xr.DataArray:
    """Table 5: settling times in s by (experiment, quantity), as printed.

    Quantities are ``P_A``, ``P_B``, ``T_A``, ``T_B``; experiments have ``cylinder``, ``type`` and ``k_0``.
    """
    return _by_experiment(5, "settling_time", "settling time", "s", {"quantity": "column"})


def table7() -> xr.Dataset:
    """Table 7: ``mean_error``, ``std`` (Pa) and ``mse`` (Pa2) by (model), each experiment at its best n."""
    return _statistics(read_table(7), {"model": "row"})


def table8() -> xr.DataArray:
    """Table 8: best polytropic index by (experiment, model).

    Experiments have ``cylinder``, ``type`` and ``k_0``.
    """
    return _by_experiment(8, "best_n", "n of the lowest mean square error", "1", {"model": "column"})


def table9() -> xr.Dataset:
    """Table 9: ``mean_error``, ``std`` (Pa) and ``mse`` (Pa2) by (level, model), each at its best constant n.

    Levels are ``adiabatic``, ``typical`` and ``isothermal``; ``k_0_low`` and ``k_0_high`` belong to them.
    """
    cells = read_table(9)
    levels = {cell["level"]: cell for cell in cells}.values()
    bounds = {name: [float(cell[name]) for cell in levels] for name in ("k_0_low", "k_0_high")}
    table = _statistics(cells, {"level": "level", "model": "row"}, digits=2)
    return table.assign_coords({name: ("level", k_0, {"units": "W K-1"}) for name, k_0 in bounds.items()})


def percentiles(number: int) -> xr.Dataset:
    """`p10` and `p90`, Pa2, by (level, model) as read off Fig. 9, 10 or 11, and Fig. 11's `constant_n`."""
    keys = {"level": "level", "model": "row"}
    dataset = xr.Dataset()
    for column, name in {"p10": "p10", "p90": "p90", "best_n": "constant_n"}.items():
        if cells := [
            cell for cell in read_cells(f"figure{number}", PAPER_FOLDER) if cell["column"] == column
        ]:
            values = _array(cells, keys).drop_vars(["printed", "half_unit"])
            dataset[name] = 10**values if cells[0]["unit"].startswith("log10") else values
    return dataset


def with_percentiles(table: xr.Dataset, number: int) -> xr.Dataset:
    """Table 7 or 9 with `p10` and `p90`, Pa2, read off Fig. 9, 10 or 11; NaN for models not drawn there."""
    values = percentiles(number)[["p10", "p90"]]
    return table.merge(values if "level" in table.dims else values.squeeze("level", drop=True), join="left")


def traces_of_fig_7() -> dict[str, np.ndarray]:
    """Curves of Fig. 7 by panel: ``force``, ``x``, ``P_A``.

    Shape (3, points): time since release, s, and lower and upper bound, N, m or Pa.
    """
    panels: dict[str, list[list[float]]] = {}
    for cell in read_csv(PAPER_FOLDER / "published/figure7_traces.csv"):
        panels.setdefault(cell["row"], []).append([float(cell[name]) for name in ("t", "low", "high")])
    return {name: np.array(rows).T for name, rows in panels.items()}


def _array(cells: Sequence[Cell], keys: Mapping[str, str], digits: int | None = None) -> xr.DataArray:
    """Put a complete table, in order, into an array; `keys`: dimension -> key of a cell that labels it."""
    labels = {dim: list(dict.fromkeys(cell[key] for cell in cells)) for dim, key in keys.items()}
    expected = list(itertools.product(*labels.values()))
    present = [tuple(cell[key] for key in keys.values()) for cell in cells]
    if present != expected:
        wrong = sorted(set(expected) ^ set(present)) or "their order"
        raise ValueError(f"cells by {tuple(keys)} are not one of each, in order; look at {wrong}")

    values = np.full((2, len(cells)), np.nan)  # the number and its half unit
    for i, cell in enumerate(cells):
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
    by_experiment = {c["row"]: (c["cylinder"], c["type"], c["k_0"]) for c in cells}.values()
    cylinders, types, k_0 = zip(*by_experiment, strict=True)
    array = _array(cells, {"experiment": "row", **keys}).rename(name)
    return array.assign_attrs(long_name=long_name, units=unit).assign_coords(
        cylinder=("experiment", list(cylinders)),
        type=("experiment", list(types), {"long_name": "open or closed loop"}),
        k_0=("experiment", [float(value) for value in k_0], {"units": "W K-1"}),
    )


def _statistics(cells: Sequence[Cell], keys: Mapping[str, str], digits: int | None = None) -> xr.Dataset:
    """Mean, standard deviation and mean square of the pressure error as printed, as a dataset."""
    dataset = xr.Dataset()
    for symbol, (name, long_name, unit) in STATISTICS.items():
        values = _array([cell for cell in cells if cell["column"] == symbol], keys, digits)
        values = values.rename(printed=f"{name}_printed", half_unit=f"{name}_half_unit")
        dataset[name] = values.assign_attrs(long_name=long_name, units=unit)
    return dataset
