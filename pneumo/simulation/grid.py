"""The lanes of a study's grid: every model at every n."""

import numpy as np

from pneumo.physics.models import MODELS, lane, lane_array


def grid_lanes(n: tuple[float, ...], gamma: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of every model at every n, each once (a "lane"), and the lane of each model and n.

    Shapes are (lane, 10) and (model, n). A model without n has the same lane at every n.
    """
    lanes, index = [], []
    for model in MODELS.values():
        index.append(len(lanes) + np.arange(len(n)) * model.has_n)
        lanes += [lane(model, value, gamma) for value in (n if model.has_n else (1.0,))]
    return lane_array(lanes), np.array(index)
