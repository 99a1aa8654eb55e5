"""Parameters of a fit, and the pressures of a reduced model as a function of them.

A replay starts once, from a pressure that is fitted too, and then sees position and command (or mass flows)
only: measured minus replayed pressure is the model's error and the noise (output error). Each chamber has
its own dead volume, as the hoses make it.
"""

from typing import NamedTuple

import numpy as np

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.fit.stage_signals import StageSignals
from pneumo.fit.valve_signal import behind_valve
from pneumo.physics.cylinder import heat_area
from pneumo.physics.models import Lane, Model, lane, lane_array
from pneumo.simulation.fitted_pressures import pressures_of_sets, pressures_on_flows

SLOPE_STEP = 1e-4  # of finite differences, on the scale of the search


class Parameter(NamedTuple):
    """A parameter that can be fitted."""

    unit: str
    low: float  # bounds in SI units; where `relative`, multiples of `Problem.reference`
    high: float
    relative: bool = False
    logarithmic: bool = True  # search and interval are on a logarithmic scale

    def inner(self, value: float) -> float:
        """Logarithm of a value in SI units, or the value itself, as the parameter is fitted."""
        return float(np.log(value)) if self.logarithmic else float(value)

    def outer(self, value: float) -> float:
        """Value in SI units, from what `inner` returns."""
        return float(np.exp(value)) if self.logarithmic else float(value)


PARAMETERS = {
    "n": Parameter("1", 0.8, 1.8, logarithmic=False),
    "k_0": Parameter("W K-1", 0.3, 1000.0, relative=True),  # W/(m^2 K) times A_q0
    "k_xu": Parameter("m2 V-1", 0.05, 20.0, relative=True),
    "V_d_A": Parameter("m3", 0.02, 50.0, relative=True),
    "V_d_B": Parameter("m3", 0.02, 50.0, relative=True),
    "start_A": Parameter("Pa", 0.1, 3.0, relative=True),  # of P_0
    "start_B": Parameter("Pa", 0.1, 3.0, relative=True),
    # Of the full order only; models take the first three of them from its fit.
    "lag": Parameter("s", 0.0, 0.05, logarithmic=False),
    "dead_time": Parameter("s", -0.02, 0.05, logarithmic=False),
    "null": Parameter("V", -0.1, 0.1, relative=True, logarithmic=False),  # of u_max
    "start_T_A": Parameter("K", 0.7, 1.4, relative=True),  # of T_0
    "start_T_B": Parameter("K", 0.7, 1.4, relative=True),
    # Fitted only where `Problem.free` names them: what may be wrong where nothing else explains a record.
    "P_s": Parameter("Pa", 0.5, 2.0, relative=True),
    "exhaust": Parameter("1", 0.2, 5.0),
    "A_B": Parameter("m2", 0.5, 2.0, relative=True),
    "offset_A": Parameter("Pa", -1e5, 1e5, logarithmic=False),
    "offset_B": Parameter("Pa", -1e5, 1e5, logarithmic=False),
}
CAUSES = ("P_s", "exhaust", "A_B", "offset_A", "offset_B")
OF_VALVE = ("lag", "dead_time", "null")
SHARED = (*OF_VALVE, "P_s", "exhaust", "A_B")  # by all sets of parameters of one replay
# The full-order chambers, as a row of the table of models; their temperature is a state.
FULL = Model("full", "gamma", "gamma", "gamma", "constant", True, "lambda A_q")


def _without_chamber(name: str) -> str:
    return name.removesuffix("_A").removesuffix("_B")


