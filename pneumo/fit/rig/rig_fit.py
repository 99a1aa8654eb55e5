"""Models of one volume of gas fitted to the runs of a rig, and judged on points that the fit did not use."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import OptimizeResult, least_squares

from pneumo.fit.rig.rig_file import Rig, factor, key
from pneumo.fit.rig.rig_record import Points, Run, halves
from pneumo.physics.cylinder import wetted_area
from pneumo.physics.models import MODELS
from pneumo.physics.valve import choked_flow
from pneumo.simulation.gas_network import Link, Node, full_order_lane, law, replay

ADIABATIC = "full order, adiabatic"
FULL = {  # full order by its wall: exponents of A_q / A_q0 and of PT / (P_0 T_0)
    ADIABATIC: (0.0, 0.0),
    "full order": (0.0, 0.0),
    "full order, eq (7)": (1.0, 0.5),
}
RIG_MODELS = (*MODELS, *FULL)
P_SCALE, T_SCALE = 1e3, 1.0  # Pa and K, by which residuals are divided
FAR = 1e3  # residual where there is no replay
MOST_EVALUATIONS = 80
TOLERANCE = 1e-8  # relative change of the sum of squares, or of the parameters, that ends a fit
PART_OF_RUNS = 0.25  # that are fitted
PART_OF_POINTS = 0.6  # of a run with many, in time
FEW_POINTS = 200
ISO_RHO, ISO_T = 1.185, 293.15  # kg/m^3 and K, the reference of a sonic conductance
STARTS = (0.5, 0.15)  # positions between the two ends, on a logarithmic scale where both are positive
TINY = 1e-100  # a derivative that is zero
FLAT = 1e-7  # size of a direction over the largest, below which the record does not determine it
OFF_END = 0.01  # distance from the ends, of the same kind, at which a search begins
ON_END = 1e-3  # of the distance between its ends, within which a parameter is on one of them
HALF_WIDTH = 1.96  # standard deviations of a 95 per cent interval
POSSIBLE_HOSE = {"hose_volume": (0.2e-6, 1e-4), "hose_C": (0.05e-8, 10e-8)}  # 16 mm to 8 m of 4 mm
HOSE_HELPS = 0.7  # error with a hose over that without, below which one is there
WALL = ("k_0", "store_k", "store_c", "store_back", "hose_k", "k_0_B")


class RigEstimate(NamedTuple):
    """A model fitted to some runs."""

    values: dict[str, float]  # of all quantities of the rig, SI units
    fitted: tuple[str, ...]  # names of those that were fitted
    low: dict[str, float]  # ends of 95 per cent intervals of those; NaN where the value is on a bound
    high: dict[str, float]
    rms: float  # Pa, over all points of the pressure that were fitted


def fitted_names(rig: Rig, model: str) -> list[str]:
    """Quantities of a rig that are fitted with a model."""
    names = [name for name, (low, high) in rig.ends.items() if low < high]
    row = MODELS.get(model)
    if row is None or not row.has_n:
        names = [name for name in names if name != "n"]
    if (row is not None and row.wall == "none") or model == ADIABATIC:
        names = [name for name in names if name not in WALL]
    return [name for name in names if name != "T_lag" or row is None]


def opening(t: np.ndarray, begin: float, lasts: float) -> np.ndarray:
    """Fraction by which a valve has opened that begins at a time and takes another, s."""
    return np.clip((t - begin) / lasts, 0.0, 1.0)


class RigReplay(NamedTuple):
    """A run as a model replays it, at the samples of the run's inputs."""

    P: Points  # Pa, at the sensor
    T: Points  # K, of the chamber's gas, as the thermometer reads it
    T_store: Points  # K, of the heat store beside the gas
    P_B: Points | None  # Pa, at the sensor of the other chamber

    @property
    def pressures(self) -> tuple[Points, ...]:
        """Pressures by chamber."""
        return (self.P,) if self.P_B is None else (self.P, self.P_B)


