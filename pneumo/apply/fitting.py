"""Parameters of a reduced model from measured pressures: least squares over the whole replay.

The replay starts once, from a pressure that is fitted too, and then sees command and position only: what is
left between its pressures and the measured ones is the model's error and the noise (output error). Each
chamber has a dead volume of its own, as the hoses make it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from pneumo.apply.signals import Signals
from pneumo.physics.cylinder import heat_area
from pneumo.physics.experiment import Plant
from pneumo.physics.models import WALL_LAWS, Model, lane, lane_array
from pneumo.simulate.driven import driven

LAMBDA_0 = 30.0  # W/(m^2 K); where the search for k_0 begins, between still and moving air
OFF = 10.0  # residual, in units of P_s, where a replay left the positive numbers


class Parameter(NamedTuple):
    """What can be fitted, and where it is sought.

    Attributes
    ----------
    unit : str
    low, high : float
        Bounds, in SI units, or times what the configuration has where `relative`.
    relative : bool
    logarithmic : bool
        Sought, and its interval taken, on a logarithmic scale.
    """

    unit: str
    low: float
    high: float
    relative: bool = False
    logarithmic: bool = True

    def inner(self, value: float) -> float:
        """Value on the scale on which it is sought."""
        return float(np.log(value)) if self.logarithmic else float(value)

    def outer(self, value: float) -> float:
        """Value in SI units."""
        return float(np.exp(value)) if self.logarithmic else float(value)


PARAMETERS = {
    "n": Parameter("1", 0.8, 1.8, logarithmic=False),
    "k_0": Parameter("W K-1", 0.3, 1000.0, relative=True),  # W/(m^2 K) times A_q0
    "k_xu": Parameter("m2 V-1", 0.05, 20.0, relative=True),
    "V_d_A": Parameter("m3", 0.02, 50.0, relative=True),
    "V_d_B": Parameter("m3", 0.02, 50.0, relative=True),
    "start_A": Parameter("Pa", 0.1, 3.0, relative=True),  # of P_0
    "start_B": Parameter("Pa", 0.1, 3.0, relative=True),
}
TOLERANCE, PROFILE_TOLERANCE = 1e-7, 3e-5  # the ends of an interval stand some 3 / samples above the least
FLAT = 1e-2  # singular values below this times the largest: directions in which nothing is foreseen
STEP = 1e-4  # of differences, on the scale of the search


class Problem(NamedTuple):
    """A model that is to follow a measurement.

    Attributes
    ----------
    model : Model
    plant : Plant
        As configured; what is fitted takes the place of its k_0, k_xu and V_d.
    signals : Signals
    fixed : dict of str to float
        Parameters that are not fitted, in SI units.
    """

    model: Model
    plant: Plant
    signals: Signals
    fixed: dict[str, float]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are fitted."""
        absent = {"n"} if not self.model.has_n else set()
        absent |= {"k_0"} if self.model.wall == "none" else set()
        return tuple(name for name in PARAMETERS if name not in absent | set(self.fixed))

    def reference(self, name: str) -> float:
        """Value in SI units of which a parameter's bounds are multiples."""
        p = self.plant
        values = {"k_xu": p.valve.k_xu, "V_d": p.cylinder.V_d, "start": p.conditions.P_0}
        values["k_0"] = heat_area(0.0, p.cylinder)
        return values[name.removesuffix("_A").removesuffix("_B")] if PARAMETERS[name].relative else 1.0

    def bounds(self) -> np.ndarray:
        """Lower and upper bounds on the scale of the search, shape (2, parameter)."""
        ends = [
            [p.inner(end * self.reference(name)) for end in (p.low, p.high)]
            for name, p in ((name, PARAMETERS[name]) for name in self.names)
        ]
        return np.array(ends).T

    def guess(self) -> np.ndarray:
        """Where the search begins: what is configured, and the first measured pressures."""
        few = self.signals.P[:, : max(1, round(2e-3 / self.signals.period))].mean(axis=1)
        values = {
            "n": 1.2,
            "k_0": LAMBDA_0 * self.reference("k_0"),
            "start_A": few[0],
            "start_B": few[1],
        }
        inner = [PARAMETERS[k].inner(values.get(k, self.reference(k))) for k in self.names]
        low, high = self.bounds()
        return np.clip(inner, low + STEP, high - STEP)


class Fit(NamedTuple):
    """A least-squares fit.

    Attributes
    ----------
    theta : numpy.ndarray
        Parameters on the scale of the search, shape (parameter,).
    residual : numpy.ndarray
        Measured minus replayed pressure in units of P_s, shape (chamber, samples).
    jacobian : numpy.ndarray
        Derivative of the replayed pressure in the same units, shape (chamber, samples, parameter).
    evaluations : int
        Number of replays, each of the model and of what its derivatives take.
    """

    theta: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    evaluations: int

    @property
    def squares(self) -> float:
        """Sum of squared residuals."""
        return float(np.sum(self.residual**2))


