"""The polytropic index of the lowest error."""

import numpy as np
import xarray as xr


def best_n(mse: xr.DataArray) -> xr.DataArray:
    """The n at which the mean square error is lowest; NaN where the error at any n is NaN (a failed replay).

    Of equal errors (models without n), the lowest n.
    """
    return mse.fillna(np.inf).idxmin("n").where(mse.notnull().all("n"))
