"""Run a function on every experiment of a study in threads, and join the results in one dataset."""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import xarray as xr

from pneumo.configuration.experiment import Experiment
from pneumo.storage.files import EXPERIMENT_LABELS

Result = TypeVar("Result")
Labelled = TypeVar("Labelled", xr.Dataset, xr.DataArray)


def for_each_experiment(
    experiments: Mapping[str, Experiment],
    work: Callable[[Experiment], Result],
    threads: int,
    what: str | None = None,
) -> dict[str, Result]:
    """Results of `work` for each experiment, by name; the threads start with the longest run.

    Prints a line with `what`, if given, after each experiment.
    """

    def done(experiment: Experiment) -> Result:
        result = work(experiment)
        if what:
            print(f"{experiment.name}: {what}, done", flush=True)
        return result

    longest_first = sorted(experiments.values(), key=lambda experiment: -experiment.steps)
    with ThreadPoolExecutor(threads) as pool:  # the core holds no lock while they run
        results = dict(zip((e.name for e in longest_first), pool.map(done, longest_first), strict=True))
    return {name: results[name] for name in experiments}


def side_by_side(parts: Mapping[str, Labelled]) -> Labelled:
    """Join datasets of experiments along "experiment"."""
    concat: Any = xr.concat  # its overloads take datasets or arrays, not one or the other
    return concat(list(parts.values()), "experiment", coords=list(EXPERIMENT_LABELS), compat="equals")
