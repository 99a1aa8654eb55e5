"""Time traces as text for a page: rounded to a stated step, differenced, deflated, in base64.

`templates/report_traces.js` is the inverse; paper/decisions/0030 has the reasons and sizes.
"""

import base64
import math
import zlib
from collections.abc import Sequence

import numpy as np

MISSING = np.int16(-32768)  # no value: the run or the cell had failed
LARGEST_CODE = 32_000  # in steps, so that a rounded value never meets MISSING
FRACTION = 16  # steps in the smallest RMS error of a model: rounding is then below 1/32 of it
LEAST_STEP = 1.0  # Pa; the stored pressures are good to 0.03 Pa


def _round_number(value: float, up: bool) -> float:
    """Return the nearest of 1, 2 and 5 times a power of ten on one side of a positive value."""
    decade = 10.0 ** math.floor(math.log10(value))
    near = [factor * decade for factor in (1, 2, 5, 10)]
    slack = 1e-9 * value  # 10**x is not exact
    return next(x for x in near if x >= value - slack) if up else max(x for x in near if x <= value + slack)


def rounding_step(rms: float, largest: float) -> float:
    """Return the step to round pressures to, Pa: 1, 2 or 5 times a power of ten, at least 1 Pa.

    It is at most 1/16 of the error `rms` that must stay visible (NaN if there is none), or more where the
    `largest` magnitude would not fit into 16 bits.
    """
    fine = _round_number(max(LEAST_STEP, rms / FRACTION), up=False)
    # max() with LEAST_STEP first: the quotient may be NaN, or so small that it has no logarithm.
    return max(fine, _round_number(max(LEAST_STEP, largest / LARGEST_CODE), up=True))


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """Return values in steps, as 16-bit integers; `MISSING` where they are not finite."""
    finite = np.isfinite(values)
    return np.where(finite, np.rint(np.where(finite, values, 0.0) / step), MISSING).astype(np.int16)


def packed(groups: Sequence[np.ndarray]) -> str:
    """Pack groups of neighbouring traces, each an int16 array by (row, t): a model's traces over n, in order.

    The text is Base64 of deflated bytes: all low bytes, then all high bytes, of zigzag-coded differences,
    along t in the first row of a group, over rows of first order in the second and of second order in the
    others. Sums wrap around like the differences, so nothing is lost.
    """
    parts = []
    for values in groups:
        change = values.copy()
        change[0, 1:] -= values[0, :-1]
        change[1:] -= values[:-1]
        change[2:] -= values[1:-1] - values[:-2]
        parts.append(change.reshape(-1))
    changes = np.concatenate(parts)
    zigzag = ((changes << 1) ^ (changes >> 15)).astype("<i2")  # small magnitudes get small codes
    planes = zigzag.view(np.uint8).reshape(-1, 2).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 4)).decode()
