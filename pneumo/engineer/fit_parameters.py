"""Parameters of a fit, and the pressures of a reduced model as a function of them.

A replay starts once, from a pressure that is fitted too, and then sees position and command (or mass flows)
only: measured minus replayed pressure is the model's error and the noise (output error). Each chamber has
its own dead volume, as the hoses make it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pneumo.catalogue import default_conductance
from pneumo.configuration.experiment import Plant
from pneumo.engineer.stage_signals import StageSignals
from pneumo.engineer.valve_signal import valve_signal
from pneumo.physics.cylinder import heat_area
from pneumo.physics.models import WALL_LAWS, Model, lane, lane_array
from pneumo.simulation.chambers_on_inputs import full_order_chamber
from pneumo.simulation.given_inputs import pressures_on_flows, pressures_on_inputs

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
    noisy_inputs: Sequence[np.ndarray] = ()  # from `with_added_noise`; empty for plain least squares
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
        values = {"k_xu": p.valve.k_xu, "V_d": p.cylinder.V_d, "start": p.conditions.P_0}
        values |= {"null": p.valve.u_max, "start_T": p.conditions.T_0}
        values |= {"P_s": p.conditions.P_s, "A": p.cylinder.A_B}
        values["k_0"] = heat_area(0.0, p.cylinder)
        return values[_without_chamber(name)] if PARAMETERS[name].relative else 1.0

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


def replayed_pressures(problem: Problem, thetas: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Pressures of a model with several sets of parameters, Pa, shape (set, chamber, samples).

    Lanes of one replay share their plant. Flow is proportional to k_xu, and wall heat to k_0, so both become
    coefficients of a lane; another dead volume needs another replay. NaN where a replay left the positive
    numbers. `thetas` has shape (set, parameter), on the scale of the search; `inputs` are those of the
    problem's signals, or noisy ones.
    """
    plant, signals, lanes = problem.plant._replace(k_0=1.0), problem.signals, []
    values = [problem.values(theta) for theta in thetas]
    if problem.model.name == FULL.name:
        return np.array([_full_order_pressures(problem, value, inputs) for value in values])
    for value in values:
        row = lane(problem.model, value.get("n", 1.0), plant.gas.gamma)
        flow = value.get("k_xu", plant.valve.k_xu) / plant.valve.k_xu  # 1 where flows were measured
        heat = row.explicit_heat * value.get("k_0", 0.0)
        lanes.append(row._replace(n_in=row.n_in * flow, n_out=row.n_out * flow, explicit_heat=heat))
    start, V_d = (np.array([[v[f"{key}_A"], v[f"{key}_B"]] for v in values]) for key in ("start", "V_d"))
    coefficients, stride = lane_array(lanes), signals.stride
    result = np.empty((len(thetas), 2, len(inputs) // stride + 1))
    pairs, which = np.unique(V_d, axis=0, return_inverse=True)
    for i, pair in enumerate(pairs):
        rows = np.flatnonzero(which.ravel() == i)
        for sides, changed, offset in _plants_with_dead_volumes(plant, pair, problem.model):
            shifted = inputs + np.array([0.0, offset, 0.0]) if offset else inputs
            rest = (coefficients[rows], changed, signals.h, stride, start[rows])
            pressure = (
                pressures_on_inputs(shifted, *rest)
                if signals.flow is None
                else pressures_on_flows(shifted, signals.flow, *rest)
            )
            result[np.array(rows)[:, None], np.array(sides)] = pressure[:, sides]
    return result


def _full_order_pressures(problem: Problem, value: dict[str, float], inputs: np.ndarray) -> np.ndarray:
    """Pressures of the full-order chambers with one set of parameters, Pa, shape (chamber, samples)."""
    p, s = problem.plant, problem.signals
    valve = p.valve._replace(k_xu=value["k_xu"], exhaust=value.get("exhaust", p.valve.exhaust))
    conditions = p.conditions._replace(P_s=value.get("P_s", p.conditions.P_s))
    cylinder = p.cylinder._replace(A_B=value.get("A_B", p.cylinder.A_B))
    p = p._replace(k_0=value["k_0"], valve=valve, conditions=conditions)
    u = valve_signal(inputs[:, :, 0].mean(axis=1), s.h, **{name: value[name] for name in OF_VALVE})
    pressure: list[np.ndarray] = []
    for side, chamber in enumerate("AB"):
        own = p._replace(cylinder=cylinder._replace(V_d=value[f"V_d_{chamber}"]))
        start = value[f"start_{chamber}"], value[f"start_T_{chamber}"]
        replayed = full_order_chamber(u, inputs, side, own, s.h, s.stride, *start)
        pressure.append(replayed + value.get(f"offset_{chamber}", 0.0))
    return np.array(pressure)


def _plants_with_dead_volumes(
    plant: Plant, V_d: np.ndarray, model: Model
) -> list[tuple[list[int], Plant, float]]:
    """Chambers, plant and offset of the position, m, of each replay that two dead volumes need.

    One replay is enough, with equal dead volumes and the piston offset, unless the wall's area plays a role.
    """
    c = plant.cylinder
    if WALL_LAWS[model.wall][1] == 0 or V_d[0] == V_d[1]:
        offset = (V_d[0] - V_d[1]) / (c.A_A + c.A_B)
        return [([0, 1], plant._replace(cylinder=c._replace(V_d=V_d[0] - c.A_A * offset)), offset)]
    return [([side], plant._replace(cylinder=c._replace(V_d=V_d[side])), 0.0) for side in (0, 1)]


def pressure_and_jacobian(
    problem: Problem, theta: np.ndarray, inputs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Replayed pressure in units of P_s, shape (chamber, samples), and its derivative.

    The derivative, shape (chamber, samples, parameter), is by one-sided differences, away from the nearer
    bound. The pressure is NaN where the replay left the positive numbers.
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
    P = replayed_pressures(problem, thetas, inputs) / problem.plant.conditions.P_s
    jacobian = np.zeros((*P[0].shape, len(theta)))
    for change, members in zip(P[1:] - P[0], groups.values(), strict=True):
        for i in members:
            side = {"A": slice(0, 1), "B": slice(1, 2)}.get(problem.names[i][-1], slice(0, 2))
            jacobian[side, :, i] = change[side] / steps[i]
    return P[0], np.where(np.isfinite(jacobian), jacobian, 0.0)
