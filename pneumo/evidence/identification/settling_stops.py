"""Stops of the closed-loop settling runs, identified from Table 5: final values are read at the stop."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.evidence.identification.mechanics import Mapper
from pneumo.papers.paper_2006.printed_tables import table5
from pneumo.simulation.settling import settle, settling_times
from pneumo.statistics.averages import rms_of

LATEST = 4.0  # of the largest printed settling time; the earliest stop is that time itself
CANDIDATES = 1000  # stops that are tried, evenly spaced by ratio
MISPRINTED = {"E04": "P_B"}  # erratum E04_P_B
AS_GOOD = 0.005  # stops whose misfit exceeds the lowest by no more are in the interval


class IdentifiedStop(NamedTuple):
    """A stop, s after release, with the first and the last that fit about as well."""

    stop: float
    low: float
    high: float
    misfit: float  # rms of ln(reproduced/printed) over the settling times


def identified_stop(experiment: Experiment, printed: np.ndarray) -> IdentifiedStop:
    """Stop at which the settling times of P_A, P_B, T_A, T_B come nearest to the printed ones, s.

    Printed times to leave out are NaN.
    """
    earliest = float(np.nanmax(printed))
    run = settle(experiment._replace(push=experiment.push._replace(stop=LATEST * earliest)))
    free, h, known = run.states[run.release_step :], experiment.h, np.isfinite(printed)
    T_amb = experiment.plant.conditions.T_amb
    stops = np.unique(np.round(np.geomspace(earliest, LATEST * earliest, CANDIDATES) / h).astype(int))
    ratios = [np.log(settling_times(free[: k + 1], T_amb, h)[known] / printed[known]) for k in stops]
    misfit = np.nan_to_num([rms_of(ratio) for ratio in ratios], nan=np.inf)
    low, high = (stops[misfit <= misfit.min() + AS_GOOD] * h)[[0, -1]]
    return IdentifiedStop(float(stops[misfit.argmin()] * h), float(low), float(high), float(misfit.min()))


def identify_stops(experiments: Mapping[str, Experiment], mapper: Mapper) -> xr.Dataset:
    """``settling_stop``, its interval and its misfit, of every experiment with a stop."""
    printed = table5()
    stopped = [name for name, e in experiments.items() if e.push.stop and name in printed["experiment"]]

    def stop_of(name: str) -> IdentifiedStop:
        row = printed.sel(experiment=name)
        return identified_stop(experiments[name], row.where(row["quantity"] != MISPRINTED.get(name)).values)

    columns = zip(*mapper(stop_of, stopped), strict=True)
    names = ("settling_stop", "settling_stop_low", "settling_stop_high", "settling_stop_misfit")
    variables = {name: ("stopped", list(values)) for name, values in zip(names, columns, strict=True)}
    return xr.Dataset(variables, {"stopped": stopped})
