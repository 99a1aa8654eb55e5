"""What noise in the measured position does to the estimates, and what smoothing it does.

Neither averages out: noise in the position makes the replayed pressure too large on average and takes from its
slopes, smoothing takes from its peaks. Both are found by doing them once more to a measurement whose truth is
known, the fitted model on the smoothed position; how far the fit moves there is taken from the estimates.
"""

import numpy as np
from scipy.interpolate import make_smoothing_spline

from pneumo.apply.fitting import Fit, Problem, evaluated, replayed
from pneumo.apply.signals import Signals, stage_times

PAIRS = 4  # of noise and its negative, which leaves what is odd in it out
# How far each estimate may be moved for good, on the scale of the search: where the measurement says little, a
# linear estimate of the move says nothing.
WIDTHS = {"n": 0.05, "k_0": 0.5, "k_xu": 0.05, "V_d_A": 0.5, "V_d_B": 0.5, "start_A": 0.05, "start_B": 0.05}


def disturbed(signals: Signals, seed: int = 0) -> list[np.ndarray]:
    """Inputs that a smoothed position turns into, measured and smoothed once more.

    Parameters
    ----------
    signals : Signals
        Of the part that is fitted.
    seed : int
        Of the noise.

    Returns
    -------
    list of numpy.ndarray
        Like `Signals.inputs`.
    """
    steps, stride = signals.inputs[:, :, 1], signals.stride
    x = np.append(steps[::stride, 0], steps[-1, -1])
    t, at = signals.period * np.arange(len(x)), stage_times(len(steps), signals.h)
    rng = np.random.default_rng(seed)

    def read(values: np.ndarray) -> np.ndarray:
        spline = make_smoothing_spline(t, values, lam=signals.penalty)
        return np.stack([spline(at), spline.derivative()(at)], axis=-1)

    again = read(x)
    result = []
    for _ in range(PAIRS):
        noise = read(rng.normal(0.0, signals.noise, len(x)))
        for sign in (1.0, -1.0):
            inputs = signals.inputs.copy()
            inputs[:, :, 1:] = again + sign * noise
            result.append(inputs)
    return result


def bias(problem: Problem, fit: Fit, spread: np.ndarray, others: list[np.ndarray]) -> np.ndarray:
    """How far disturbed inputs move the estimates, shrunk where these are uncertain beyond `WIDTHS`.

    Parameters
    ----------
    problem : Problem
    fit : Fit
    spread : numpy.ndarray
        Covariance of the estimates.
    others : list of numpy.ndarray
        From `disturbed`.

    Returns
    -------
    numpy.ndarray
        On the scale of the search, shape (parameter,).
    """
    exact = replayed(problem, fit.theta[None])[0]
    count = len(fit.theta)
    slope, information = np.zeros(count), np.zeros((count, count))
    for inputs in others:
        own = problem._replace(signals=problem.signals._replace(inputs=inputs, P=exact))
        residual, jacobian = evaluated(own, fit.theta)
        J = jacobian.reshape(-1, count)
        slope += J.T @ residual.ravel()
        information += J.T @ J
    variance = np.trace(spread @ information) / len(others) / count  # of a residual, as correlated as they are
    widths = np.array([WIDTHS[name] for name in problem.names])
    precision = information / len(others) / variance + np.diag(widths**-2.0)
    return np.linalg.solve(precision, slope / len(others) / variance)
