"""Models of one volume of gas fitted to the runs of a rig, and judged on points that the fit did not use."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pneumo.fitting.estimate import ranked
from pneumo.fitting.fit_result import Estimate, FitResult, estimates_data, rms_of_chambers
from pneumo.fitting.least_squares import LeastSquares, Scale, covariances, solve
from pneumo.fitting.rig.rig_file import Rig, factor, fitted_quantity, key
from pneumo.fitting.rig.rig_record import Run
from pneumo.fitting.rig.rig_replay import ADIABATIC, RIG_MODELS, WALL, replay_run, rms, run_errors
from pneumo.fitting.settings import C_D, FEW_POINTS, HOSE_HELPS, PART, PART_OF_RUNS
from pneumo.physics.models import MODELS

P_SCALE, T_SCALE = 1e3, 1.0  # Pa and K, by which residuals are divided
FAR = 1e3  # residual where there is no replay
STARTS = (0.5, 0.3, 0.15, 0.95)  # between the two ends, on a logarithmic scale where both are positive
OFF_END = 0.01  # distance from the ends, of the same kind, at which a search begins
ON_END = 1e-3  # of the distance between its ends, within which a parameter is on one of them
POSSIBLE_HOSE = {"hose_volume": (0.2e-6, 1e-4), "hose_C": (0.05e-8, 10e-8)}  # 16 mm to 8 m of 4 mm
LEAST_HOSE = 1e-3  # of a vessel's volume: the gas of a smaller hose is nothing beside the vessel's
MOST_SHOWN = 2000  # samples of a pressure in the result


def fitted_names(rig: Rig, model: str) -> list[str]:
    """Quantities of a rig that are fitted with a model."""
    names = [name for name, (low, high) in rig.ends.items() if low < high]
    row = MODELS.get(model)
    if row is None or not row.has_n:
        names = [name for name in names if name != "n"]
    if (row is not None and row.wall == "none") or model == ADIABATIC:
        names = [name for name in names if name not in WALL]
    return [name for name in names if name != "T_lag" or row is None]


@dataclass(frozen=True)
class RigProblem(LeastSquares):
    """Least squares of a model; the distance between a parameter's ends is 1."""

    rig: Rig
    model: str
    runs: Sequence[Run]
    scales: Mapping[str, Scale]
    fixed: Mapping[str, float]
    temperature: bool = False  # whether measured temperatures are fitted too
    slope_step: ClassVar[float] = 1e-6

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Measured minus replayed, over `P_SCALE` or `T_SCALE`, shape (1, point); `FAR` without replay."""
        parts, values = list[np.ndarray](), self.values(theta)
        for run in self.runs:
            P, T = run_errors(self.rig, self.model, values, run)
            parts += [P / P_SCALE, T / T_SCALE] if self.temperature else [P / P_SCALE]
        all_errors = np.concatenate(parts)
        return np.where(np.isfinite(all_errors), -all_errors, FAR)[None]

    def start(self, position: float) -> np.ndarray:
        """Parameters at a relative position, 0 to 1, between their ends.

        The position is on a logarithmic scale where both ends are positive.
        """
        return self.inner(
            {
                name: low * (high / low) ** position if low > 0 else low + position * (high - low)
                for name, (low, high, *_) in self.scales.items()
            }
        )

    def near(self, values: Mapping[str, float]) -> np.ndarray:
        """Parameters at the values of another fit, off their ends."""
        low, high = self.bounds()
        return np.clip(self.inner(values), low + OFF_END, high - OFF_END)


def fit_rig(
    rig: Rig,
    model: str,
    runs: Sequence[Run],
    temperature: bool = False,
    near: Mapping[str, float] | None = None,
    alone: bool = False,
) -> Estimate:
    """Estimate of a model from some runs: the lowest sum of squares that a search finds from several starts.

    `near`, values of another fit, are one more start, or with `alone` the only one. Intervals do not include
    an error of the model itself. A parameter on one of its ends has none.
    """
    fixed, names = {name: low for name, (low, _) in rig.ends.items()}, fitted_names(rig, model)
    scales = {name: Scale(*ends, unit=ends[1] - ends[0]) for name, ends in rig.ends.items() if name in names}
    problem = RigProblem(rig, model, runs, scales, fixed, temperature)
    starts = [problem.near(near)] if near is not None else []
    starts += [] if alone else [problem.start(position) for position in STARTS]
    best = min((solve(problem, start) for start in starts), key=lambda found: found.squares)
    values, (low, high) = problem.values(best.theta), problem.intervals(best, covariances(best))
    on_end = problem.at_bound(best.theta, ON_END)
    low, high = (ends | dict.fromkeys(on_end, np.nan) for ends in (low, high))
    errors = np.array([rms(side) for side in pressure_errors(rig, model, values, runs)])
    return Estimate(
        values, low, high, errors, np.full_like(errors, np.nan), pressure=np.empty(0), at_bound=on_end
    )


def pressure_errors(
    rig: Rig, model: str, values: Mapping[str, float], runs: Sequence[Run]
) -> list[np.ndarray]:
    """Errors of the pressures at all points of some runs, Pa, by chamber."""
    parts = [np.split(run_errors(rig, model, values, run)[0], len(run.pressures)) for run in runs]
    return [np.concatenate(side) for side in zip(*parts, strict=True)]


def rig_warnings(rig: Rig, runs: Sequence[Run], lowest: float) -> list[str]:
    """Warning of a hose between valve and chamber that the rig lacks, if it would lower the error much.

    `runs` are those that were fitted, `lowest` is the lowest error of a model there, Pa.
    """
    if not rig.has("valve_C_in") or rig.has("hose_volume"):
        return []
    smallest, largest = POSSIBLE_HOSE["hose_volume"]
    smallest = max(smallest, LEAST_HOSE * rig.ends.get("volume", (0.0, 0.0))[0])
    if smallest >= largest:
        return []
    possible = POSSIBLE_HOSE | {"hose_volume": (smallest, largest)}
    line = fit_rig(rig.changed(**possible), "full order", runs)
    if (left := rms_of_chambers(line.rms)) > HOSE_HELPS * lowest:
        return []
    words = " and ".join(map(key, POSSIBLE_HOSE))
    volume, C = (line.values[name] / factor(name) for name in POSSIBLE_HOSE)
    return [
        f"a hose of {volume:.3g} mL and {C:.3g} dm3/(s bar) between valve and chamber would bring the error"
        f" from {lowest / 1e3:.3g} to {left / 1e3:.3g} kPa: add {words}"
    ]


Parts = list[tuple[Sequence[Run], Sequence[Run]]]  # runs that are fitted, and that are held out


def parted(runs: Sequence[Run]) -> tuple[Sequence[Run], Parts, str]:
    """Runs from which the estimates are, parts by which a model is judged, and a sentence on both.

    Of several runs, the first are fitted. Of a single run with many points, the later ones are held out. Of
    one with few points, every second is held out, then the others.
    """
    ranked_by = "models are ranked by their error on"
    if len(runs) > 1:
        first = max(1, round(PART_OF_RUNS * len(runs)))
        text = (
            f"the first quarter of the pulses was fitted; {ranked_by} the others, which they replay from rest"
        )
        return runs[:first], [(runs[:first], runs[first:])], text
    (run,), t = runs, runs[0].P.t
    if len(t) > FEW_POINTS:
        last = t[0] + PART * np.ptp(t)
        early = [run.within(-np.inf, last)]
        text = f"{ranked_by} the rest, which they replay from the run's start"
        return early, [(early, [run.within(last, np.inf)])], f"the first part of the run was fitted; {text}"
    first, second = ([run._replace(P=run.P.part(slice(k, None, 2)))] for k in (0, 1))
    text = f"estimates are from all points; {ranked_by} every second point, fitted on the others, both ways"
    return runs, [(first, second), (second, first)], text


def judged(
    rig: Rig,
    model: str,
    runs: Sequence[Run],
    temperature: bool = False,
    near: Mapping[str, float] | None = None,
) -> Estimate:
    """Estimate of a model from the runs that are fitted, with its error on points that a fit did not use."""
    fitted, parts, _ = parted(runs)
    estimate = fit_rig(rig, model, fitted, temperature, near)
    left = list[list[np.ndarray]]()
    for used, others in parts:
        values = estimate.values
        if len(parts) > 1:
            values = fit_rig(rig, model, used, temperature, values, alone=True).values
        left.append(pressure_errors(rig, model, values, others))
    held_out = np.array([rms(np.concatenate(side)) for side in zip(*left, strict=True)])
    return estimate._replace(held_out=held_out)


def judged_models(
    rig: Rig,
    runs: Sequence[Run],
    models: Sequence[str] = RIG_MODELS,
    temperature: bool = False,
    progress: Callable[[str], None] = lambda _text: None,
) -> FitResult:
    """Several models fitted to a rig's runs, with the last run as it was measured and as they replay it.

    Besides the variables of every fit, there are `rms_temperature`, K, by model and, where temperatures were
    measured, `T`, K, by t_T and `temperature`, K, by (model, t_T).
    """
    estimates = dict[str, Estimate]()
    for model in models:
        best = min(estimates.values(), key=lambda e: rms_of_chambers(e.rms), default=None)
        estimates[model] = judged(rig, model, runs, temperature, best and best.values)
        fitted, left = (rms_of_chambers(e) / 1e3 for e in (estimates[model].rms, estimates[model].held_out))
        progress(f"{model}: {fitted:.2f} kPa fitted, {left:.2f} held out")
    estimates, run, (used, _, text) = ranked(estimates), runs[-1], parted(runs)
    every = slice(None, None, max(1, -(-len(run.P.t) // MOST_SHOWN)))
    t = run.P.t[every]
    replays = {model: replay_run(rig, model, e.values, run) for model, e in estimates.items()}
    shown = {
        model: e._replace(
            values={name: e.values[name] for name in fitted_names(rig, model)},
            pressure=np.array([np.interp(t, *P) for P in replays[model].pressures]),
        )
        for model, e in estimates.items()
    }
    off_T = [
        np.concatenate([run_errors(rig, model, e.values, run)[1] for run in runs])
        for model, e in estimates.items()
    ]
    quantities = {name: fitted_quantity(name) for name, (low, high) in rig.ends.items() if low < high}
    K = {"units": "K"}
    data = estimates_data(shown, {name: quantity.unit for name, quantity in quantities.items()})
    data = data.assign_coords(t=("t", t, {"units": "s"})).assign(
        P=(("chamber", "t"), [P.values[every] for P in run.pressures], {"units": "Pa"}),
        x=("t", np.interp(t, run.t, run.x), {"units": "m"}),
        rms_temperature=("model", [rms(T) if len(T) else np.nan for T in off_T], K),
    )
    if run.T is not None:
        T = [np.interp(run.T.t, *replayed.T) for replayed in replays.values()]
        data = data.assign_coords(t_T=("t_T", run.T.t, {"units": "s"})).assign(
            T=("t_T", run.T.values, K), temperature=(("model", "t_T"), T, K)
        )
    lowest = min(rms_of_chambers(e.rms) for e in estimates.values())
    return FitResult(
        data=data,
        notes=(text,),
        warnings=(*rig_warnings(rig, used, lowest), *unphysical(rig, shown)),
        held_out_from=0.0 if len(runs) > 1 else float(used[0].P.t[-1]),
        quantities=quantities,
        of="rig",
    )


def unphysical(rig: Rig, estimates: Mapping[str, Estimate]) -> list[str]:
    """Warnings of an n or a discharge coefficient that no gas and no orifice has, by model."""
    physical = {"n": (1.0, rig.gas.gamma), "C_d": C_D}
    return [
        f"{model}: {name} = {e.values[name]:.3g} is not from {low:g} to {high:g}: not physical"
        for model, e in estimates.items()
        for name, (low, high) in physical.items()
        if name in e.values and not low <= e.values[name] <= high
    ]
