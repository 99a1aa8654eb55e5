"""Statistics of decision 75's contest on held-out cylinders: error of each choice over the best in hindsight.

A choice is a model at an n; both come from the configuration, a rule, a simulation beforehand or hindsight.
"""

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np
import xarray as xr

from pneumo.evidence.random_cylinders.direct_rule import GROUP
from pneumo.evidence.random_cylinders.full_order_contest import FIXED_MODELS, WITH_K_0, WITHOUT_K_0
from pneumo.evidence.random_cylinders.regimes import INTERVAL
from pneumo.statistics.intervals import quotient_interval
from pneumo.statistics.model_pairs import REFINED_MODELS
from pneumo.storage.layout import described

CONFIGURED_N = 1.35
RULED = ("M6", "M8")  # models with an n by a rule of `GROUP`
RULE_A, RULE_B = np.linspace(1.2, 1.4, 9), np.linspace(0.0, 0.5, 21)
RULE_C = np.geomspace(0.1, 100.0, 25)
LIMIT = 0.95  # of the upper end of a quotient, for an answer
FEWEST_CYLINDERS = 200  # held out, for an answer
LARGE = 0.01  # of the swing: least error of the best model for a run that counts as large
BEFOREHAND = "best of a simulation"
QUANTITIES = ("mean", "nine_tenths", "within", "median", "of_swing")

Choices = dict[str, xr.DataArray]  # mean square error by (cylinder, loop), perhaps (k_0_told, valve_told)


def model_cells(cells: xr.Dataset, model: str) -> xr.DataArray:
    """Mean square errors of a model, Pa^2, by n, and by `k_0_told` if the model has a k_0."""
    if model in WITHOUT_K_0:
        return cells["mse_without_k_0"].sel(model_without_k_0=model, drop=True)
    return cells["mse_with_k_0"].sel(model_with_k_0=model, drop=True)


def best_in_hindsight(cells: xr.Dataset, models: tuple[str, ...] = REFINED_MODELS) -> xr.DataArray:
    """Lowest mean square error of some models, Pa^2, at the true k_0 and any n, by (cylinder, loop)."""
    lowest = [model_cells(cells, model).min("n") for model in models]
    true = [each.sel(k_0_told=1.0, drop=True) if "k_0_told" in each.dims else each for each in lowest]
    return xr.concat(true, "model", coords="minimal", compat="override").min("model")


def ruled_place(group: np.ndarray, a: float, b: float, c: float, grid: np.ndarray) -> np.ndarray:
    """Index in the even `grid` of the n nearest to a - b/(1 + c group), in the shape of `group`."""
    n = np.clip(a - b / (1 + c * group), grid[0], grid[-1])
    return np.rint((n - grid[0]) / (grid[1] - grid[0])).astype(int)


def at_place(mse: xr.DataArray, place: xr.DataArray) -> xr.DataArray:
    """Mean square error of each run at its n, given by the index `place` in the grid of n."""
    return mse.isel(n=place).drop_vars("n", errors="ignore")


def told_group(cells: xr.Dataset) -> xr.DataArray:
    """`GROUP` at each assumed k_0: the thermal time constant is inversely proportional to k_0."""
    return cells[GROUP] / cells["k_0_told"]


def fitted_rule(cells: xr.Dataset, model: str) -> tuple[float, float, float]:
    """Coefficients a, b, c of n = a - b/(1 + c group) for a model, fitted by least squares.

    The squares are those of ln(error over the best model's), of the fitted half's runs at the true k_0.
    """
    fitted = cells.sel(cylinder=cells["held_out"] == 0)
    mse = model_cells(fitted, model)
    mse = mse.sel(k_0_told=1.0, drop=True) if "k_0_told" in mse.dims else mse
    ratio: xr.DataArray = mse / best_in_hindsight(fitted)
    logs = np.log(ratio.transpose("cylinder", "loop", "n").values)
    group, grid = fitted[GROUP].transpose("cylinder", "loop").values, fitted["n"].values
    counts = np.isfinite(logs).all(axis=-1)
    group, squares = group[counts], logs[counts] ** 2
    best = (np.inf, np.nan, np.nan, np.nan)
    for a, b, c in product(RULE_A.tolist(), RULE_B.tolist(), RULE_C.tolist()):
        place = ruled_place(group, a, b, c, grid)
        best = min(best, (float(squares[np.arange(len(place)), place].mean()), a, b, c))
    return best[1:]


