"""Constants that the paper does not print, identified from its tables (`pneumo paper identify`)."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.evidence.identification.deviance import REGION_THRESHOLD, THRESHOLD
from pneumo.evidence.identification.mechanics import (
    FITTED_EXPERIMENTS,
    SETTLING_DISCREPANCY,
    identify_mechanics,
    settling_cells,
)
from pneumo.evidence.identification.settling_stops import identify_stops
from pneumo.hashing import code_hash
from pneumo.papers.paper_2006.printed_tables import table5
from pneumo.storage.files import attributes, write

SEARCH_SEED = 0
IDENTIFICATION_LONG_NAMES = {  # name -> (long name, unit); a parameter's own unit is in parameter_unit
    "estimate": ("estimate, in parameter_unit", ""),
    "low": ("lower end of the 95 per cent interval, in parameter_unit", ""),
    "high": ("upper end of the 95 per cent interval, in parameter_unit", ""),
    "bound_low": ("lower bound of the search, in parameter_unit", ""),
    "bound_high": ("upper bound of the search, in parameter_unit", ""),
    "profile_value": ("value held fixed, in parameter_unit", ""),
    "profile_deviance": ("lowest deviance over the other parameters", "1"),
    "offset": ("ln(value held fixed / estimate)", "1"),
    "region_M": ("moving mass, held fixed", "kg"),
    "region_ratio": ("viscous friction coefficient over moving mass, held fixed", "s-1"),
    "region_deviance": ("lowest deviance over the stop", "1"),
    "correlation": ("correlation of ln(M) and ln(k_f)", "1"),
    "force_ratio": ("push force over the configured one", "1"),
    "force_deviance": ("lowest deviance over M, k_f and stop", "1"),
    "push_force": ("configured push force", "N"),
    "widening": ("factor by which deviances are divided: lowest per degree of freedom, at least 1", "1"),
    "fitted_rms": ("rms of ln(reproduced/printed), fitted settling times", "1"),
    "scored_rms": ("rms of ln(reproduced/printed), settling times that were not fitted", "1"),
    "evaluations": ("number of times that all experiments were run", "1"),
    "search_evaluations": ("of these, for search and polish", "1"),
    "settling_printed": ("settling time as printed in Table 5", "s"),
    "settling_log_ratio": ("ln(reproduced/printed settling time) at the estimate", "1"),
    "settling_sigma": ("expected standard deviation of ln(reproduced/printed)", "1"),
    "fitted": ("1 where settling times are fitted, 0 where they are scored", "1"),
    "settling_stop": ("time after release at which a settling run ended, nearest to Table 5", "s"),
    "settling_stop_low": ("first time that fits about as well", "s"),
    "settling_stop_high": ("last time that fits about as well", "s"),
    "settling_stop_misfit": ("rms of ln(reproduced/printed settling time) at the stop", "1"),
}


def identify(
    study: Study, cylinders: Sequence[str], seed: int, threads: int, progress: Callable[[str], None]
) -> xr.Dataset:
    """Identify M, k_f and end stop of each cylinder, and the ends of its settling runs.

    `seed` is that of the search's random numbers; the result does not depend on `threads`; `progress` gets a
    line after each stage. `ResultError` if the study lacks an experiment that is needed.
    """
    data = {name: settling_cells(study.experiments, FITTED_EXPERIMENTS[name], table5()) for name in cylinders}
    with ThreadPoolExecutor(threads) as pool:  # the kernels hold no lock while they run
        mechanics = [identify_mechanics(data[name], seed, pool.map, progress) for name in cylinders]
        of_cylinders = {name: e for name, e in study.experiments.items() if e.cylinder in cylinders}
        stops = identify_stops(of_cylinders, pool.map)
    result = xr.merge([_by_cylinder(cylinders, mechanics), stops])
    for name, variable in result.variables.items():
        long_name, unit = IDENTIFICATION_LONG_NAMES.get(str(name), ("", ""))
        variable.attrs = {k: text for k, text in (("long_name", long_name), ("units", unit)) if text}
    return result


def _by_cylinder(cylinders: Sequence[str], parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Join the datasets of cylinders along `cylinder`; settling times keep their dimension `experiment`."""
    settling = [name for name, values in parts[0].data_vars.items() if "experiment" in values.dims]
    by_cylinder = xr.concat(
        [part.drop_vars([*settling, "experiment", "experiment_cylinder"]) for part in parts],
        xr.Variable("cylinder", list(cylinders)),
    )
    return by_cylinder.merge(xr.concat([part[settling] for part in parts], "experiment"))


def save_identification(dataset: xr.Dataset, study: Study, seed: int, path: Path | str) -> None:
    """Write what `identify` returned; the same bytes for the same seed."""
    about = attributes(
        "Identification of the constants that the paper leaves open",
        "M, k_f and end stop from Table 5, from wide bounds",
        study.config_sha256,
        code_hash(__name__),
        comment="Deviance: sum of squared ln(reproduced/printed) over noise, above its lowest, over widening."
        " Noise: printed rounding and a discrepancy. stop is a fraction of the half-stroke.",
        discrepancy_settling_time=SETTLING_DISCREPANCY,
        threshold_interval=THRESHOLD,
        threshold_region=REGION_THRESHOLD,
        seed=seed,
    )
    write(dataset, path, about)
