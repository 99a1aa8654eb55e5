"""Cells with given mean square errors, in the form of the results."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr


def cells_of(mse: np.ndarray, coords: Mapping[str, Sequence]) -> xr.Dataset:
    """Cells that succeeded, by all dimensions of `coords`; a tenth of each error's size is its mean."""
    arrays = {"mse": mse, "mean_error": 0.1 * np.sqrt(mse), "variance": 0.99 * mse}
    arrays |= {"status": np.zeros(mse.shape, np.int8), "failure_time": np.full(mse.shape, np.nan)}
    return xr.Dataset({name: (tuple(coords), values) for name, values in arrays.items()}, coords)
