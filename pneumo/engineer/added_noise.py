"""Noise added to a smoothed position, as large as the noise already in it (simulation extrapolation).

The shift that added noise causes in the replayed pressures estimates the bias already there;
`pneumo.engineer.least_squares` subtracts it.
"""

import numpy as np
from scipy.interpolate import make_smoothing_spline

from pneumo.engineer.stage_signals import Signals, stage_times

# Antithetic pairs, noise and its negative: odd-order terms cancel.
FEW = 3  # pairs that suffice to reduce the sum of squares
PAIRS = 16  # pairs for the estimate and its variance: the standard error is then known to some 15 %


def disturbed(signals: Signals, pairs: int = PAIRS, seed: int = 0) -> list[np.ndarray]:
    """Inputs that a smoothed position turns into, measured and smoothed once more.

    Parameters
    ----------
    signals : Signals
        Of the part that is fitted.
    pairs : int
    seed : int
        Of the noise.

    Returns
    -------
    list of numpy.ndarray
        Like `Signals.inputs`; each with noise is followed by that with its negative.
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
    for noise in read(rng.normal(0.0, signals.noise, (pairs, len(x))).T).transpose(2, 0, 1, 3):
        for sign in (1.0, -1.0):
            inputs = signals.inputs.copy()
            inputs[:, :, 1:] = again + sign * noise
            result.append(inputs)
    return result