def choices(
    cells: xr.Dataset,
    rules: Mapping[str, tuple[float, float, float]],
    threshold: float,
    sides: tuple[str, str],
) -> Choices:
    """Mean square error of every choice of decision 75, Pa^2.

    `rules` are a, b and c of n by model. `threshold` is that of the rule of decision 57, and `sides` are its
    models below and from the threshold on. `cells` are joined runs, of random cylinders or of the paper's
    experiments.
    """
    grid, group = cells["n"].values, told_group(cells)
    made: Choices = {}
    for model in (*WITHOUT_K_0, *WITH_K_0):
        made[f"{model} at {CONFIGURED_N}"] = model_cells(cells, model).sel(n=CONFIGURED_N, drop=True)
        made[f"{model} in hindsight"] = model_cells(cells, model).min("n")
    for model, rule in rules.items():
        place = group.copy(data=ruled_place(group.values, *rule, grid))
        made[f"{model} by rule"] = at_place(model_cells(cells, model), place)
    below, above = (made[f"{model} by rule"] for model in sides)
    made["rule of decision 57"] = xr.where(group < threshold, below, above)
    simulated = cells["mse_simulated"]
    made[BEFOREHAND] = simulated.sel(carried="best", drop=True)
    for model in FIXED_MODELS:
        made[f"{model}, n of a simulation"] = simulated.sel(carried=model, drop=True)
    for law in cells["law"].values:
        full = cells["mse_full"].sel(law=law, drop=True)
        if law == "true":  # told the truth it is the run itself
            full = full.where((full["k_0_told"] != 1) | (full["valve_told"] != 1))
        made[f"full order, {law} law"] = full
    made["full order, adiabatic"] = cells["mse_adiabatic"]
    return made


def runs_counted(cells: xr.Dataset) -> dict[str, xr.DataArray]:
    """Masks by (cylinder, loop) of the held-out runs that count, by subset."""
    best = best_in_hindsight(cells)
    good = (cells["held_out"] == 1) & (cells["run_status"] == 0) & best.notnull()
    group, everywhere = cells[GROUP], xr.ones_like(best, dtype=bool)
    edges = np.quantile(group.values[good.transpose(*group.dims).values], [0, 1 / 3, 2 / 3, 1])
    parts = {"all": good} | {loop: good & (cells["loop"] == loop) for loop in cells["loop"].values}
    for i, third in enumerate(("lowest", "middle", "highest")):
        parts[f"{third} third"] = good & (group >= edges[i]) & (group <= edges[i + 1])
    parts["not cut"] = good & (cells["cut"] == 0)
    parts["large errors"] = good & (best > (LARGE * cells["swing"]) ** 2)
    return {name: (part & everywhere).transpose("cylinder", "loop") for name, part in parts.items()}


