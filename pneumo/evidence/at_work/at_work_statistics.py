"""Rank correlation of replay error and error in use, and the simplest model that is good enough for a use."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.physics.models import MODELS
from pneumo.statistics.intervals import CONFIDENCE, student_interval

RESAMPLINGS, RESAMPLING_SEED = 1000, 49
ENOUGH = 1.1  # times the lowest error of use: what a model may lose
PREDICTS = 0.5  # rank correlation above which the whole interval must lie
BOUNDS = ("estimate", "low", "high")
COMPARED_FROM = "M2"  # M1 is left out of the answer whether the choice of a model hardly matters


class Use(NamedTuple):
    """A use of a model, in an observer or a controller, and where `plant_at_work` has its error."""

    error: str  # variable of `plant_at_work`
    at: dict[str, str]  # labels that select the error in that variable
    replayed: str  # loop of the runs whose replay errors it is compared with

    @property
    def paired(self) -> bool:
        """Whether the replay errors come from the same runs as the errors of this use."""
        return self.error == "estimation_error"


USES = {
    f"observer, {loop} loop, {sensors}": Use("estimation_error", {"loop": loop, "sensors": sensors}, loop)
    for loop in ("open", "closed")
    for sensors in ("none", "one", "both")
} | {
    f"controller, {kind}, {sensors}": Use(f"{kind}_error", {"control_sensors": sensors}, "closed")
    for kind in ("tracking", "following")
    for sensors in ("none", "both")
}


def carried_at(cells: xr.Dataset, factor: float) -> xr.Dataset:
    """Select cells by `model`: with k_0 times `factor` for models with wall heat, all for the others."""
    pairs = zip(cells["k_0_factor"].values, cells["model"].values, strict=True)
    chosen = [k == factor or MODELS[name].wall == "none" for k, name in pairs]
    cells = cells.isel(carried=np.flatnonzero(chosen)).swap_dims(carried="model")
    return cells.drop_vars(["k_0_factor", "carried"])


def spearman(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rank correlation of two arrays along the first axis, shape of the other axes; assumes no ties."""

    def centred(values: np.ndarray) -> np.ndarray:
        ranks = values.argsort(axis=0).argsort(axis=0)
        return ranks - (len(values) - 1) / 2

    x, y = centred(a), centred(b)
    return (x * y).sum(axis=0) / (x * x).sum(axis=0)


def correlations(
    replayed: np.ndarray, used: np.ndarray, paired: bool, rng: np.random.Generator
) -> np.ndarray:
    """Rank correlation of replay error and error in use over the models: with all seeds, then resampled.

    Shape (1 + `RESAMPLINGS`,). `replayed` and `used` are RMS errors of each run, shape (model, seed). If
    `paired`, both are of the same runs, and each resampling draws the same seeds for both.
    """
    count = used.shape[1]
    all_seeds = np.arange(count)
    draws = np.vstack([all_seeds, rng.integers(0, count, (RESAMPLINGS, count))])
    others = draws if paired else np.vstack([all_seeds, rng.integers(0, count, (RESAMPLINGS, count))])
    return spearman((replayed**2)[:, draws].mean(axis=-1), (used**2)[:, others].mean(axis=-1))


def with_bounds(values: np.ndarray) -> np.ndarray:
    """Estimate and interval, shape (3,), from the resamplings that `correlations` returns."""
    tail = 100 * (1 - CONFIDENCE) / 2
    return np.array([values[0], *np.percentile(values[1:], [tail, 100 - tail])])


def predicts(low: float) -> str:
    """Whether replay errors predict a use, in words, from the low end of the rank correlation's interval."""
    if low > PREDICTS:
        return "predicts use"
    return "does not" if low <= 0 else "in part"


def losses(used: np.ndarray) -> np.ndarray:
    """Ratio of each model's error to the best model's, geometric mean and interval: shape (model, 3).

    `used` holds the error of each run, shape (model, seed); the best model has the lowest geometric mean.
    """
    logarithms = np.log(used)
    best = logarithms[logarithms.mean(axis=1).argmin()]
    return np.exp([student_interval(model - best) for model in logarithms])


def at_work_statistics(cells: xr.Dataset) -> xr.Dataset:
    """Correlations and losses from the cells of all plants, joined along `plant`.

    `correlation` of replay error and error in use by (use, factor, plant, bound); `mean_correlation`, its
    mean over the plants, by (use, factor, bound); `loss`, the error over that of the best model, by (use,
    factor, plant, compared, bound). By (use, factor, plant): `cheapest`, the first model whose whole interval
    of the loss is below `ENOUGH`; `hardly_matters`, whether this is so for every model from `COMPARED_FROM`.
    """
    rng = np.random.default_rng(RESAMPLING_SEED)
    factors = sorted(set(cells["k_0_factor"].values.tolist()))
    models = list(dict.fromkeys(cells["model"].values.tolist()))
    plants = cells["plant"].values.tolist()
    shape = len(USES), len(factors), len(plants)
    correlation, mean = np.empty((*shape, 3)), np.empty((*shape[:2], 3))
    loss, cheapest = np.empty((*shape, len(models), 3)), np.empty(shape, dtype=object)
    for j, factor in enumerate(factors):
        at_factor = carried_at(cells, factor)
        for i, use in enumerate(USES.values()):
            errors = at_factor[use.error].sel(use.at).transpose("plant", "model", "seed").values
            replays = at_factor["replay_error"].sel(loop=use.replayed)
            replays = replays.transpose("plant", "model", "seed").values
            resampled = [correlations(*pair, use.paired, rng) for pair in zip(replays, errors, strict=True)]
            correlation[i, j] = [with_bounds(values) for values in resampled]
            mean[i, j] = with_bounds(np.mean(resampled, axis=0))
            loss[i, j] = [losses(of_plant) for of_plant in errors]
            cheapest[i, j] = [models[int(np.argmax(of_plant[:, 2] < ENOUGH))] for of_plant in loss[i, j]]
    matters = (loss[..., models.index(COMPARED_FROM) :, 2] < ENOUGH).all(axis=-1)
    dims = ("use", "factor", "plant")

    def ratio(long_name: str) -> dict[str, str]:
        return {"units": "1", "long_name": long_name}

    variables = {
        "correlation": ((*dims, "bound"), correlation, ratio("rank correlation")),
        "mean_correlation": (("use", "factor", "bound"), mean, ratio("over the plants")),
        "loss": ((*dims, "compared", "bound"), loss, ratio("error over that of the best model")),
        "cheapest": (dims, cheapest.astype(str), {"long_name": "first model that loses less than 10 %"}),
        "hardly_matters": (dims, matters.astype(np.int8), {"long_name": "whether M2 to M10 all do so"}),
    }
    coords = {"use": list(USES), "factor": factors, "plant": plants, "compared": models}
    return xr.Dataset(variables, coords | {"bound": list(BOUNDS)})


def joined(blocks: list[xr.Dataset]) -> xr.Dataset:
    """Cells of several plants along `plant`, named by cylinder and conductance."""
    names = [f"{block['cylinder'].item()}, {block['k_0'].item():.2g} W/K" for block in blocks]
    plain = [block.drop_attrs(deep=False) for block in blocks]
    return xr.concat(plain, xr.Variable("plant", names), coords="different", compat="equals")
