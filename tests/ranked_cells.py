"""Cells of an own study whose ranking is known beforehand."""

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS
from pneumo.statistics.ranking import Ranking, rank_models
from pneumo.statistics.recommendation import recommend

N = [1.2, 1.3, 1.4]
LEVEL = dict(zip(MODELS, (900, 80, 100, 3000, 20, 8, 6, 3, 2.5, 2.4), strict=True))


def made(level=LEVEL, runs=4, noise=0.02, experiments=("X",), best=1.3, scale=1e6):
    """Cells with a given MSE for each model at n = `best`, more elsewhere, and noise that models share."""
    rng = np.random.default_rng(1)
    shape = (len(experiments), runs, len(MODELS), len(N), 2)
    common = np.exp(noise * rng.standard_normal((len(experiments), runs, 1, 1, 1)))
    own = np.exp(noise / 10 * rng.standard_normal(shape))
    bowl = np.array([1.0 + 4 * abs(n - best) for n in N])
    values = scale * np.array([level[name] for name in MODELS])[:, None, None] * bowl[:, None] * common * own
    for i, model in enumerate(MODELS.values()):
        if not model.has_n:
            values[:, :, i] = values[:, :, i, :1]
    dims = ("experiment", "run", "model", "n", "chamber")
    wrong = np.stack([values * 2, values * 3])
    meanings = {"flag_meanings": "ok diverged"}
    data = {"mse": (dims, values), "mse_of_wrong_k_0": (("k_0_factor", *dims), wrong)}
    data["run_status"] = (dims[:2], np.zeros(shape[:2], np.int8), meanings)
    data["run_failure_time"] = (dims[:2], np.full(shape[:2], np.nan))
    for name, value in {"random": np.int8(1), "duration": 20.0, "time_constant": 0.7}.items():
        data[name] = ("experiment", np.full(len(experiments), value))
    coords = {"experiment": list(experiments), "model": list(MODELS), "n": N, "k_0_factor": [0.5, 2.0]}
    coords["cylinder"] = ("experiment", ["mine"] * len(experiments))
    coords["seed"] = (dims[:2], np.arange(np.prod(shape[:2])).reshape(shape[:2]))
    return xr.Dataset(data, coords)


def ranked(cells, cylinder) -> Ranking:
    return recommend(rank_models(cells, cylinder), cells)