def mean_of_logs(logs: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Geometric mean over the counted runs, with its interval over cylinders: shape (3,).

    `logs`, of the errors, and `counted` have the shape (cylinder, loop).
    """
    inside = counted & np.isfinite(logs)
    sums = np.where(inside, np.nan_to_num(logs), 0.0).sum(axis=1)
    return np.exp(quotient_interval(sums, inside.sum(axis=1)))


def summaries(logs: np.ndarray, swing: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Values of `QUANTITIES` over the counted runs: mean, its interval (low, high), then the others."""
    values = np.where(np.isnan(logs), np.inf, logs)[counted]  # a failed replay is the worst
    rest = [np.quantile(values, 0.9), np.median(values)]
    within = (values <= np.log(1.1)).mean()
    of_swing = np.exp(np.mean(np.log(swing[counted & np.isfinite(swing)])))
    return np.array([*mean_of_logs(logs, counted), np.exp(rest[0]), within, np.exp(rest[1]), of_swing])


def at_told(values: xr.DataArray, k_0: float, valve: float) -> xr.DataArray:
    """Errors at an assumed k_0 and valve coefficient (factors), as far as the choice depends on them."""
    for name, told in (("k_0_told", k_0), ("valve_told", valve)):
        values = values.sel({name: told}, drop=True) if name in values.dims else values
    return values


def told_cases(values: xr.DataArray, cells: xr.Dataset) -> Iterator[tuple[float, float, xr.DataArray]]:
    """Cases of a choice: assumed k_0, assumed valve coefficient (factors), errors by (cylinder, loop).

    If the choice does not depend on one of the two, that one is the true value: 1.
    """
    k_values = cells["k_0_told"].values if "k_0_told" in values.dims else [1.0]
    valves = cells["valve_told"].values if "valve_told" in values.dims else [1.0]
    for k_0, valve in product(k_values, valves):
        at = at_told(values, k_0, valve)
        if at.notnull().any():
            yield float(k_0), float(valve), at.transpose("cylinder", "loop")


def contest_statistics(
    cells: xr.Dataset, paper: xr.Dataset, threshold: float, sides: tuple[str, str]
) -> xr.Dataset:
    """Errors of every choice over the best in hindsight, and of the full order over the best of a simulation.

    From the blocks joined along `cylinder`, with `held_out`, and from the paper's runs by `experiment`. A row
    is a choice at an assumed k_0 and valve coefficient. By (row, experiment): `paper_error`, of one run. By
    (row, part): `error` with an interval over cylinders, `nine_tenths`, `within` (fraction within 10 %),
    `median`, `of_swing` (geometric mean of RMS error over the run's standard deviation). By (case, part,
    bound): `full_quotient`, the full order over `BEFOREHAND` with the same assumptions. `rule_n` by (ruled,
    coefficient).
    """
    rules = {model: fitted_rule(cells, model) for model in RULED}
    made = choices(cells, rules, threshold, sides)
    of_paper, paper_best = choices(paper, rules, threshold, sides), best_in_hindsight(paper)
    parts, best = runs_counted(cells), best_in_hindsight(cells).transpose("cylinder", "loop")
    swing = cells["swing"].transpose("cylinder", "loop")
    labels, rows = list[tuple[str, float, float]](), list[np.ndarray]()
    kept: dict[tuple[str, float, float], np.ndarray] = {}
    paper_rows = list[np.ndarray]()
    for name, values in made.items():
        for k_0, valve, mse in told_cases(values, cells):
            logs = np.log(mse.values / best.values)
            relative = np.sqrt(mse.values) / swing.values
            kept[name, k_0, valve] = logs
            labels.append((name, k_0, valve))
            rows.append(np.array([summaries(logs, relative, part.values) for part in parts.values()]))
            paper_mse = at_told(of_paper[name], k_0, valve)
            paper_rows.append((paper_mse / paper_best).transpose("experiment").values)
    cases = [key for key in kept if key[0].startswith("full order, ") and (BEFOREHAND, *key[1:]) in kept]
    quotients = [
        [mean_of_logs(kept[key] - kept[BEFOREHAND, *key[1:]], part.values) for part in parts.values()]
        for key in cases
    ]
    values = np.array(rows)
    choice, k_0, valve = (list(column) for column in zip(*labels, strict=True))
    full, full_k_0, full_valve = (list(column) for column in zip(*cases, strict=True))
    dataset = xr.Dataset(
        {
            "error": (("row", "part", "bound"), values[..., :3]),
            **{name: (("row", "part"), values[..., 3 + i]) for i, name in enumerate(QUANTITIES[1:])},
            "paper_error": (("row", "experiment"), np.array(paper_rows)),
            "full_quotient": (("case", "part", "bound"), np.array(quotients)),
            "runs": ("part", [int(part.sum()) for part in parts.values()]),
            "cylinders": ("part", [int(part.any("loop").sum()) for part in parts.values()]),
            "rule_n": (("ruled", "coefficient"), list(rules.values())),
        },
        {"part": list(parts), "bound": list(INTERVAL), "ruled": list(rules), "coefficient": list("abc")},
    )
    dataset = dataset.assign_coords(experiment=paper["experiment"].values)
    dataset = dataset.assign_coords(
        choice=("row", choice),
        row_k_0=("row", k_0),
        row_valve=("row", valve),
        full=("case", full),
        case_k_0=("case", full_k_0),
        case_valve=("case", full_valve),
    )
    words = "mean square error over that of the best of M5 to M10 in hindsight"
    about = {
        "error": ("1", f"geometric mean of the {words}"),
        "nine_tenths": ("1", f"90 per cent quantile of the {words}"),
        "within": ("1", "fraction of the runs within 10 per cent of it"),
        "median": ("1", f"median of the {words}"),
        "of_swing": ("1", "geometric mean of the RMS error over the pressures' standard deviation"),
        "paper_error": ("1", f"{words}, one run of the paper"),
        "full_quotient": ("1", "mean square error over that of the best of a simulation, same knowledge"),
        "rule_n": ("1", "coefficients of n = a - b/(1 + c thermal), fitted on the half that is not held out"),
    }
    return described(dataset, about)


def row_of(contest: xr.Dataset, choice: str, k_0: float = 1.0, valve: float = 1.0) -> xr.Dataset | None:
    """Row of a choice at an assumed k_0 and valve coefficient (factors); None where it was not tried."""
    at = (contest["choice"] == choice) & np.isclose(contest["row_k_0"], k_0)
    places = np.flatnonzero(at & np.isclose(contest["row_valve"], valve))
    return contest.isel(row=int(places[0])) if len(places) else None


def answer(statistics: xr.Dataset) -> str:
    """Answer by the criterion of decision 75."""
    if statistics["cylinders"].sel(part="all") < FEWEST_CYLINDERS:
        return f"no answer: fewer than {FEWEST_CYLINDERS} cylinders held out"
    high = statistics["full_quotient"].sel(bound="high", part=["open", "closed"])
    told = ~statistics["full"].str.contains("adiabatic")  # which is told no k_0
    pays = (high < LIMIT) | ~told
    return "carry the full order" if bool(pays.all()) else "depends on what is known"