class Network(NamedTuple):
    """Arguments of `replay` for a run of a rig: nodes are chambers, their lines, silencers, and the supply.

    Volumes are linear in the position, areas in the valve's opening.
    """

    nodes: list[Node]
    links: list[Link]
    surroundings: list[tuple[float, float]]  # atmosphere, then the source
    volumes: np.ndarray  # m^3, by (node, sample)
    areas: np.ndarray  # m^2, by (link, sample)
    area_ratios: np.ndarray  # by (node, sample)
    chambers: int
    sensor: int  # node of the first chamber's pressure; those of the others follow


def network(rig: Rig, model: str, values: Mapping[str, float], run: Run) -> Network:
    """Network of a rig with the volumes and areas of a run."""
    v, gas = values, rig.gas
    t, T_amb, P_atm = run.t, v["T_surroundings"], v["P_surroundings"]
    C = ISO_RHO / choked_flow(1.0, 1.0, ISO_T, gas)  # m^2 for 1 m^3/(s Pa)
    row = MODELS.get(model)
    if row is not None:
        lane, full = law(row, v["n"], gas.gamma)
    else:
        lane, full = full_order_lane(gas.gamma, *FULL[model]), True
    warm = model != ADIABATIC
    sides = ("", "_B") if rig.has("dead_volume_B") else ("",)
    has_valve = rig.has("valve_C_in")
    supplied = has_valve and rig.has("supply_volume")
    lines = len(sides) * rig.has("hose_volume")
    silencers = len(sides) * rig.has("silencer_volume")
    count = len(sides) + lines + silencers + supplied
    atmosphere, source = count, count + 1  # the surroundings follow the nodes
    supply = count - 1 if supplied else source
    surroundings = [(P_atm, T_amb), (v["P_s"], T_amb)] if has_valve else [(P_atm, T_amb)]

    def of(name: str, side: str) -> float:
        """A quantity of a chamber; of B what is not named is as of A."""
        return v.get(name + side, v[name])

    nodes, volumes, ratios, links, areas = ([] for _ in range(5))
    hoses, hose_volumes = list[Node](), list[np.ndarray]()
    is_open = np.zeros_like(t)
    if has_valve:
        is_open = opening(t, run.on + v["valve_opening_delay"], v["valve_opening"])
        is_open = is_open - opening(t, run.off + v["valve_closing_delay"], v["valve_closing"])
        is_open = np.clip(is_open, 0.0, 1.0)
    for number, side in enumerate(sides):
        P_start = v["P_start"] if not side else v.get("P_start_B", v["P_s"])
        T_start = of("T_start", side)
        walls = [of("k_0", side), *(v[name] for name in WALL[1:4])]
        chamber = Node(lane, full, P_start, T_start, P_start, T_start, T_amb, *(k * warm for k in walls))
        nodes.append(chamber)
        ratio = np.ones_like(t)
        if rig.has("volume"):
            volume = np.full_like(t, v["volume"])
        else:
            x = run.travel - run.x if side else run.x
            volume = of("dead_volume", side) + np.pi / 4 * (v["bore"] ** 2 - of("rod", side) ** 2) * x
            area = wetted_area(volume, np.array(v["bore"]))
            ratio = area / area[0]
        volumes.append(volume)
        ratios.append(ratio)
        port = number  # node at the valve
        if lines:
            port = len(sides) + number
            hoses.append(chamber._replace(k_0=v["hose_k"] * warm, k_store=0.0, c_store=0.0, k_back=0.0))
            hose_volumes.append(np.full_like(t, of("hose_volume", side)))
            links.append(Link(port, number, v.get("hose_b", np.nan), v["hose_out_over_in"]))
            areas.append(np.full_like(t, C * of("hose_C", side)))
        if rig.has("orifice"):
            links.append(Link(port, atmosphere, v.get("orifice_b", np.nan)))
            areas.append(np.full_like(t, v["C_d"] * np.pi / 4 * v["orifice"] ** 2))
        elif has_valve:
            to_supply = 1.0 - is_open if side else is_open
            b = v.get("valve_b", np.nan)
            exhaust = len(sides) + lines + number if silencers else atmosphere
            links += [Link(supply, port, b), Link(port, exhaust, v.get("valve_b_out", b))]
            areas += [C * of("valve_C_in", side) * to_supply, C * of("valve_C_out", side) * (1.0 - to_supply)]
    nodes += hoses
    volumes += hose_volumes
    for number in range(silencers):
        nodes.append(Node(lane=lane, full=full, P=P_atm, T=T_amb, P_0=P_atm, T_0=T_amb, T_wall=T_amb))
        volumes.append(np.full_like(t, v["silencer_volume"]))
        links.append(Link(len(sides) + lines + number, atmosphere, v.get("silencer_b", np.nan)))
        areas.append(np.full_like(t, C * v["silencer_C"]))
    if supplied:
        nodes.append(
            Node(
                lane=full_order_lane(gas.gamma),
                full=True,
                P=v["P_s"],
                T=T_amb,
                P_0=v["P_s"],
                T_0=T_amb,
                T_wall=T_amb,
            )
        )
        volumes.append(np.full_like(t, v["supply_volume"]))
        links.append(Link(source, supply, v.get("regulator_b", np.nan)))
        areas.append(np.full_like(t, C * v["regulator_C"]))
    ratios += [np.ones_like(t)] * (count - len(sides))
    sensor = len(sides) if lines and rig.sensor == "valve" else 0
    arrays = np.array(volumes), np.array(areas), np.array(ratios)
    return Network(nodes, links, surroundings, *arrays, len(sides), sensor)


