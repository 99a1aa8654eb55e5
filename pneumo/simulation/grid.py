"""The lanes of a study's grid: every model at every n."""

import numpy as np

from pneumo.physics.models import MODELS, lane, lane_array


def grid_lanes(n: tuple[float, ...], gamma: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of every model at every n, each once (a "lane"), and the lane of each model and n.

    Returns
    -------
    lanes : numpy.ndarray
        Shape (lane, 10): one row per model without n, one per n otherwise.
    index : numpy.ndarray
        Shape (model, n): row of `lanes`. A model without n has the same lane at every n.
    """
    lanes, index = [], np.empty((len(MODELS), len(n)), dtype=int)
    for i, model in enumerate(MODELS.values()):
        if model.has_n:
            index[i] = len(lanes) + np.arange(len(n))
            lanes += [lane(model, value, gamma) for value in n]
        else:
            index[i] = len(lanes)
            lanes.append(lane(model, 1.0, gamma))
    return lane_array(lanes), index
