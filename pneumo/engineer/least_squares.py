"""Parameters of a reduced model from measured pressures: least squares over the whole replay.

The replay starts once, from a pressure that is fitted too, and then sees position and command (or mass
flows) only: what is left between its pressures and the measured ones is the model's error and the noise
(output error). Each chamber has a dead volume of its own, as the hoses make it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from pneumo.configuration.experiment import Plant
from pneumo.engineer.stage_signals import Signals
from pneumo.errors import InputError
from pneumo.physics.cylinder import heat_area
from pneumo.physics.models import WALL_LAWS, Model, lane, lane_array
from pneumo.simulation.given_inputs import pressures_on_flows, pressures_on_inputs

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
SETTLED, MOST_STEPS = 0.03, 8  # change of the sum of squares, over a residual's variance, that counts as none
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
    others : sequence of numpy.ndarray
        Disturbed inputs, of `pneumo.engineer.added_noise`; empty for plain least squares.
    """

    model: Model
    plant: Plant
    signals: Signals
    fixed: dict[str, float]
    others: Sequence[np.ndarray] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are fitted."""
        absent = {"n"} if not self.model.has_n else set()
        absent |= {"k_0"} if self.model.wall == "none" else set()
        absent |= {"k_xu"} if self.signals.flow is not None else set()
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
    """A model at one set of parameters, beside a measurement.

    Attributes
    ----------
    theta : numpy.ndarray
        Parameters on the scale of the search, shape (parameter,).
    residual : numpy.ndarray
        Measured minus replayed pressure in units of P_s, shape (chamber, samples).
    jacobian : numpy.ndarray
        Derivative of the replayed pressure in the same units, shape (chamber, samples, parameter).
    squares : float
        Sum of squared residuals, corrected.
    slope, curvature : numpy.ndarray
        Minus half its gradient, and half its second derivative (Gauss and Newton's).
    scatter : numpy.ndarray
        Covariance of the slope that noise in the position alone causes, shape (parameter, parameter).
    """

    theta: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    squares: float
    slope: np.ndarray
    curvature: np.ndarray
    scatter: np.ndarray


def replayed(problem: Problem, thetas: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Replay a model with several sets of parameters.

    Lanes of one replay share their plant. But the flow is proportional to k_xu, and the wall's heat to k_0,
    so both can be written as coefficients of a lane; other dead volumes take another replay.

    Parameters
    ----------
    problem : Problem
    thetas : numpy.ndarray
        Shape (set, parameter), on the scale of the search.
    inputs : numpy.ndarray
        Those of the problem's signals, or disturbed ones.

    Returns
    -------
    numpy.ndarray
        Pressures, Pa, shape (set, chamber, samples); NaN where a replay left the positive numbers.
    """
    plant, signals = problem.plant._replace(k_0=1.0), problem.signals
    lanes, start, V_d = [], np.empty((len(thetas), 2)), np.empty((len(thetas), 2))
    for i, theta in enumerate(thetas):
        value = problem.fixed | {k: PARAMETERS[k].outer(x) for k, x in zip(problem.names, theta, strict=True)}
        row = lane(problem.model, value.get("n", 1.0), plant.gas.gamma)
        flow = value.get("k_xu", plant.valve.k_xu) / plant.valve.k_xu  # 1 where flows were measured
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
    result = np.empty((len(thetas), 2, len(inputs) // stride + 1))
    pairs, which = np.unique(V_d, axis=0, return_inverse=True)
    for i, pair in enumerate(pairs):
        rows = np.flatnonzero(which.ravel() == i)
        for sides, own, moved in _plants(plant, pair, problem.model):
            shifted = inputs + np.array([0.0, moved, 0.0]) if moved else inputs
            of = (coefficients[rows], own, signals.h, stride, start[rows])
            if signals.flow is None:
                found = pressures_on_inputs(shifted, *of)
            else:
                found = pressures_on_flows(shifted, signals.flow, *of)
            result[np.array(rows)[:, None], np.array(sides)] = found[:, sides]
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


def slopes(problem: Problem, theta: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replay on some inputs, and the derivative of that.

    Returns
    -------
    pressure : numpy.ndarray
        In units of P_s, shape (chamber, samples); NaN where the replay left the positive numbers.
    jacobian : numpy.ndarray
        Shape (chamber, samples, parameter); differences are one-sided, away from the nearer bound.
    """
    low, high = problem.bounds()
    steps = np.where(theta - low > high - theta, -STEP, STEP)
    # What concerns one chamber only is varied together with the same of the other.
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(problem.names):
        groups.setdefault(name.removesuffix("_A").removesuffix("_B"), []).append(i)
    thetas = np.tile(theta, (len(groups) + 1, 1))
    for row, members in zip(thetas[1:], groups.values(), strict=True):
        row[members] += steps[members]
    found = replayed(problem, thetas, inputs) / problem.plant.conditions.P_s
    jacobian = np.zeros((*found[0].shape, len(theta)))
    for change, members in zip(found[1:] - found[0], groups.values(), strict=True):
        for i in members:
            side = {"A": slice(0, 1), "B": slice(1, 2)}.get(problem.names[i][-1], slice(0, 2))
            jacobian[side, :, i] = change[side] / steps[i]
    return found[0], np.where(np.isfinite(jacobian), jacobian, 0.0)


def evaluated(problem: Problem, theta: np.ndarray) -> Fit:
    """Corrected sum of squares at a set of parameters, with slope and curvature.

    Noise in the position does not average out: it adds to the pressure's mean and to its mean square, and
    more at some parameters than at others. Both are found with positions that are disturbed once more, and
    taken off: with P the replay and P_b the disturbed ones,

        sum (measured - P + (mean P_b - P))^2  -  mean over b of  sum (P_b - mean P_b)^2.

    The measured position had but one noise, so that its slope differs from the mean as those of the disturbed
    ones do: with both the pressure and its derivative disturbed, which one first-order covariance misses.
    """
    P, J = slopes(problem, theta, problem.signals.inputs)
    excess, pull, bend = 0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
    scatter = np.zeros_like(bend)
    if problem.others:
        replays = [slopes(problem, theta, inputs) for inputs in problem.others]
        mean_P, mean_J = (np.mean([replay[i] for replay in replays], axis=0) for i in (0, 1))
        for P_b, J_b in replays:
            d, J_d = (P_b - mean_P).ravel(), (J_b - mean_J).reshape(-1, len(theta))
            excess += float(d @ d) / len(replays)
            pull += J_d.T @ d / len(replays)
            bend += J_d.T @ J_d / len(replays)
        pulls = np.array([J_b.reshape(-1, len(theta)).T @ (P_b - mean_P).ravel() for P_b, J_b in replays])
        scatter = np.atleast_2d(np.cov(np.where(np.isfinite(pulls), pulls, 0.0), rowvar=False))
        P, J = 2 * P - mean_P, 2 * J - mean_J
    residual = problem.signals.P / problem.plant.conditions.P_s - P
    residual = np.where(np.isfinite(residual), residual, OFF)
    flat = J.reshape(-1, len(theta))
    squares = float(np.sum(residual**2)) - (excess if np.isfinite(excess) else 0.0)
    return Fit(theta, residual, J, squares, flat.T @ residual.ravel() + pull, flat.T @ flat - bend, scatter)


def fit(problem: Problem, guess: np.ndarray | None = None, tolerance: float = 1e-5, most: int = 40) -> Fit:
    """Fit a model by least squares: first as it is, then corrected for noise in the position.

    Parameters
    ----------
    problem : Problem
    guess : numpy.ndarray, optional
        Where to begin, on the scale of the search.
    tolerance : float
        Relative change of the sum of squares, or of the parameters, that counts as none at first.
    most : int
        Evaluations at first.

    Raises
    ------
    InputError
        If the valve leaks or has a laminar share: replays know neither.
    """
    valve = problem.plant.valve
    if problem.signals.flow is None and (valve.leak or valve.laminar):
        raise InputError(
            f"valve: leak = {valve.leak:.4g} m2, laminar = {valve.laminar:.4g}: must both be 0 for a fit;"
            " leave leak_dm3_per_sbar out, or measure the flows m_A and m_B"
        )
    plain, seen = problem._replace(others=()), {}

    def at(theta: np.ndarray) -> Fit:
        key = theta.tobytes()
        if key not in seen:
            seen[key] = evaluated(plain, theta)
        return seen[key]

    count = len(problem.names)
    found = least_squares(
        lambda theta: at(theta).residual.ravel(),
        problem.guess() if guess is None else guess,
        jac=lambda theta: -at(theta).jacobian.reshape(-1, count),  # type: ignore[arg-type]
        bounds=problem.bounds(),
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=None,  # type: ignore[arg-type]
        max_nfev=most,
    )
    return descended(problem, found.x) if problem.others else at(found.x)


def descended(problem: Problem, theta: np.ndarray, held: int | None = None, most: int = MOST_STEPS) -> Fit:
    """Go down the corrected sum of squares from where it is nearly lowest (Levenberg and Marquardt).

    Parameters
    ----------
    problem : Problem
    theta : numpy.ndarray
    held : int, optional
        Parameter that stays.
    most : int
        Steps.
    """
    low, high = problem.bounds()
    here, damping = evaluated(problem, np.clip(theta, low, high)), 1e-3
    enough = SETTLED * here.squares / here.residual.size
    for _ in range(most):
        slope = here.slope
        free = ((here.theta > low) | (slope > 0)) & ((here.theta < high) | (slope < 0))
        if held is not None:
            free[held] = False
        J = here.jacobian.reshape(-1, len(slope))[:, free]
        scale = np.sqrt(np.maximum(np.sum(J**2, axis=0), np.finfo(float).tiny))
        size, axes = np.linalg.eigh(here.curvature[np.ix_(free, free)] / np.outer(scale, scale))
        # Where the correction leaves no curvature at all, the step is as short as damping makes it.
        move = axes @ ((axes.T @ (slope[free] / scale)) / (np.maximum(size, 0.0) + damping)) / scale
        foreseen = float(slope[free] @ move)
        if foreseen < enough:
            break
        tried = here.theta.copy()
        tried[free] += move
        there = evaluated(problem, np.clip(tried, low, high))
        if there.squares < here.squares:
            gained, here, damping = here.squares - there.squares, there, damping / 10
            if gained < enough:
                break
        else:
            damping *= 10
    return here


def with_one_held(problem: Problem, best: Fit, index: int, value: float, like: np.ndarray | None) -> Fit:
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
        Where to begin; None for where the linearised problem has its minimum.
    """
    others = np.arange(len(best.theta)) != index
    if like is None:
        H, move = best.curvature, value - best.theta[index]
        scale = np.sqrt(np.diag(best.jacobian.reshape(-1, len(H)).T @ best.jacobian.reshape(-1, len(H))))[
            others
        ]
        inner = H[np.ix_(others, others)] / np.outer(scale, scale)
        size, axes = np.linalg.eigh(inner)
        told = np.where(size > FLAT * size.max(), size, np.inf)
        like = best.theta.copy()
        like[others] -= axes @ ((axes.T @ (H[others, index] * move / scale)) / told) / scale
    start = like.copy()
    start[index] = value
    return descended(problem, start, held=index)


def values(problem: Problem, theta: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Parameters in SI units, fixed ones too."""
    return problem.fixed | {k: PARAMETERS[k].outer(x) for k, x in zip(problem.names, theta, strict=True)}
