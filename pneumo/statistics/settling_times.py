"""Table 5 as reproduced, and how many settling times the runs of Table 6 last."""

from collections.abc import Mapping

import xarray as xr

from pneumo.storage.files import EXPERIMENT_LABELS


def settling_table(parts: Mapping[str, xr.Dataset], durations: Mapping[str, float]) -> xr.Dataset:
    """Settling times of every experiment beside the length of its run.

    Parameters
    ----------
    parts : mapping of str to xarray.Dataset
        Settling runs by experiment.
    durations : mapping of str to float
        Length of each full-order run, s.

    Returns
    -------
    xarray.Dataset
        `settling_time`, s, by (experiment, quantity); `failure_time`, s, `duration`, s, and
        `duration_per_settling_time` (over the longest of the experiment) by experiment.
    """
    runs = [part["settling_time"] for part in parts.values()]
    times = xr.concat(runs, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    duration = xr.DataArray(list(durations.values()), {"experiment": list(durations)}, name="duration")
    table = times.to_dataset()
    table["failure_time"] = xr.concat(
        [part["failure_time"] for part in parts.values()], "experiment", coords="minimal", compat="override"
    )
    table["duration"] = duration.reindex(experiment=times["experiment"]).assign_attrs(
        units="s", long_name="length of the full-order run"
    )
    ratio = table["duration"] / times.max("quantity")
    table["duration_per_settling_time"] = ratio.assign_attrs(
        units="1", long_name="length of the run over the longest settling time"
    )
    return table
