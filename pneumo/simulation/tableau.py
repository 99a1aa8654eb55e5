"""Explicit Runge-Kutta methods as tables."""

from typing import NamedTuple

import numpy as np


class Tableau(NamedTuple):
    """Butcher tableau of an explicit method."""

    A: np.ndarray  # stage coefficients, shape (stages, stages), strictly lower triangular
    b: np.ndarray  # weights, shape (stages,)
    c: np.ndarray  # nodes, shape (stages,)


def explicit(rows: list[list[float]], weights: list[float]) -> Tableau:
    """Build the tableau of an explicit method from the coefficients of its second stage on, and weights."""
    A = np.zeros((len(weights), len(weights)))
    for i, row in enumerate(rows, start=1):
        A[i, :i] = row
    return Tableau(A, np.array(weights, dtype=float), A.sum(axis=1))


# Dormand and Prince's fifth-order method, as a fixed-step solver of six stages.
DORMAND_PRINCE = explicit(
    [
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
)

STAGES = len(DORMAND_PRINCE.b)

# Fifth-order minus fourth-order weights; a seventh stage is at the end of the step.
EMBEDDED_DIFFERENCE = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