def replay_run(rig: Rig, model: str, values: Mapping[str, float], run: Run) -> RigReplay:
    """Pressures at the sensors and temperatures in the chamber."""
    of_rig = network(rig, model, values, run)
    nodes, links, surroundings, volumes, areas, ratios, chambers, sensor = of_rig
    states = replay(nodes, links, surroundings, volumes, areas, rig.gas, run.h, ratios)
    t = run.t
    return RigReplay(
        Points(t, states.P[sensor]),
        Points(t, lagged(states.T[0], values["T_lag"], run.h)),
        Points(t, states.T_store[0]),
        Points(t, states.P[sensor + 1]) if chambers > 1 else None,
    )


def lagged(T: np.ndarray, lag: float, h: float) -> np.ndarray:
    """Reading of a thermometer with a lag of first order, s; T is linear between samples."""
    if lag == 0:
        return T
    shrink = np.exp(-h / lag)
    reading = T.copy()
    for k in range(1, len(T)):
        slope = (T[k] - T[k - 1]) / h
        reading[k] = T[k] - slope * lag + (reading[k - 1] - T[k - 1] + slope * lag) * shrink
    return reading


def errors(replayed: Points, measured: Points) -> np.ndarray:
    """Replayed minus measured values at the measured times."""
    return np.interp(measured.t, replayed.t, replayed.values) - measured.values


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def run_errors(rig: Rig, model: str, values: Mapping[str, float], run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Errors of pressure, Pa, and temperature, K, at the points of a run; empty where none was measured.

    Those of both chambers follow each other.
    """
    replayed = replay_run(rig, model, values, run)
    P = [errors(*pair) for pair in zip(replayed.pressures, run.pressures, strict=True)]
    return np.concatenate(P), errors(replayed.T, run.T) if run.T is not None else np.empty(0)


class RigProblem(NamedTuple):
    """Least squares of a model; parameters run from 0 to 1 between their ends."""

    rig: Rig
    model: str
    runs: Sequence[Run]
    names: tuple[str, ...]
    temperature: bool = False  # whether measured temperatures are fitted too

    def values(self, theta: np.ndarray) -> dict[str, float]:
        """All quantities, SI units."""
        ends = self.rig.ends
        fitted = {
            name: ends[name][0] + float(part) * (ends[name][1] - ends[name][0])
            for name, part in zip(self.names, theta, strict=True)
        }
        return {name: low for name, (low, _) in ends.items()} | fitted

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """Errors of all points over their scales."""
        parts, values = list[np.ndarray](), self.values(theta)
        for run in self.runs:
            P, T = run_errors(self.rig, self.model, values, run)
            parts += [P / P_SCALE, T / T_SCALE] if self.temperature else [P / P_SCALE]
        all_errors = np.concatenate(parts)
        return np.where(np.isfinite(all_errors), all_errors, FAR)

    def start(self, position: float) -> np.ndarray:
        """Parameters at a position between their ends."""
        theta = list[float]()
        for name in self.names:
            low, high = self.rig.ends[name]
            at = low * (high / low) ** position if low > 0 else low + position * (high - low)
            theta.append((at - low) / (high - low))
        return np.array(theta)

    def solve(self, near: Mapping[str, float] | None = None) -> OptimizeResult:
        """Lowest sum of squares from several starts, one of them at the values of another fit if given."""
        starts = [self.start(position) for position in STARTS]
        if near is not None:
            ends = self.rig.ends
            parts = [(near[name] - ends[name][0]) / (ends[name][1] - ends[name][0]) for name in self.names]
            starts = [np.clip(parts, OFF_END, 1 - OFF_END), starts[0]]
        return min((self._solved(start) for start in starts), key=lambda optimum: optimum.cost)

    def _solved(self, theta: np.ndarray) -> OptimizeResult:
        return least_squares(
            self.residual,
            theta,
            bounds=(0.0, 1.0),
            x_scale="jac",
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            max_nfev=MOST_EVALUATIONS,
        )


def fit_rig(
    rig: Rig,
    model: str,
    runs: Sequence[Run],
    temperature: bool = False,
    near: Mapping[str, float] | None = None,
) -> RigEstimate:
    """Estimate of a model from some runs; `near` are values from which the search begins.

    Intervals are those of least squares with coloured residuals: as if there were as many points as the
    residual has correlation times. They say nothing of an error of the model itself.
    """
    problem = RigProblem(rig, model, runs, tuple(fitted_names(rig, model)), temperature)
    if not problem.names:
        theta, residual, J = np.empty(0), problem.residual(np.empty(0)), np.empty((0, 0))
    else:
        optimum = problem.solve(near)
        theta, residual, J = optimum.x, optimum.fun, optimum.jac
    values, low, high = problem.values(theta), dict[str, float](), dict[str, float]()
    inside = (theta > ON_END) & (theta < 1 - ON_END)
    freedom = max(1, len(residual) / correlation_time(residual) - inside.sum())
    deviations = np.full(len(theta), np.nan)
    if inside.any():
        scale = np.maximum(np.linalg.norm(J[:, inside], axis=0), TINY)
        _, sizes, axes = np.linalg.svd(J[:, inside] / scale, full_matrices=False)
        variances = ((axes.T / np.maximum(sizes, FLAT * sizes[0])) ** 2).sum(axis=1) / scale**2
        deviations[inside] = np.sqrt(variances * (residual @ residual) / freedom)
    for name, deviation in zip(problem.names, deviations, strict=True):
        half = HALF_WIDTH * deviation * (rig.ends[name][1] - rig.ends[name][0])
        low[name], high[name] = values[name] - half, values[name] + half
    P = np.concatenate([run_errors(rig, model, values, run)[0] for run in runs])
    return RigEstimate(values, problem.names, low, high, rms(P))


def correlation_time(residual: np.ndarray) -> float:
    """Samples within which residuals repeat each other: 1 for white noise."""
    centred = residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2
    correlation = np.fft.irfft(spectrum)[: len(centred) // 2]
    if correlation.size == 0 or correlation[0] <= 0:
        return 1.0
    correlation = correlation / correlation[0]
    negative = np.flatnonzero(correlation < 0)
    return float(max(1.0, 2 * correlation[: negative[0] if len(negative) else None].sum() - 1))


def rig_warnings(rig: Rig, runs: Sequence[Run], lowest: float) -> list[str]:
    """Reasons not to believe a fit, a sentence each: a line behind the valve that the rig does not have.

    From the runs that were fitted and the lowest error of a model there, Pa.
    """
    if not rig.has("valve_C_in") or rig.has("hose_volume"):
        return []
    line = fit_rig(rig.changed(**POSSIBLE_HOSE), "full order", runs)
    if line.rms > HOSE_HELPS * lowest:
        return []
    words = " and ".join(map(key, POSSIBLE_HOSE))
    volume, C = (line.values[name] / factor(name) for name in POSSIBLE_HOSE)
    return [
        f"a hose of {volume:.3g} mL and {C:.3g} dm3/(s bar) between valve and chamber would bring the error"
        f" from {lowest / 1e3:.3g} to {line.rms / 1e3:.3g} kPa: add {words}"
    ]


class Judged(NamedTuple):
    """A fitted model, and its errors on points that its fit did not use."""

    estimate: RigEstimate
    held_out: float  # Pa
    T: float  # K, over all temperatures; NaN where none was measured


def fitted_runs(runs: Sequence[Run]) -> Sequence[Run]:
    """Runs, or points of a single run, that are fitted."""
    if len(runs) > 1:
        return runs[: max(1, round(PART_OF_RUNS * len(runs)))]
    t = runs[0].P.t
    last = t[0] + (PART_OF_POINTS * np.ptp(t) if len(t) > FEW_POINTS else np.inf)
    return [runs[0].within(-np.inf, last)]


def judged(
    rig: Rig,
    model: str,
    runs: Sequence[Run],
    temperature: bool = False,
    near: Mapping[str, float] | None = None,
) -> Judged:
    """Estimate of a model, and its error on points held out.

    Of several runs the first part is fitted and the others are held out, of one with many points the first
    part of these. Of a few points every second is held out, both ways; the estimate itself is from all.
    """
    left = list[np.ndarray]()
    used = fitted_runs(runs)
    estimate = fit_rig(rig, model, used, temperature, near)
    left += [run_errors(rig, model, estimate.values, run)[0] for run in runs[len(used) :]]
    if len(runs) == 1 and len(used[0].P.t) < len(runs[0].P.t):
        later = runs[0].within(used[0].P.t[-1], np.inf)
        left.append(run_errors(rig, model, estimate.values, later)[0])
    elif len(runs) == 1:
        run = runs[0]
        for chosen, others in (halves(run.P), halves(run.P)[::-1]):
            part = fit_rig(rig, model, [run._replace(P=chosen)], temperature, estimate.values)
            left.append(run_errors(rig, model, part.values, run._replace(P=others))[0])
    T = np.concatenate([run_errors(rig, model, estimate.values, run)[1] for run in runs])
    return Judged(estimate, rms(np.concatenate(left)), rms(T) if len(T) else np.nan)


def judged_models(
    rig: Rig,
    runs: Sequence[Run],
    models: Sequence[str] = RIG_MODELS,
    temperature: bool = False,
    progress: Callable[[str], None] = lambda _text: None,
) -> xr.Dataset:
    """Several models fitted to a rig's runs.

    Errors `fitted` and `held_out`, Pa, and `T_error`, K, by model; `estimate`, `low` and `high` by (model,
    parameter) in the unit that the parameter's name ends with, NaN where a model does not fit it, or where
    an end is open because the value is on a bound.
    """
    results = dict[str, Judged]()
    for model in models:
        best = min((r.estimate for r in results.values()), key=lambda e: e.rms, default=None)
        results[model] = judged(rig, model, runs, temperature, best and best.values)
        held_out = results[model].held_out
        progress(
            f"{model}: {results[model].estimate.rms / 1e3:.2f} kPa fitted, {held_out / 1e3:.2f} held out"
        )
    names = [name for name, (low, high) in rig.ends.items() if low < high]
    estimates = [result.estimate for result in results.values()]

    def by_parameter(field: str) -> tuple[tuple[str, str], list[list[float]]]:
        rows = [
            [getattr(e, field)[name] / factor(name) if name in e.fitted else np.nan for name in names]
            for e in estimates
        ]
        return ("model", "parameter"), rows

    Pa = {"units": "Pa"}
    return xr.Dataset(
        {
            "fitted": ("model", [e.rms for e in estimates], Pa),
            "held_out": ("model", [result.held_out for result in results.values()], Pa),
            "T_error": ("model", [result.T for result in results.values()], {"units": "K"}),
            "estimate": by_parameter("values"),
            "low": by_parameter("low"),
            "high": by_parameter("high"),
        },
        {"model": list(models), "parameter": [key(name) for name in names]},
    )


def values_of(result: xr.Dataset, rig: Rig, model: str) -> dict[str, float]:
    """All quantities of a rig with the estimates of a model in a result of `judged_models`, SI units."""
    values = {name: low for name, (low, _) in rig.ends.items()}
    for name in values:
        if key(name) in result["parameter"]:
            estimate = result["estimate"].sel(model=model, parameter=key(name)).item()
            values[name] = estimate * factor(name) if np.isfinite(estimate) else values[name]
    return values
