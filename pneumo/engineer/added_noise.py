"""A smoothed position, disturbed once more as the sensor and the smoothing disturbed it.

What that does to the fitted model's pressures is what has been done to them already; `pneumo.engineer.least_squares`
takes it off.
"""

import numpy as np
from scipy.interpolate import make_smoothing_spline

from pneumo.engineer.stage_signals import Signals, stage_times

FEW = 3  # pairs of noise and its negative, which leaves what is odd in it out: enough to go down the squares
PAIRS = 16  # for the estimate and for what it varies by: its standard error is then known to some 15 %


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
