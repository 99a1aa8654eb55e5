"""Error budget: the parts of a cell's error that come from the model, the signal sampling and the step.

Errors are full-order minus reduced pressure over a whole run, end stops and reversals of the sign included,
at up to `SAMPLES` instants. F_m and R_m are the full-order and the reduced pressure at 1/m of the study's
step with exact signals, R is the study's own replay, which reads sampled signals:

    F_1 - R  =  (F_16 - R_16)  +  (R_1 - R)  +  ((F_1 - R_1) - (F_16 - R_16))
    total    =  model          +  sampling   +  discretisation

The three add up exactly; their mean squares add up with a cross term, which is kept.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.errors import RunError
from pneumo.physics.models import MODELS
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import Recording, equilibrium, record
from pneumo.simulation.given_inputs import joint_rates, pressures_on_inputs
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.runge_kutta import C
from pneumo.simulation.signals import PUBLISHED, STUDY_SAMPLINGS, study_sampling
from pneumo.statistics.averages import along_levels, at_n, best_n
from pneumo.storage.layout import CHAMBERS, described, experiment_labels, status_attributes

SAMPLES = 20_000  # instants of a run, evenly spaced, at which errors are taken
SLICE = 10.0  # s from the start, where a whole run would take too long
REFERENCE_SLICE = 2.0  # s from the start, for the adaptive reference
HALVINGS = (1, 2, 4, 8, 16)  # steps within one of the study's
SAMPLED_AT = 20  # steps within one of the study's where samplings are compared: each period is a multiple
SAMPLE_PERIODS = (1e-4, 1e-3, 1e-2)  # s between samples of a recorded signal
INTERPOLATIONS = ("hold", "linear", "cubic")
LAMINAR = 1e-3  # 1 - P_d / P_u below which the regularised flow law is linear
SOLVER_TOLERANCE = 1e-10  # of the adaptive reference, relative to the scale of each state
MARGIN = 0.5  # fraction of the difference of two model errors that sampling and step may change

BUDGET_LONG_NAMES = {
    "total": "MSE of the study, published signal sampling",
    "total_exact": "MSE of the study, exact signals",
    "model_error": "mean square of the model's own error, 1/16 of the study's step, exact signals",
    "transport_error": "mean square of what the published signal sampling adds at the study's step",
    "discretisation_error": "mean square of what the study's step adds to the error with exact signals",
    "cross_term": "total less the mean squares of its three parts",
    "regularised_discretisation": "discretisation error with flow linear near equal pressures, slice",
    "chatter": "mean square of what linear flow near equal pressures takes from it, slice",
    "regularised_law": "mean square of what linear flow near equal pressures changes at 1/16 step, slice",
    "reference_model_error": "model error by the adaptive reference, on the reference slice",
    "reference_coarse": "mean square of the error of the study's step against the adaptive reference",
    "reference_fine": "mean square of the error of 1/16 of the step against the adaptive reference",
    "halving": "mean square of the change from a step to its half, exact signals",
    "sampled": "mean square of what sampled signals change in the reduced pressure, 1/20 of the step, slice",
}


def sliced(experiment: Experiment, seconds: float) -> Experiment:
    """Return an experiment whose run lasts at most `seconds`."""
    return experiment._replace(steps=min(experiment.steps, round(seconds / experiment.h)))


def refined(experiment: Experiment, m: int) -> Experiment:
    """Return an experiment at 1/m of its step: the same reference, drawn at the same times."""
    excitation = experiment.excitation._replace(every=experiment.excitation.every * m)
    return experiment._replace(h=experiment.h / m, steps=experiment.steps * m, excitation=excitation)


def regularised(experiment: Experiment, laminar: float = LAMINAR) -> Experiment:
    """Return an experiment whose flow is linear near equal pressures."""
    valve = experiment.plant.valve._replace(laminar=laminar)
    return experiment._replace(plant=experiment.plant._replace(valve=valve))


def full_pressure(recording: Recording, stride: int) -> np.ndarray:
    """Full-order pressures, Pa, shape (chamber, samples)."""
    return recording.states[::stride, [2, 4]].T


def exact_error(experiment: Experiment, lanes: np.ndarray, m: int, stride: int = 1) -> np.ndarray:
    """Full-order minus reduced pressure at 1/m of the step, exact signals, Pa: (lane, chamber, samples).

    A sample is taken every `stride` of the experiment's own steps.
    """
    recording, every = record(refined(experiment, m)), m * stride
    return full_pressure(recording, every) - replay(recording, lanes, EXACT_SAMPLING, every).pressure


def published_error(experiment: Experiment, lanes: np.ndarray, stride: int = 1) -> np.ndarray:
    """Full-order minus reduced pressure of the study itself, Pa: (lane, chamber, samples)."""
    recording, sampling = record(experiment), study_sampling(PUBLISHED, experiment)
    return full_pressure(recording, stride) - replay(recording, lanes, sampling, stride).pressure


def sampled_inputs(recording: Recording, every: int, interpolation: str) -> np.ndarray:
    """Limited command, position and velocity at every stage, shape (steps, 6, 3), from sampled signals.

    There are `every` steps between samples; `interpolation` is one of `INTERPOLATIONS`: last sample, straight
    line, or interpolating cubic spline (not-a-knot). The command is limited after the interpolation.
    """
    steps, h, u_max = len(recording.states) - 1, recording.h, recording.plant.valve.u_max
    signals = np.column_stack([recording.u, recording.states[:, :2]])
    if interpolation == "hold":
        # The last stage of a step still holds the sample in force when the step began.
        inputs = np.repeat(signals[np.arange(steps) // every * every, np.newaxis], len(C), axis=1)
    else:
        knots = np.arange(0, steps + 1, every) * h
        spline = make_interp_spline(knots, signals[::every], k={"linear": 1, "cubic": 3}[interpolation])
        inputs = spline((np.arange(steps)[:, np.newaxis] + C) * h)
    inputs[..., 0] = inputs[..., 0].clip(-u_max, u_max)
    return inputs


def sampled_errors(experiment: Experiment, lanes: np.ndarray) -> np.ndarray:
    """Mean square of the error that sampling adds to a reduced pressure, Pa^2.

    By (period, interpolation, lane, chamber). Sampled and exact signals are replayed at the same fine step,
    so that nothing but the sampling differs.
    """
    fine = refined(experiment, SAMPLED_AT)
    recording = record(fine)
    exact = replay(recording, lanes, EXACT_SAMPLING, SAMPLED_AT).pressure
    result = np.empty((len(SAMPLE_PERIODS), len(INTERPOLATIONS), *exact.shape[:2]))
    for i, period in enumerate(SAMPLE_PERIODS):
        for j, interpolation in enumerate(INTERPOLATIONS):
            inputs = sampled_inputs(recording, round(period / fine.h), interpolation)
            sampled = pressures_on_inputs(inputs, lanes, fine.plant, fine.h, SAMPLED_AT)
            result[i, j] = mean_square(exact - sampled)
    return result


def reference_error(experiment: Experiment, lanes: np.ndarray) -> np.ndarray:
    """Full-order minus reduced pressure of an adaptive solver, Pa: (lane, chamber, samples).

    DOP853 solves the full-order and the reduced models as one system, from draw to draw of the reference, so
    that no step contains a jump of the command. Valid while the piston stays between its stops and, in open
    loop, between the positions that reverse the sign: `RunError` if it leaves them or the solver gives up.
    """
    e = experiment
    reference = reference_series(e.drive, e.excitation, e.steps)
    y = np.concatenate([equilibrium(e.plant), np.full(2 * len(lanes), e.plant.conditions.P_0)])
    scale = np.concatenate([[e.plant.cylinder.stroke, 1.0], y[2:]])
    samples = np.empty((e.steps + 1, len(y)))
    for start in range(0, e.steps, e.excitation.every):
        t = np.arange(start, min(start + e.excitation.every, e.steps) + 1) * e.h
        solution = solve_ivp(
            lambda _, y, *arguments: joint_rates(y, *arguments),
            t[[0, -1]],
            y,
            method="DOP853",
            t_eval=t,
            args=(reference[start], lanes, e.drive, e.plant),
            rtol=SOLVER_TOLERANCE,
            atol=SOLVER_TOLERANCE * scale,
        )
        if not solution.success:
            raise RunError(f"{e.name}: adaptive reference: {solution.message}")
        samples[start : start + len(t)] = solution.y.T
        y = solution.y[:, -1]
    farthest = abs(samples[:, 0]).max()
    if farthest >= (e.plant.cylinder.x_max if e.drive.closed_loop else e.drive.x_reverse):
        raise RunError(f"{e.name}: adaptive reference: x = {farthest:g} m is out of its range")
    full = samples[:, [2, 4]].T
    return full - samples[:, 6:].reshape(len(samples), len(lanes), 2).transpose(1, 2, 0)


def mean_square(series: np.ndarray) -> np.ndarray:
    """Mean square over the last axis, the samples; the one at t = 0 counts, as in the study."""
    return (series**2).mean(axis=-1)


def budget(experiment: Experiment, n: tuple[float, ...]) -> xr.Dataset:
    """Error budget of every cell of one experiment: mean squares, Pa^2, by (model, n, chamber).

    `BUDGET_LONG_NAMES` describes the variables; `halving` is also by step, `sampled` also by (period,
    interpolation). `model_error`, `transport_error`, `discretisation_error` and `cross_term` add up to
    `total`.
    """
    lanes, index = grid_lanes(n, experiment.plant.gas.gamma)
    stride, ends = -(-experiment.steps // SAMPLES), (HALVINGS[0], HALVINGS[-1])
    exact = {m: exact_error(experiment, lanes, m, stride) for m in HALVINGS}
    total, coarse, fine = published_error(experiment, lanes, stride), *(exact[m] for m in ends)
    e, short = sliced(experiment, SLICE), sliced(experiment, REFERENCE_SLICE)
    slice_coarse, slice_fine = (exact_error(e, lanes, m) for m in ends)
    even_coarse, even_fine = (exact_error(regularised(e), lanes, m) for m in ends)
    true, samples = reference_error(short, lanes), short.steps + 1
    cell = ("model", "n", "chamber")
    squares = {
        "model_error": mean_square(fine),
        "transport_error": mean_square(total - coarse),
        "discretisation_error": mean_square(coarse - fine),
    }
    squares["cross_term"] = mean_square(total) - sum(squares.values())
    squares |= {
        "total": mean_square(total),
        "total_exact": mean_square(coarse),
        "regularised_discretisation": mean_square(even_coarse - even_fine),
        "chatter": mean_square(slice_coarse - slice_fine - (even_coarse - even_fine)),
        "regularised_law": mean_square(even_fine - slice_fine),
        "reference_model_error": mean_square(true),
        "reference_coarse": mean_square(slice_coarse[..., :samples] - true),
        "reference_fine": mean_square(slice_fine[..., :samples] - true),
    }
    halving = [mean_square(exact[m] - exact[2 * m]) for m in HALVINGS[:-1]]
    variables = {name: (cell, values[index]) for name, values in squares.items()} | {
        "halving": (("step", *cell), np.array(halving)[:, index]),
        "sampled": (("period", "interpolation", *cell), sampled_errors(e, lanes)[:, :, index]),
    }
    coords = {"model": list(MODELS), "n": list(n), "chamber": CHAMBERS} | experiment_labels(experiment)
    coords |= {"step": [experiment.h / m for m in HALVINGS[:-1]]}
    coords |= {"period": list(SAMPLE_PERIODS), "interpolation": list(INTERPOLATIONS)}
    return xr.Dataset(variables, coords)


def observed_order(halving: xr.DataArray) -> xr.DataArray:
    """Observed order of convergence by step, from mean squares of the change when the step is halved.

    It is 5, the method's order, where everything is smooth.
    """
    ratio = (halving / halving.shift(step=-1)).isel(step=slice(None, -1))
    return xr.apply_ufunc(np.log2, ratio) / 2


def told_apart(total: xr.DataArray, model_error: xr.DataArray) -> xr.DataArray:
    """Whether two models' MSE differ because of the models, not of sampling and step, by (model, other).

    True where sampling and step change the difference of the two MSE by less than `MARGIN` of the difference
    of the model errors alone.
    """
    seen, true = (mse - mse.rename(model="other") for mse in (total, model_error))
    return abs(seen - true) < MARGIN * abs(true)


def budget_by_level(cells: xr.Dataset, levels: Mapping[str, Sequence[str]]) -> xr.Dataset:
    """Budget by experiment and by level, joined over chambers, from cells of `budget` by experiment.

    `told_apart` by (study, experiment, model, other) compares models at their `best_n`. With the prefix
    ``level_``: every mean square averaged over a level's experiments, each model at the `constant_n` of the
    level, and `level_told_apart` by (study, level, model, other). `order` is that of the levels' averages.
    """
    joined = cells.mean("chamber", skipna=False)
    study = xr.Variable("study", list(STUDY_SAMPLINGS))

    def apart(part: xr.Dataset) -> xr.DataArray:
        totals = (part["total"], part["total_exact"])
        return xr.concat([told_apart(total, part["model_error"]) for total in totals], study)

    best = best_n(joined["total"])
    result = xr.Dataset({"best_n": best, "told_apart": apart(at_n(joined, best))})
    none = xr.full_like(joined.isel(experiment=0, drop=True), np.nan)
    averages: dict[str, xr.Dataset] = {}
    for level, names in levels.items():
        inside = np.isin(cells["experiment"], names)
        average = joined.sel(experiment=inside).mean("experiment", skipna=False) if inside.any() else none
        constant_n = best_n(average["total"])
        averages[level] = at_n(average, constant_n).assign(constant_n=constant_n)
    by_level = along_levels(averages)
    result = result.assign({f"level_{name}": by_level[name] for name in joined.data_vars})
    order = observed_order(by_level["halving"])
    return result.assign(constant_n=by_level["constant_n"], level_told_apart=apart(by_level), order=order)


def with_budget_attributes(dataset: xr.Dataset) -> xr.Dataset:
    """Return budgets with unit and long name on every variable."""
    flags = status_attributes(
        {0: "not told apart", 1: "told apart"},
        "whether numerical errors leave the difference of two models' MSE standing",
    )
    apart = {name: dataset[name].astype(np.int8) for name in ("told_apart", "level_told_apart")}
    dataset = dataset.assign({name: values.assign_attrs(flags) for name, values in apart.items()})
    about = {
        "order": ("1", "observed order of the step's error at this step"),
        "constant_n": ("1", "n of the lowest total of the level"),
        "step": ("s", "step before it is halved"),
        "period": ("s", "time between samples"),
    }
    for name, words in BUDGET_LONG_NAMES.items():
        about |= {name: ("Pa2", words), f"level_{name}": ("Pa2", f"{words}; average of the level")}
    return described(dataset, about)
