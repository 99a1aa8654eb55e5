"""Table 5 as reproduced, and how many settling times the runs of Table 6 last."""

from collections.abc import Mapping

import xarray as xr

from pneumo.storage.files import EXPERIMENT_LABELS


def settling_table(parts: Mapping[str, xr.Dataset], durations: Mapping[str, float]) -> xr.Dataset:
    """Settling times of every experiment beside the length of its run.

    Parameters
    ----------
    parts, durations : mapping of str to xarray.Dataset, mapping of str to float
        Settling run and length of the full-order run, s, of each experiment.

    Returns
    -------
    xarray.Dataset
        `settling_time`, s, by (experiment, quantity); `failure_time`, s, `duration`, s, and
        `duration_per_settling_time` (over the longest of the experiment) by experiment.
    """
    runs = [part[["settling_time", "failure_time"]] for part in parts.values()]
    table = xr.concat(runs, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    lengths = [durations[name] for name in parts]
    table["duration"] = ("experiment", lengths, {"units": "s", "long_name": "length of the full-order run"})
    ratio = table["duration"] / table["settling_time"].max("quantity")
    table["duration_per_settling_time"] = ratio.assign_attrs(
        units="1", long_name="length of the run over the longest settling time"
    )
    return table
