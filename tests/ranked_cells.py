"""Cells of an own study whose ranking is known beforehand."""

import numpy as np
import xarray as xr

from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.physics.models import MODELS
from pneumo.quantities.table import GROUPS
from pneumo.selection.answer import Answer, answer
from pneumo.selection.cylinder_ranking import ROWS
from pneumo.selection.error_budget import NOTHING

N = [1.2, 1.3, 1.4]
PAPER_LEVEL = dict(zip(PAPER_MODELS, (900, 80, 100, 3000, 20, 8, 6, 3, 2.5, 2.4), strict=True))
LEVEL = {name: PAPER_LEVEL.get(name, 5000.0 + i) for i, name in enumerate(MODELS)}

FULL = 0.5  # MSE of the full order on drawn cylinders, in the same measure
SWING = 50e3  # Pa
DRAWS, PART_DRAWS = 16, 8


def made(
    level=LEVEL,
    runs=4,
    noise=0.02,
    experiments=("X",),
    best=1.3,
    scale=1e6,
    full=FULL,
    unknown=None,
    measured=None,
):
    """Cells with a given MSE for each model at n = `best`, more elsewhere, and noise that models share.

    On drawn cylinders the MSE of every row is larger by what `unknown` adds for each group, which vanishes
    where that group is known. `measured` are errors on data held out of a fit, Pa, by row.
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
    data = {"mse": (dims, values)}
    groups, unknown = [*GROUPS, NOTHING], unknown or {}
    own = np.array([*levels[:, 0, 0], full])
    total = own + sum(unknown.values())
    draws = np.exp(noise * rng.standard_normal((len(experiments), DRAWS, len(ROWS), 2)))
    data["mse_drawn"] = (("experiment", "draw", "row", "chamber"), scale * total[:, None] * draws)
    alone = np.full((len(groups), len(experiments), PART_DRAWS, len(ROWS), 2), np.nan)
    others = alone.copy()
    alone[-1] = scale * own[:, None] * draws[:, :PART_DRAWS]
    for group, extra in unknown.items():
        alone[groups.index(group)] = scale * (own + extra)[:, None] * draws[:, :PART_DRAWS]
        others[groups.index(group)] = scale * (total - extra)[:, None] * draws[:, :PART_DRAWS]
    data["mse_alone"] = (("group", "experiment", "part_draw", "row", "chamber"), alone)
    data["mse_others"] = (("group", "experiment", "part_draw", "row", "chamber"), others)
    held_out = [[(measured or {}).get(name, np.nan) for name in ROWS]] * len(experiments)
    data["measured"] = (("experiment", "row"), held_out)
    data["limits"] = ("experiment", ["C ± 10 %"] * len(experiments))
    data["flow"] = ("experiment", ["Cv: 0.4 ± 3 %"] * len(experiments))
    data["swing"] = (dims[:2], np.full(shape[:2], SWING))
    data["run_status"] = (dims[:2], np.zeros(shape[:2], np.int8), {"flag_meanings": "ok diverged"})
    data["run_failure_time"] = (dims[:2], np.full(shape[:2], np.nan))
    for name, value in {"random": np.int8(1), "duration": 20.0, "time_constant": 0.7, "gamma": 1.4}.items():
        data[name] = ("experiment", np.full(len(experiments), value))
    coords = {
        "experiment": list(experiments),
        "model": list(MODELS),
        "n": N,
        "row": list(ROWS),
        "group": groups,
    }
    coords["k_0"] = ("experiment", np.full(len(experiments), 0.3))
    coords["cylinder"] = ("experiment", ["mine"] * len(experiments))
    coords["seed"] = (dims[:2], np.arange(np.prod(shape[:2])).reshape(shape[:2]))
    return xr.Dataset(data, coords)


def answered(cells) -> Answer:
    return answer(cells, "mine")
