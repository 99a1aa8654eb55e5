"""Traces packed for the report, unpacked again."""

import base64
import zlib
from collections.abc import Sequence

import numpy as np


def unpacked(text: str, rows: Sequence[int], samples: int) -> list[np.ndarray]:
    """Traces unpacked as the page's script does it, with sums over whole arrays."""
    low, high = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).reshape(2, -1).astype(int)
    code = low + 256 * high
    changes = np.where(code % 2, -(code + 1) // 2, code // 2)
    assert len(changes) == sum(rows) * samples
    groups = []
    for part in np.split(changes, np.cumsum(rows)[:-1] * samples):
        change = part.reshape(-1, samples)
        change[0] = np.cumsum(change[0])
        if len(change) > 1:
            change[1:] = np.cumsum(change[1:], axis=0)  # differences of first order
        groups.append(np.cumsum(change, axis=0).astype(np.int16))  # 16 bits: sums wrap around
    return groups
