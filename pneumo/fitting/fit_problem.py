"""Replayed pressures of a model as a function of the parameters that are fitted.

A replay starts from first pressures, which are fitted too, and then reads only position and command (or mass
flows): measured minus replayed pressure is the model's error and the noise (output error). Each chamber has
a dead volume, since hoses differ.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.configuration.priors import Accuracy
from pneumo.errors import InputError
from pneumo.fitting.least_squares import LeastSquares, Scale, Solution, solve
from pneumo.fitting.on_signals import as_logged, leaked_volume, offsets, supply_at_valve, with_leak
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import StageSignals
from pneumo.fitting.valve_signal import behind_valve
from pneumo.physics.cylinder import heat_area
from pneumo.physics.models import Lane, Model, lane, lane_array
from pneumo.quantities.applied import with_values
from pneumo.quantities.table import (
    ALSO,
    CONFIGURED,
    CURVE,
    FULL_ORDER,
    PARAMETERS,
    STARTS,
    STARTS_OF_ONE,
    VALVE,
    VALVE_CURVE,
    start_name,
)
from pneumo.simulation.fitted_pressures import Inputs, pressures_of_sets, pressures_on_flows

SLOPE_STEP = 1e-4  # of finite differences, on the scale of the search
TOLERANCE, TRIALS = 1e-5, 40  # of a search
OFF = 10.0  # residual, in units of P_s, where a replay left the positive numbers
ON_BOUND = 0.01  # of the distance between the bounds
LIMITS = 1.96  # limits of a 95 per cent interval, in standard deviations
# Parameters that all sets with the same inputs of a replay have in common.
OWN = ("T_in", "exhaust", "offset_A", "offset_B", "skew", "filter")
SHARED = tuple(name for name in (*VALVE, *ALSO) if name not in OWN)
LEAKS = {"piston_leak", "valve_leak"}


class Prior(NamedTuple):
    """Prior knowledge of a parameter."""

    centre: float  # SI units
    deviation: float  # standard deviation, on the scale of the search
    weight: float  # of the squared distance from it, where a residual of P_s counts 1


def configured_value(plant: Plant, name: str) -> float:
    """Value of a parameter at which a search starts: that of the plant, or of the table."""
    start = PARAMETERS[name].start
    return attrgetter(start)(plant) if isinstance(start, str) else start


def inapplicable(
    name: str, plant: Plant, signals: StageSignals | Measurement, record: str = "the record"
) -> str:
    """Why one of `CHOICES` cannot be fitted to a record; empty if it can."""
    column = signals.P_s is not None
    absolute = "P_A" not in signals.zeros
    reasons = {
        "P_s": f"{record} has the supply pressure as a column" * column,
        "sag": f"{record} has the supply pressure as a column, which shows its sag" * column,
        "offset_P_s": f"{record} has no column P_s" * (not column),
        "P_atm": f"{record} has absolute pressures, which do not show it" * absolute,
        "b": "the valve's flow is that of eq (1); give it by a section valve" * (not plant.gas.elliptic),
        "linearity": "the configuration has no section valve, or one with a curve"
        * (not plant.gas.elliptic or bool(plant.valve.paths.knots)),
        VALVE_CURVE: "the configuration has a curve; give C in its place" * bool(plant.valve.paths.knots),
    }
    return reasons.get(name, "")


def priors(
    plant: Plant, signals: StageSignals, known: Accuracy, noise: float, also: tuple[str, ...] = ()
) -> dict[str, Prior]:
    """Priors by name, for the `CONFIGURED` parameters that the full order fits, beside those in `also`.

    The weight of a prior is (noise / (P_s deviation))^2, with the `noise` of the pressure sensors, Pa.
    """
    result: dict[str, Prior] = {}
    for name in CONFIGURED:
        if inapplicable(name, plant, signals) or (name == "linearity" and {*CURVE} <= {*also}):
            continue
        configured = configured_value(plant, name)
        deviation = known[name] / LIMITS
        if deviation == 0:  # known exactly
            continue
        weight = (noise / plant.conditions.P_s / deviation) ** 2
        result[name] = Prior(configured, deviation, weight)
    return result


@dataclass(frozen=True)
class Problem(LeastSquares):
    """A model to be fitted to a measurement."""

    model: Model
    plant: Plant  # as configured; fitted parameters replace its k_0, k_xu and V_d
    signals: StageSignals
    fixed: Mapping[str, float]
    also: tuple[str, ...] = ()  # of `ALSO`, fitted without prior knowledge; of the full order only
    priors: Mapping[str, Prior] = field(default_factory=dict)  # of `CONFIGURED` parameters, fitted too

    @cached_property
    def scales(self) -> dict[str, Scale]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Scales of the fitted parameters."""
        full = self.model.name == FULL_ORDER
        fitted = {"index": self.model.has_n, "wall": self.model.wall != "none", "valve": full}
        fitted |= {"flow": self.signals.flow is None, "first temperature": full}
        added = {*self.also, *self.priors}
        records = range(len(self.signals.begins))
        used_starts = {start_name(name, i) for name in STARTS_OF_ONE for i in records}
        without = {*self.fixed, *STARTS} - used_starts  # `STARTS` has those of `MOST_RECORDS` records
        if added >= {*CURVE}:
            without.add("linearity")  # the curve has it
        result: dict[str, Scale] = {}
        for name, row in PARAMETERS.items():
            if name in without or not (name in added if name in ALSO else fitted.get(row.group, True)):
                continue
            size = attrgetter(row.times)(self.plant) if "." in row.times else 1.0
            if row.times == "A_q0":
                size = heat_area(0.0, self.plant.cylinder)
            result[name] = Scale(row.low * size, row.high * size, row.logarithmic)
        return result

    def prior_terms(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances from the priors' centres, and weights of their squares: zero for those in `also`."""
        known = {name: prior for name, prior in self.priors.items() if name not in self.also}
        centres = [self.scales[n].inner(known[n].centre) if n in known else 0.0 for n in self.names]
        return theta - centres, np.array([known[n].weight if n in known else 0.0 for n in self.names])

    def around(self, theta: np.ndarray) -> tuple[np.ndarray, Callable[[], np.ndarray]]:
        """Residual in units of P_s, and a function that returns the derivatives of the replayed pressures.

        As of any `LeastSquares`, but one replay has all sets of parameters, and varies the same parameter of
        both chambers. Derivatives are zero where there is no replay.
        """
        low, high = self.bounds()
        steps = np.where(theta - low > high - theta, -SLOPE_STEP, SLOPE_STEP)
        stems = [name.removesuffix("_A").removesuffix("_B") for name in self.names]
        varied = np.array([[other == stem for other in stems] for stem in dict.fromkeys(stems)])
        P = replayed_pressures(self, np.vstack([theta, theta + steps * varied]))
        residual = self.signals.residual(P[0]) / self.plant.conditions.P_s

        def derivatives() -> np.ndarray:
            here, *others = P / self.plant.conditions.P_s
            slopes = (np.array(others) - here)[varied.argmax(axis=0)] / steps[:, None, None]
            # No pressure of A depends on a parameter of B, and conversely.
            of_chamber = np.array([[not name.endswith(f"_{other}") for name in self.names] for other in "BA"])
            used = of_chamber[:, None] & self.signals.used[..., None]
            result = np.multiply(np.moveaxis(slopes, 0, -1), used, order="C")
            return np.nan_to_num(result, copy=False, nan=0.0, posinf=0.0, neginf=0.0)

        return np.where(np.isfinite(residual), residual, OFF), derivatives

    def at_bound(self, theta: np.ndarray) -> tuple[str, ...]:
        """Names of the parameters on a bound of the search; a lag, dead band or leak of zero is normal."""
        low, high = self.bounds()
        part = (theta - low) / (high - low)
        from_zero = np.array([scale.low == 0 for scale in self.scales.values()])
        on_bound = (part >= 1 - ON_BOUND) | ((part <= ON_BOUND) & ~from_zero)
        return tuple(np.array(self.names)[on_bound].tolist())

    def guess(self) -> np.ndarray:
        """Start of the search: the configured values and the first measured pressures."""
        samples = max(1, round(2e-3 / self.signals.period))
        values = {"k_0": default_conductance(self.plant.cylinder).k_0}
        for i, (first, _) in enumerate(self.signals.pieces):
            P = self.signals.P[:, first : first + samples].mean(axis=1)
            values |= {start_name(f"start_{c}", i): P[side] for side, c in enumerate("AB")}
        for name in (name for name in self.names if name not in values):
            values[name] = configured_value(self.plant, name)
        low, high = self.bounds()
        return np.clip(self.inner(values), low + SLOPE_STEP, high - SLOPE_STEP)


def replayed_pressures(problem: Problem, thetas: np.ndarray) -> np.ndarray:
    """Pressures of a model with several sets of parameters, Pa, shape (set, chamber, samples).

    They are NaN after a pressure was not positive. `thetas`, shape (set, parameter), is on the scale of the
    search. Sets that differ only in n, k_xu, k_0, dead volumes, T_in, exhaust, first pressures or first
    temperatures have the same signals; those that differ in `SHARED` parameters have others.
    """
    signals, values = problem.signals, [problem.values(theta) for theta in thetas]
    parts: list[np.ndarray] = []
    for i, (first, last) in enumerate(signals.pieces):
        own = [value | {n: value.get(start_name(n, i), np.nan) for n in STARTS_OF_ONE} for value in values]
        piece = replace(problem, signals=signals.part(first, last))
        parts.append(_pressures_of_record(piece, own))
    return np.concatenate(parts, axis=-1)


def _pressures_of_record(problem: Problem, values: list[dict[str, float]]) -> np.ndarray:
    """Pressures of one record, as from `replayed_pressures`, for sets of parameters in SI units."""
    signals, motion = problem.signals, problem.signals.motion
    lanes = lane_array([_lane(problem, value) for value in values])
    V_d, start = (np.array([[v[f"{key}_A"], v[f"{key}_B"]] for v in values]) for key in ("V_d", "start"))
    if signals.flow is not None:
        flows = signals.flow, lanes, V_d, problem.plant._replace(k_0=1.0), signals.h, signals.stride, start
        return pressures_on_flows(motion, *flows)
    sets = lanes, V_d, signals.h, signals.stride, start
    if problem.model.name != FULL_ORDER:
        only = Inputs(signals.u, motion, problem.plant._replace(k_0=1.0), signals.P_s)
        return pressures_of_sets([only], np.zeros(len(values), int), *sets)
    start_T = np.array([[v["start_T_A"], v["start_T_B"]] for v in values])
    c, ratio = problem.plant.conditions, problem.plant.valve.exhaust
    T_in = np.array([value.get("T_in", c.T_in) for value in values])
    exhaust = np.array([value.get("exhaust", ratio) for value in values])
    inputs: list[Inputs] = []
    inputs_of = np.zeros((2, len(values)), dtype=int)  # index in `inputs`, by chamber
    of_shared: dict[tuple[float, ...], tuple[int, int]] = {}
    for i, value in enumerate(values):
        shared = tuple(value.get(name, np.nan) for name in SHARED)
        if shared not in of_shared:
            of_chambers = _inputs_of_chambers(problem, value)
            inputs += of_chambers
            of_shared[shared] = len(inputs) - len(of_chambers), len(inputs) - 1
        inputs_of[:, i] = of_shared[shared]
    P = pressures_of_sets(inputs, inputs_of[0], *sets, start_T, T_in, exhaust)
    if np.any(inputs_of[1] != inputs_of[0]):
        P[:, 1] = pressures_of_sets(inputs, inputs_of[1], *sets, start_T, T_in, exhaust)[:, 1]
    logged = [as_logged(one, signals.period, value) for one, value in zip(P, values, strict=True)]
    return np.array(logged) + np.array([offsets(signals, value) for value in values])


def _inputs_of_chambers(problem: Problem, value: dict[str, float]) -> list[Inputs]:
    """Signals and plant of the full order with parameters in SI units: those of A and B, or of both."""
    signals = problem.signals
    plant = with_causes(problem.plant, value)._replace(k_0=1.0)
    u = behind_valve(signals.u, signals.h, value, signals.largest)
    of_A = of_B = Inputs(u, signals.motion, plant, supply_at_valve(signals, u, plant, value))
    if LEAKS & value.keys():
        leaked = leaked_volume(signals, plant, value)
        moved = [with_leak(signals.motion, plant, leaked, side) for side in range(2)]
        of_A, of_B = (of_A._replace(motion=motion) for motion in moved)
    if "C_B" in value:
        valve = plant.valve._replace(k_xu=plant.valve.k_xu * value["C_B"])
        of_B = of_B._replace(plant=plant._replace(valve=valve))
    return [of_A] if of_B is of_A else [of_A, of_B]


def _lane(problem: Problem, value: dict[str, float]) -> Lane:
    """Lane of the model with n, k_xu as a multiple of the plant's, and k_0 as a multiple of 1 W/K."""
    row, k_xu = lane(problem.model, value.get("n", 1.0), problem.plant.gas.gamma), problem.plant.valve.k_xu
    return row._replace(
        flow_scale=value.get("k_xu", k_xu) / k_xu,  # 1 where flows were measured
        wall_scale=row.wall_scale * value.get("k_0", 0.0),
    )


def with_causes(plant: Plant, values: Mapping[str, float]) -> Plant:
    """Plant with the parameters of `ALSO` that were fitted in place of the configured values."""
    return with_values(plant, {name: values[name] for name in ALSO if name in values})


def check_valve(plant: Plant) -> None:
    """Raise an `InputError` if the replay of a fit does not model the valve."""
    valve = plant.valve
    if valve.leak or valve.laminar or not valve.paths.one_at_a_time:
        raise InputError(
            f"valve: leak = {valve.leak:.4g} m2, laminar = {valve.laminar:.4g}: must both be 0 for a fit, and"
            " all paths have one b and open one at a time: leave out leak_dm3_per_sbar, exhaust_b and a curve"
            " that opens two paths at once, or measure the flows m_A and m_B"
        )


def fit(
    problem: Problem, tolerance: float = TOLERANCE, most: int = TRIALS, start: np.ndarray | None = None
) -> Solution:
    """Fit a model by least squares, from `start` on the scale of the search, or from `Problem.guess`.

    `InputError` if no flows were measured and the replay of a fit does not model the valve.
    """
    if problem.signals.flow is None:
        check_valve(problem.plant)
    return solve(problem, problem.guess() if start is None else start, tolerance=tolerance, most=most)


def settled(problem: Problem, found: Solution) -> Solution:
    """Minimum near a solution, where the search may have stopped early at a kink.

    The sum of squares has a kink wherever the dead time is a multiple of the step, as zero is. The search
    goes on with the dead time held there, and then with all parameters.
    """
    if "dead_time" not in problem.names:
        return found
    i, h = problem.names.index("dead_time"), problem.signals.h
    start = found.theta.copy()
    start[i] = np.clip(round(start[i] / h) * h, *problem.bounds()[:, i])
    held = solve(problem, start, fixed=i)
    return min(found, solve(problem, held.theta), key=lambda solution: solution.squares)
