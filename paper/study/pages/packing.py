"""Time traces as text for a page: rounded to a stated step, differenced, deflated, in base64.

`templates/report_traces.js` unpacks them; reasons and sizes: decision 30.
"""

import base64
import math
import zlib
from collections.abc import Sequence

import numpy as np

MISSING = np.int16(-32768)  # code of failed runs and cells
LARGEST_CODE = 32_000  # in steps; MISSING stays free
FRACTION = 8  # steps in the smallest RMS error of a model: rounding is then below 1/16 of it
LEAST_STEP = 1.0  # Pa; stored pressures are accurate to 0.03 Pa


def round_number(value: float, up: bool) -> float:
    """Return the nearest number above or below a positive value that is 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** math.floor(math.log10(value))
    near = [factor * decade for factor in (1, 2, 5, 10)]
    slack = 1e-9 * value  # 10**x is not exact
    return next(x for x in near if x >= value - slack) if up else max(x for x in near if x <= value + slack)


def rounding_step(rms: float, largest: float) -> float:
    """Return the step to round pressures to, Pa: 1, 2 or 5 times a power of ten, at least 1 Pa.

    At most 1/8 of the error `rms` that must stay visible (NaN: none); larger where the `largest` magnitude
    would not fit into 16 bits.
    """
    fine = round_number(max(LEAST_STEP, rms / FRACTION), up=False)
    # max() with LEAST_STEP first: the quotient may be NaN, or so small that it has no logarithm.
    return max(fine, round_number(max(LEAST_STEP, largest / LARGEST_CODE), up=True))


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    """Return values as multiples of `step`, 16-bit integers; `MISSING` where a value is not finite."""
    finite = np.isfinite(values)
    return np.where(finite, np.rint(np.where(finite, values, 0.0) / step), MISSING).astype(np.int16)


def packed(groups: Sequence[np.ndarray]) -> str:
    """Return groups of traces as text; a group is an int16 array by (row, t): a model's traces over n.

    Differences are taken along t in the first row of a group, of first order over rows in the second row, of
    second order in the others; they wrap around, and so do the reader's sums. The text is Base64 of their
    deflated zigzag codes: all low bytes, then all high bytes.
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
