"""Whether refinements of a model pay under other assumptions and other physics than the study's.

Ratios of mean square errors with and without a refinement, under every alternative of the ledger that
reaches the grid and under other physics beside it. Runs are cut to `LONGEST` s, the shortest of Table 6.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.evidence.error_budget import sliced
from pneumo.evidence.toggles import Case, cases, overridden
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import MODELS
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import OK, replay
from pneumo.simulation.signals import EXACT, PUBLISHED, study_transport
from pneumo.statistics.averages import OVERALL
from pneumo.storage.layout import experiment_labels
from pneumo.verdict import PAPER_FOLDER
from pneumo.verdict.assumptions import AS_TAKEN

LONGEST = 60.0  # s
COMPARED = ("M5", "M6", "M7", "M8", "M9", "M10")
PAIRS = {"M6/M5": ("M6", "M5"), "M8/M7": ("M8", "M7"), "M10/M8": ("M10", "M8")}
TRANSPORTS = (EXACT, PUBLISHED)
CRITERIA = ("mean", "geometric mean")  # over experiments
SUPPLY = {"4_bar": 4e5, "5_5_bar": 5.5e5, "8_5_bar": 8.5e5, "10_bar": 1e6}  # Pa; the study's is 7e5
INLET = 20.0  # K by which incoming air differs from the walls
COULOMB = 0.05  # of supply pressure times piston area: what catalogues allow for a cylinder's own friction
LEAK = 0.01  # of the fully open area, between a chamber and either port: a worn spool
CRITICAL = 0.3  # critical ratio of a bought valve; catalogues have 0.2 to 0.5


def sticking(plant: Plant) -> Plant:
    """Coulomb friction beside the viscous one."""
    cylinder = plant.cylinder
    coulomb = COULOMB * plant.conditions.P_s * cylinder.A_A
    return plant._replace(cylinder=cylinder._replace(coulomb=coulomb))


def leaking(plant: Plant) -> Plant:
    """A valve that never shuts."""
    valve = plant.valve
    return plant._replace(valve=valve._replace(leak=LEAK * valve.k_xu * valve.u_max))


def elliptic(plant: Plant) -> Plant:
    """ISO 6358 in the place of eq (1), from its own equilibrium."""
    gas, c = plant.gas._replace(critical_ratio=CRITICAL, elliptic=True), plant.conditions
    P_0 = equilibrium_pressure(c.P_s, c.P_atm, gas)
    return plant._replace(gas=gas, conditions=c._replace(P_0=P_0))


PHYSICS: dict[str, Callable[[Plant], Plant]] = {
    "friction_law.coulomb": sticking,
    "valve.leak": leaking,
    "valve.elliptic": elliptic,
}


def changed(case: Case, change: Callable[[Plant], Plant]) -> Case:
    """The same study with another plant in every experiment."""
    experiments = {name: e._replace(plant=change(e.plant)) for name, e in case.study.experiments.items()}
    return case._replace(study=case.study._replace(experiments=experiments))


def run_of(case: Case, name: str) -> tuple[Any, ...]:
    """What the full-order run of an experiment depends on."""
    e = case.study.experiments[name]
    return e.plant, e.drive, e.excitation, e.h, e.steps, case.record


def alternatives(configuration: Mapping[str, Any], folder: Path = PAPER_FOLDER) -> dict[str, Case]:
    """Every alternative that makes other full-order runs, after the study `AS_TAKEN`.

    Parameters
    ----------
    configuration : mapping
        The study's configuration, as in its file.
    folder : pathlib.Path
        Folder of ``assumptions.yaml``.

    Raises
    ------
    PaperError
        If the ledger or a value does not fit the configuration.
    """
    ledger = cases(configuration, folder)
    taken = ledger[AS_TAKEN]
    found = {
        name: case
        for name, case in ledger.items()
        if case is taken or any(run_of(case, e) != run_of(taken, e) for e in taken.study.experiments)
    }
    found |= {name: changed(taken, change) for name, change in PHYSICS.items()}
    for name, P_s in SUPPLY.items():
        found[f"supply.{name}"] = overridden(configuration, {"supply.P_s_Pa": P_s}, f"supply.{name}")
    T_amb = next(iter(taken.study.experiments.values())).plant.conditions.T_amb
    for name, T_in in (("inlet.colder", T_amb - INLET), ("inlet.warmer", T_amb + INLET)):
        found[name] = overridden(configuration, {"supply.T_in_K": T_in}, name)
    return found


def errors(experiment: Experiment, case: Case, transports: tuple[str, ...] = TRANSPORTS) -> np.ndarray:
    """Mean square error over both chambers, Pa^2, by (transport, model, n); NaN where a cell failed."""
    e, n = experiment, case.study.n
    lanes, index = grid_lanes(n, e.plant.gas.gamma)
    rows = index[[list(MODELS).index(model) for model in COMPARED]].ravel()
    recording = case.record(e)
    found = []
    for transport in transports:
        reading = study_transport(transport, case.study.lag, e.h)
        cells = replay(recording, lanes[rows], reading, e.steps)
        mse = np.where(cells.status == OK, cells.mse, np.nan).mean(axis=1)
        found.append(mse.reshape(len(COMPARED), len(n)))
    return np.array(found)


def of_experiment(name: str, found: Mapping[str, Case]) -> xr.Dataset:
    """`mse` of one experiment under every alternative; equal runs are made once."""
    made: dict[Any, np.ndarray] = {}
    values = []
    for case in found.values():
        key = run_of(case, name)
        if key not in made:
            made[key] = errors(sliced(case.study.experiments[name], LONGEST), case)
        values.append(made[key])
    case = found[AS_TAKEN]
    print(f"{name}: {len(made)} full-order runs under {len(found)} alternatives, done", flush=True)
    dims = ("alternative", "transport", "model", "n")
    coords = {"alternative": list(found), "transport": list(TRANSPORTS), "model": list(COMPARED)}
    coords |= {"n": list(case.study.n)} | experiment_labels(case.study.experiments[name])
    return xr.Dataset({"mse": (dims, np.array(values))}, coords)


def scores(mse: xr.DataArray, levels: Mapping[str, Sequence[str]]) -> xr.DataArray:
    """Error of each model over the experiments of a level, at its best constant n there.

    Parameters
    ----------
    mse : xarray.DataArray
        By (experiment, model, n) and more.
    levels : mapping of str to sequence of str
        Experiments of each level.

    Returns
    -------
    xarray.DataArray
        Pa^2, by (level, criterion, model) and what more `mse` has; overall, each model at its best n in each
        experiment, as in Table 7. NaN for a level without experiments.
    """
    logarithm = xr.DataArray(np.log(mse))

    def both(part: xr.DataArray, logarithms: xr.DataArray) -> xr.DataArray:
        mean = part.mean("experiment", skipna=False)
        geometric = xr.DataArray(np.exp(logarithms.mean("experiment", skipna=False)))
        return xr.concat([mean, geometric], xr.Variable("criterion", list(CRITERIA)))

    found = {OVERALL: both(mse.min("n"), logarithm.min("n"))}
    for level, names in levels.items():
        inside = np.isin(mse["experiment"], names)
        if inside.any():
            found[level] = both(mse.sel(experiment=inside), logarithm.sel(experiment=inside)).min("n")
        else:
            found[level] = xr.full_like(found[OVERALL], np.nan)
    return xr.concat(
        list(found.values()), xr.Variable("level", list(found)), coords="minimal", compat="override"
    )


def summary(mse: xr.DataArray, levels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Ratios of the refinements and how often they pay.

    Returns
    -------
    xarray.Dataset
        `ratio` by (pair, level, criterion, alternative, transport); `share` of the alternatives with a ratio
        below one, of the `counted` that have one at all, by (pair, level, criterion, transport).
    """
    found = scores(mse, levels)
    pair = xr.Variable("pair", list(PAIRS))
    ratio = xr.concat(
        [found.sel(model=new, drop=True) / found.sel(model=old, drop=True) for new, old in PAIRS.values()],
        pair,
    )
    others = ratio.drop_sel(alternative=AS_TAKEN)
    counted = others.notnull().sum("alternative")
    share = (others < 1).sum("alternative") / counted.where(counted > 0)
    counted = counted.astype(np.int32)
    units = {"units": "1"}
    return xr.Dataset(
        {
            "ratio": ratio.assign_attrs(
                units | {"long_name": "mean square error over that of the simpler model"}
            ),
            "share": share.assign_attrs(
                units | {"long_name": "share of alternatives with a ratio below one"}
            ),
            "counted": counted.assign_attrs(units | {"long_name": "alternatives that have a ratio"}),
        }
    )


def study_variants(found: Mapping[str, Case], threads: int = 1) -> xr.Dataset:
    """`mse` by (experiment, alternative, transport, model, n), and its `summary`."""
    study = found[AS_TAKEN].study
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(lambda name: of_experiment(name, found), study.experiments))
    cells = xr.concat(parts, "experiment", coords=["cylinder", "loop", "k_0"], compat="equals")
    return cells.merge(summary(cells["mse"], study.experiments_by_level))
