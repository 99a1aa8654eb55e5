"""Fleets: cylinders of a table, run and ranked block by block as by `pneumo study`."""

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import xarray as xr

from pneumo.configuration.cylinder_table import experiment_name
from pneumo.configuration.experiment import Study, plain
from pneumo.configuration.priors import Uncertain
from pneumo.physics.models import MODELS
from pneumo.selection.answer import Answer, answers
from pneumo.selection.cylinder_ranking import run_study
from pneumo.selection.error_budget import FULL_ORDER
from pneumo.storage.layout import described

CELLS = ("mean_error", "variance", "mse", "failure_time", "mse_drawn")  # 4 bytes
DRAWS = 16  # of each cylinder; the parts of the error are left to `pneumo study`

ABOUT = {  # unit, long name
    "recommended": ("", "model to take, or the full order; nothing if none ran"),
    "as_good": ("", "the other models within 10 % of the lowest mean square error"),
    "reason": ("", "why that model"),
    "advice": ("", "what would decide better, one line each"),
    "runs": ("1", "runs of each experiment that count"),
    "bore": ("m", "diameter of the piston"),
    "stroke": ("m", "stroke"),
    "expected_rms": ("Pa", "RMS error on cylinders drawn from what is not known, at the n where it is least"),
    "expected_rms_of_full_order": ("Pa", "the same of the full order"),
    "expected_n": ("1", "that polytropic index, to take; NaN where it plays no role"),
    "place": ("1", "rank by the mean square error of all experiments and runs, from 1"),
    "best_n": ("1", "polytropic index with the lowest error; NaN where it plays no role"),
    "best_mse": ("Pa2", "mean square error at that n, both chambers"),
    "over_best": ("1", "that error over the best model's, geometric mean over paired runs"),
    "failed": ("1", "runs of an experiment without an error at that n"),
}
ABOUT |= {
    f"{name}_{end}": (ABOUT[name][0], f"{words} end of the 95 % interval of {name}")
    for name in ("best_mse", "over_best")
    for end, words in (("low", "lower"), ("high", "upper"))
}
RANKED = [name for name in ABOUT if name.startswith(("place", "best_", "over_best", "failed"))]
INDEXED = (*(name for name in ABOUT if name != "advice"), "run_status", "k_0", "limits")  # of the index


def studies_of(study: Study) -> dict[str, Study]:
    """A study for each cylinder of a table; its experiments have the names of the configuration again."""
    studies: dict[str, Study] = {}
    for full, e in study.experiments.items():
        name = full.removeprefix(experiment_name(e.cylinder, ""))
        of_cylinder = studies.setdefault(e.cylinder, study._replace(experiments={}))
        of_cylinder.experiments[name] = e._replace(name=name)
    return studies


def answer_dataset(answer: Answer) -> xr.Dataset:
    """Answer for one cylinder, with its ranking by model; `ABOUT` has the units."""
    ranking, names = answer.ranking, list(MODELS)
    rows = ranking.budget.rows if ranking.budget else ()
    rms, n = ({row.model: getattr(row, key) for row in rows} for key in ("rms", "n"))
    table = ranking.table.reindex(index=names, columns=RANKED)
    counts = {name: ("model", table[name].fillna(0).to_numpy(np.int32)) for name in ("place", "failed")}
    variables: dict[str, Any] = {
        "recommended": ((), answer.chosen),
        "as_good": ((), ", ".join(answer.as_good)),
        "reason": ((), answer.reason),
        "advice": ((), "\n".join(answer.advice)),
        "runs": ((), np.int32(ranking.runs)),
        "expected_rms": ("model", [rms.get(name, np.nan) for name in names]),
        "expected_rms_of_full_order": ((), rms.get(FULL_ORDER, np.nan)),
        "expected_n": ("model", [n.get(name, np.nan) for name in names]),
        **{str(name): ("model", table[name].to_numpy(float)) for name in table},
        **counts,
    }
    return xr.Dataset(variables, {"model": names})


def cylinder_dataset(study: Study, cells: xr.Dataset) -> xr.Dataset:
    """Results of one cylinder for a file: errors as 4-byte floats, answer and ranking, its study as JSON."""
    (answer,) = answers(cells)
    cells = cells.assign({name: cells[name].astype(np.float32) for name in CELLS if name in cells})
    cylinder = next(iter(study.experiments.values())).plant.cylinder
    sizes = {"bore": ((), cylinder.bore), "stroke": ((), cylinder.stroke)}
    parameters = {"parameters": ((), json.dumps(plain(study), allow_nan=False))}
    return cells.drop_vars("cylinder").merge(answer_dataset(answer)).assign(sizes | parameters)


def run_block(
    study: Study,
    threads: int,
    progress: Callable[[str], None] = lambda _cylinder: None,
    uncertain: Mapping[str, Uncertain] | None = None,
) -> xr.Dataset:
    """Run and rank every cylinder of a block, a group of rows of the table that one job computes.

    `progress` is called with the name of each cylinder once it is done; `uncertain` is that of `run_study`.
    The result does not depend on the number of threads.

    Returns
    -------
    xarray.Dataset
        By (cylinder, experiment, run, ...) the variables of `run_study`; by cylinder those of `ABOUT`, and
        `parameters`, its study as JSON.
    """

    def work(item: tuple[str, Study]) -> xr.Dataset:
        name, of_cylinder = item
        dataset = cylinder_dataset(of_cylinder, run_study(of_cylinder, 1, uncertain=uncertain, draws=DRAWS))
        progress(name)
        return dataset

    studies = studies_of(study)
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(work, studies.items()))
    return together(parts, list(studies))


def together(parts: Sequence[xr.Dataset], names: Sequence[str] | None = None) -> xr.Dataset:
    """Join datasets of cylinders, or of blocks of them, along `cylinder`."""
    dim = "cylinder" if names is None else xr.Variable("cylinder", list(names))
    labels = [name for name in ("k_0", "seed") if name in parts[0].coords]
    how: Mapping[str, Any] = {"compat": "equals", "join": "exact", "combine_attrs": "drop_conflicts"}
    dataset: xr.Dataset = xr.concat(parts, dim, coords=labels, **how)
    return described(dataset, {name: about for name, about in ABOUT.items() if name in dataset})


def fleet_index(blocks: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Ranking and main data of every cylinder of a fleet; `block` names the file with its errors."""
    parts: list[xr.Dataset] = []
    for name, block in blocks.items():
        part = block[list(INDEXED)].drop_vars("seed")
        part["failed_runs"] = (part["run_status"] != 0).sum(("experiment", "run")).astype(np.int32)
        part["failed_runs"].attrs = {"units": "1", "long_name": "full-order runs that failed"}
        part["block"] = ("cylinder", [name] * part.sizes["cylinder"])
        parts.append(part.drop_vars("run_status"))
    return together(parts)
