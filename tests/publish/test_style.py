"""The common style of figures: the reader's settings do not matter, models and sources can be told apart."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from paper.study.model_looks import PAPER_LOOKS
from paper.study.paper_2006.paper_models import PAPER_MODELS

# Machado, Oliveira and Fernandes (2009), doi:10.1109/TVCG.2009.113, severity 1, on linear RGB.
PROTAN = [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998]
DEUTAN = [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881]
VISION = {"normal": np.eye(3), "protanopia": np.reshape(PROTAN, (3, 3))}
VISION |= {"deuteranopia": np.reshape(DEUTAN, (3, 3)), "grey": np.tile([0.2126, 0.7152, 0.0722], (3, 1))}


def lab(color: str, vision: str) -> np.ndarray:
    """CIE L*a*b* (D65) of a colour as that eye, or a grey printer, gives it."""
    rgb = np.array(to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.asarray(VISION[vision]) @ linear, 0, 1)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    ratio = to_xyz @ seen / to_xyz.sum(axis=1)
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", VISION)
def test_models_can_be_told_apart(vision):
    assert list(PAPER_LOOKS) == list(PAPER_MODELS)
    for (one, look), (other, another) in itertools.combinations(PAPER_LOOKS.items(), 2):
        # 12 in CIE76 is some five times the just noticeable 2.3; a pair below it must differ in dashes.
        close = np.linalg.norm(lab(look.color, vision) - lab(another.color, vision)) < 12
        assert not (close and look.linestyle == another.linestyle), f"{one} and {other}, {vision}"