def replayed(problem: Problem, thetas: np.ndarray) -> np.ndarray:
    """Replay a model with several sets of parameters.

    Lanes of one replay share their plant. But the flow is proportional to k_xu, and the wall's heat to k_0, so
    both can be written as coefficients of a lane; dead volumes cannot, and each takes a replay of its own.

    Parameters
    ----------
    problem : Problem
    thetas : numpy.ndarray
        Shape (set, parameter), on the scale of the search.

    Returns
    -------
    numpy.ndarray
        Pressures, Pa, shape (set, chamber, samples); NaN where a replay left the positive numbers.
    """
    plant, signals = problem.plant._replace(k_0=1.0), problem.signals
    lanes, start, V_d = [], np.empty((len(thetas), 2)), np.empty((len(thetas), 2))
    for i, theta in enumerate(thetas):
        value = problem.fixed | {
            k: PARAMETERS[k].outer(x) for k, x in zip(problem.names, theta, strict=True)
        }
        row = lane(problem.model, value.get("n", 1.0), plant.gas.gamma)
        flow = value["k_xu"] / plant.valve.k_xu
        lanes.append(
            row._replace(
                n_in=row.n_in * flow,
                n_out=row.n_out * flow,
                explicit_heat=row.explicit_heat * value.get("k_0", 0.0),
            )
        )
        start[i] = value["start_A"], value["start_B"]
        V_d[i] = value["V_d_A"], value["V_d_B"]
    coefficients, stride = lane_array(lanes), signals.stride
    result = np.empty((len(thetas), 2, len(signals.inputs) // stride + 1))
    pairs, which = np.unique(V_d, axis=0, return_inverse=True)
    for i, pair in enumerate(pairs):
        rows = np.flatnonzero(which.ravel() == i)
        for sides, own, moved in _plants(plant, pair, problem.model):
            inputs = signals.inputs + (0.0, moved, 0.0) if moved else signals.inputs
            found = driven(inputs, coefficients[rows], own, signals.h, stride, start[rows])
            result[np.ix_(rows, sides)] = found[:, sides]
    return result


def _plants(plant: Plant, V_d: np.ndarray, model: Model) -> list[tuple[list[int], Plant, float]]:
    """Chambers that a replay serves, its plant, and by how much the piston is moved there, m.

    Two dead volumes are one, with the piston beside where it is, unless the wall's area takes part.
    """
    c = plant.cylinder
    if WALL_LAWS[model.wall][1] == 0 or V_d[0] == V_d[1]:
        moved = (V_d[0] - V_d[1]) / (c.A_A + c.A_B)
        return [([0, 1], plant._replace(cylinder=c._replace(V_d=V_d[0] - c.A_A * moved)), moved)]
    return [([side], plant._replace(cylinder=c._replace(V_d=V_d[side])), 0.0) for side in (0, 1)]


def evaluated(problem: Problem, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Residual and Jacobian as `Fit` has them; differences are one-sided, away from the nearer bound."""
    low, high = problem.bounds()
    steps = np.where(theta - low > high - theta, -STEP, STEP)
    # What concerns one chamber only is varied together with the same of the other.
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(problem.names):
        groups.setdefault(name.removesuffix("_A").removesuffix("_B"), []).append(i)
    thetas = np.tile(theta, (len(groups) + 1, 1))
    for row, members in zip(thetas[1:], groups.values(), strict=True):
        row[members] += steps[members]
    found = replayed(problem, thetas)
    P_s = problem.plant.conditions.P_s
    residual = (problem.signals.P - found[0]) / P_s
    jacobian = np.zeros((*residual.shape, len(theta)))
    for change, members in zip(found[1:] - found[0], groups.values(), strict=True):
        for i in members:
            side = {"A": slice(0, 1), "B": slice(1, 2)}.get(problem.names[i][-1], slice(0, 2))
            jacobian[side, :, i] = change[side] / P_s / steps[i]
    lost = ~np.isfinite(residual)
    return np.where(lost, OFF, residual), np.where(np.isfinite(jacobian), jacobian, 0.0)


def fit(problem: Problem, guess: np.ndarray | None = None, tolerance: float = TOLERANCE, most: int = 40) -> Fit:
    """Fit a model to a measurement by least squares.

    Parameters
    ----------
    problem : Problem
    guess : numpy.ndarray, optional
        Where to begin, on the scale of the search.
    tolerance : float
        Relative change of the sum of squares, or of the parameters, that counts as none.
    """
    seen: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = theta.tobytes()
        if key not in seen:
            seen[key] = evaluated(problem, theta)
        return seen[key]

    count = len(problem.names)
    found = least_squares(
        lambda theta: at(theta)[0].ravel(),
        problem.guess() if guess is None else guess,
        jac=lambda theta: -at(theta)[1].reshape(-1, count),  # type: ignore[arg-type]
        bounds=problem.bounds(),
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=None,  # type: ignore[arg-type]
        max_nfev=most,
    )
    return Fit(found.x, *at(found.x), len(seen))


def with_one_fixed(problem: Problem, best: Fit, index: int, value: float, like: np.ndarray | None) -> Fit:
    """Fit the other parameters with one held at a value on the scale of the search.

    Parameters
    ----------
    problem : Problem
    best : Fit
        With none held.
    index : int
        Of the parameter.
    value : float
    like : numpy.ndarray or None
        Where to begin, shape (parameter - 1,); None for where the linearised problem has its minimum.
    """
    name = problem.names[index]
    held = problem._replace(fixed=problem.fixed | {name: PARAMETERS[name].outer(value)})
    others = np.arange(len(best.theta)) != index
    if like is None:
        J = best.jacobian.reshape(-1, len(best.theta))
        missing = best.residual.ravel() - J[:, index] * (value - best.theta[index])
        norms = np.linalg.norm(J[:, others], axis=0)
        like = best.theta[others] + np.linalg.lstsq(J[:, others] / norms, missing, rcond=FLAT)[0] / norms
    low, high = held.bounds()
    return fit(held, np.clip(like, low + STEP, high - STEP), PROFILE_TOLERANCE, 12)


def values(problem: Problem, theta: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Parameters in SI units, fixed ones too."""
    return problem.fixed | {k: PARAMETERS[k].outer(x) for k, x in zip(problem.names, theta, strict=True)}