class Problem(NamedTuple):
    """A model to be fitted to a measurement."""

    model: Model
    plant: Plant  # as configured; fitted parameters replace its k_0, k_xu and V_d
    signals: StageSignals
    fixed: dict[str, float]  # parameters that are not fitted, in SI units
    noisy: np.ndarray | None = None  # motions from `with_added_noise`; None for plain least squares
    free: tuple[str, ...] = ()  # of `CAUSES`, fitted too; of the full order only

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fitted parameters."""
        wall, measured = self.model.wall != "none", self.signals.flow is not None
        full = self.model.name == FULL.name
        needed = {"n": self.model.has_n, "k_0": wall, "k_xu": not measured}
        needed |= dict.fromkeys((*OF_VALVE, "start_T_A", "start_T_B"), full)
        needed |= {name: name in self.free for name in CAUSES}
        return tuple(name for name in PARAMETERS if needed.get(name, True) and name not in self.fixed)

    def reference(self, name: str) -> float:
        """Value in SI units of which a parameter's bounds are multiples."""
        p = self.plant
        values = {
            "k_xu": p.valve.k_xu,
            "V_d_A": p.cylinder.V_d_A,
            "V_d_B": p.cylinder.V_d_B,
            "start": p.conditions.P_0,
        }
        values |= {"null": p.valve.u_max, "start_T": p.conditions.T_0}
        values |= {"P_s": p.conditions.P_s, "A_B": p.cylinder.A_B}
        values["k_0"] = heat_area(0.0, p.cylinder)
        key = name if name in values else _without_chamber(name)
        return values[key] if PARAMETERS[name].relative else 1.0

    def bounds(self) -> np.ndarray:
        """Lower and upper bounds on the scale of the search, shape (2, parameter)."""
        rows = [(PARAMETERS[name], self.reference(name)) for name in self.names]
        return np.array([(p.inner(p.low * scale), p.inner(p.high * scale)) for p, scale in rows]).T

    def guess(self) -> np.ndarray:
        """Start of the search: the configured values and the first measured pressures."""
        first = self.signals.P[:, : max(1, round(2e-3 / self.signals.period))].mean(axis=1)
        values = {
            "n": 1.2,
            "k_0": default_conductance(self.plant.cylinder).k_0,
            "start_A": first[0],
            "start_B": first[1],
            "exhaust": self.plant.valve.exhaust,
            **dict.fromkeys((*OF_VALVE, "offset_A", "offset_B"), 0.0),
        }
        inner = [PARAMETERS[k].inner(values.get(k, self.reference(k))) for k in self.names]
        low, high = self.bounds()
        return np.clip(inner, low + SLOPE_STEP, high - SLOPE_STEP)

    def inner(self, values: dict[str, float]) -> np.ndarray:
        """Fitted parameters on the scale of the search, from their values in SI units."""
        return np.array([PARAMETERS[name].inner(values[name]) for name in self.names])

    def values(self, theta: np.ndarray) -> dict[str, float]:
        """Parameters in SI units, fixed ones too, from `theta` on the scale of the search."""
        return self.fixed | {k: PARAMETERS[k].outer(x) for k, x in zip(self.names, theta, strict=True)}


