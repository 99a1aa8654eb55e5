"""Cells of an own study whose ranking is known beforehand."""

import numpy as np
import xarray as xr

from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.physics.models import MODELS
from pneumo.selection.answer import Answer, answer
from pneumo.selection.cylinder_ranking import OFF_PLANTS

N = [1.2, 1.3, 1.4]
PAPER_LEVEL = dict(zip(PAPER_MODELS, (900, 80, 100, 3000, 20, 8, 6, 3, 2.5, 2.4), strict=True))
LEVEL = {name: PAPER_LEVEL.get(name, 5000.0 + i) for i, name in enumerate(MODELS)}

FULL_ORDER = 0.5  # of the same measure, where its k_0 is right within the range
SWING = 50e3  # Pa


def made(
    level=LEVEL,
    runs=4,
    noise=0.02,
    experiments=("X",),
    best=1.3,
    scale=1e6,
    ends=(1.0, 1.0),
    full=FULL_ORDER,
    off_plant=None,
):
    """Cells with a given MSE for each model at n = `best`, more elsewhere, and noise that models share.

    With walls, it is as many times that as `ends` say where the cylinder's k_0 is the lowest or the highest;
    so is the full order's, `full`. With `off_plant`, eight factors, all models have as many times their error
    where k_0, valve (within 3 %) and dead volumes (within 20 %) are at their ends, the full order of M6's.
    """
    rng = np.random.default_rng(1)
    shape = (len(experiments), runs, len(MODELS), len(N), 2)
    common = np.exp(noise * rng.standard_normal((len(experiments), runs, 1, 1, 1)))
    factor = np.exp(noise / 10 * rng.standard_normal(shape))
    bowl = np.array([1.0 + 4 * abs(n - best) for n in N])
    levels = np.array([level[name] for name in MODELS])[:, None, None]
    values = scale * levels * bowl[:, None] * common * factor
    for i, model in enumerate(MODELS.values()):
        if not model.has_n:
            values[:, :, i] = values[:, :, i, :1]
    dims = ("experiment", "run", "model", "n", "chamber")
    walled = np.array([model.wall != "none" for model in MODELS.values()])[:, None, None]
    wrong = np.stack([np.where(walled, values * times, values) for times in ends])
    meanings = {"flag_meanings": "ok diverged"}
    data = {"mse": (dims, values), "mse_of_wrong_k_0": (("k_0_end", *dims), wrong)}
    data["mse_of_right_k_0"] = (("k_0_end", *dims), np.stack([values, values]))
    errors = np.stack([scale * full * times * common[:, :, 0, 0] * np.ones(2) for times in ends])
    data["mse_of_full_order"] = (("k_0_end", "experiment", "run", "chamber"), errors)
    if off_plant:
        data["mse_of_off_plant"] = (("off_plant", *dims), np.stack([values * times for times in off_plant]))
        errors = np.stack(
            [scale * level["M6"] * times * common[:, :, 0, 0] * np.ones(2) for times in off_plant]
        )
        data["mse_of_full_order_off_plant"] = (("off_plant", "experiment", "run", "chamber"), errors)
    data["swing"] = (dims[:2], np.full(shape[:2], SWING))
    data["run_status"] = (dims[:2], np.zeros(shape[:2], np.int8), meanings)
    data["run_failure_time"] = (dims[:2], np.full(shape[:2], np.nan))
    same = {"random": np.int8(1), "duration": 20.0, "time_constant": 0.7, "k_0_factor": 2.0}
    if off_plant:
        same |= {"valve_within": 0.03, "dead_volumes_within": 0.2}
    for name, value in same.items():
        data[name] = ("experiment", np.full(len(experiments), value))
    coords = {"experiment": list(experiments), "model": list(MODELS), "n": N, "k_0_end": ["low", "high"]}
    if off_plant:
        coords["off_plant"] = list(OFF_PLANTS)
    coords["k_0"] = ("experiment", np.full(len(experiments), 0.3))
    coords["cylinder"] = ("experiment", ["mine"] * len(experiments))
    coords["seed"] = (dims[:2], np.arange(np.prod(shape[:2])).reshape(shape[:2]))
    return xr.Dataset(data, coords)


def answered(cells) -> Answer:
    return answer(cells, "mine")
