"""Table 5 as reproduced, and the lengths of the runs of Table 6 in settling times."""

from collections.abc import Mapping

import xarray as xr

from pneumo.storage.files import EXPERIMENT_LABELS


def settling_table(parts: Mapping[str, xr.Dataset], durations: Mapping[str, float]) -> xr.Dataset:
    """Settling times of every experiment, and the length of its full-order run (`durations`, s).

    The dataset has `settling_time`, s, by (experiment, quantity); by experiment, `failure_time`, s,
    `duration`, s, and `duration_per_settling_time`, the duration over the longest settling time.
    """
    runs = [part["settling_time"] for part in parts.values()]
    times = xr.concat(runs, "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
    failures = [part["failure_time"] for part in parts.values()]
    duration = [durations[name] for name in parts]
    ratio = duration / times.max("quantity")
    about = {"units": "s", "long_name": "length of the full-order run"}
    about_ratio = {"units": "1", "long_name": "length of the run over the longest settling time"}
    return times.to_dataset().assign(
        failure_time=xr.concat(failures, "experiment", coords="minimal", compat="override"),
        duration=("experiment", duration, about),
        duration_per_settling_time=ratio.assign_attrs(about_ratio),
    )