def replayed_pressures(problem: Problem, thetas: np.ndarray, motions: np.ndarray | None = None) -> np.ndarray:
    """Pressures of a model with several sets of parameters, Pa, shape (motion, set, chamber, samples).

    Flow is proportional to k_xu, and wall heat to k_0: both are coefficients of a lane, and lanes of one
    replay have dead volumes and starts of their own. What else differs needs another replay. NaN where a
    replay left the positive numbers. `thetas` has shape (set, parameter), on the scale of the search;
    `motions`, shape (motion, steps, 3, 2), are the measured one where left out.
    """
    signals, values = problem.signals, [problem.values(theta) for theta in thetas]
    motions = signals.motion[None] if motions is None else motions
    lanes = lane_array([_lane(problem, value) for value in values])
    V_d, start = (np.array([[v[f"{key}_A"], v[f"{key}_B"]] for v in values]) for key in ("V_d", "start"))
    rest = signals.h, signals.stride
    if signals.flow is not None:
        own = signals.flow, lanes, V_d, problem.plant._replace(k_0=1.0), *rest, start
        return np.array([pressures_on_flows(motion, *own) for motion in motions])
    if problem.model.name != FULL.name:
        plant = problem.plant._replace(k_0=1.0)
        return pressures_of_sets(signals.u, motions, lanes, V_d, plant, *rest, start, P_s=signals.P_s)
    start_T = np.array([[v["start_T_A"], v["start_T_B"]] for v in values])
    result = np.empty((len(motions), len(values), *signals.P.shape))
    alike: dict[tuple[float, ...], list[int]] = {}
    for i, value in enumerate(values):
        alike.setdefault(tuple(value.get(name, np.nan) for name in SHARED), []).append(i)
    for rows in alike.values():
        value = values[rows[0]]
        plant, u = (
            with_causes(problem.plant, value)._replace(k_0=1.0),
            behind_valve(signals.u, signals.h, value),
        )
        own = lanes[rows], V_d[rows], plant, *rest, start[rows], start_T[rows], signals.P_s
        result[:, rows] = pressures_of_sets(u, motions, *own)
    return result + np.array([offsets(value) for value in values])


def offsets(value: dict[str, float]) -> np.ndarray:
    """Offsets of the pressure sensors that were fitted, Pa, shape (chamber, 1)."""
    return np.array([[value.get(f"offset_{side}", 0.0)] for side in "AB"])


def _lane(problem: Problem, value: dict[str, float]) -> Lane:
    """Lane of the model at the values' n, with their k_xu over the plant's and their k_0 over 1 W/K."""
    row, k_xu = lane(problem.model, value.get("n", 1.0), problem.plant.gas.gamma), problem.plant.valve.k_xu
    return row._replace(
        flow_scale=value.get("k_xu", k_xu) / k_xu,  # 1 where flows were measured
        wall_scale=row.wall_scale * value.get("k_0", 0.0),
    )


def with_causes(plant: Plant, value: dict[str, float]) -> Plant:
    """Plant with the values of `CAUSES` that were fitted."""
    return plant._replace(
        valve=plant.valve._replace(exhaust=value.get("exhaust", plant.valve.exhaust)),
        conditions=plant.conditions._replace(P_s=value.get("P_s", plant.conditions.P_s)),
        cylinder=plant.cylinder._replace(A_B=value.get("A_B", plant.cylinder.A_B)),
    )


def pressure_and_jacobian(problem: Problem, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replayed pressure in units of P_s, shape (motion, chamber, samples), and its derivative.

    On the measured motion first, then on the noisy ones. The derivative, shape (motion, chamber, samples,
    parameter), is by one-sided differences, away from the nearer bound. The pressure is NaN where the replay
    left the positive numbers.
    """
    low, high = problem.bounds()
    steps = np.where(theta - low > high - theta, -SLOPE_STEP, SLOPE_STEP)
    # Parameters of one chamber vary together with the same ones of the other: fewer replays.
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(problem.names):
        groups.setdefault(_without_chamber(name), []).append(i)
    thetas = np.tile(theta, (len(groups) + 1, 1))
    for row, members in zip(thetas[1:], groups.values(), strict=True):
        row[members] += steps[members]
    measured = problem.signals.motion[None]
    motions = measured if problem.noisy is None else np.concatenate([measured, problem.noisy])
    P = replayed_pressures(problem, thetas, motions) / problem.plant.conditions.P_s
    jacobian = np.zeros((len(motions), *problem.signals.P.shape, len(theta)))
    for row, members in enumerate(groups.values(), start=1):
        for i in members:
            side = {"A": slice(0, 1), "B": slice(1, 2)}.get(problem.names[i][-1], slice(0, 2))
            jacobian[:, side, :, i] = (P[:, row, side] - P[:, 0, side]) / steps[i]
    return P[:, 0], np.where(np.isfinite(jacobian), jacobian, 0.0)
