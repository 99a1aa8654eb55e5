"""Strokes from vented chambers to rest at open ports: exported code against SciPy's Radau on equations of our own.

The independent state is mass and internal energy of each chamber; releases and stops are located exactly.
"""

import ctypes
from itertools import product

import numpy as np
import pytest
from exported_c import C_COMPILER, CompiledModel
from scipy.integrate import solve_ivp

from pneumo.physics.models import MODELS
from pneumo.selection.plants import example_plant

H = 1e-3
PRESSURE, TEMPERATURE = 500.0, 1.0  # Pa, K: what docs/export.md promises
GRID = list(product((0.4, 1.5, 4.0), (4e-6, 30e-6), (2e5, 4e5, 7e5, 10e5), (1, -1)))
BRIEF = [(4.0, 4e-6, 10e5, -1), (1.5, 4e-6, 10e5, 1), (0.4, 4e-6, 10e5, -1), (4.0, 30e-6, 2e5, 1)]
