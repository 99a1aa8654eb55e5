"""Explicit Runge-Kutta methods as tables that check themselves."""

from typing import NamedTuple

import numpy as np


class Tableau(NamedTuple):
    """Butcher tableau of an explicit method.

    Attributes
    ----------
    A : numpy.ndarray
        Stage coefficients, shape (stages, stages), strictly lower triangular.
    b, c : numpy.ndarray
        Weights and nodes, shape (stages,).
    order : int
        Order of the method.
    """

    A: np.ndarray
    b: np.ndarray
    c: np.ndarray
    order: int


def explicit(rows: list[list[float]], weights: list[float], order: int) -> Tableau:
    """Build a tableau from the rows below its first and check it.

    Raises
    ------
    ValueError
        If a condition on row sums, or an order condition up to order three, or one of the
        quadrature conditions ``sum b c^(q-1) = 1/q`` up to `order`, does not hold.
    """
    s = len(weights)
    A = np.zeros((s, s))
    for i, row in enumerate(rows, start=1):
        A[i, :i] = row
    b, c = np.array(weights), A.sum(axis=1)
    conditions = {f"sum b c^{q - 1} = 1/{q}": (b @ c ** (q - 1), 1 / q) for q in range(1, order + 1)}
    if order >= 3:
        conditions["b A c = 1/6"] = (b @ A @ c, 1 / 6)
    if order >= 4:
        conditions["b (c A c) = 1/8"] = (b @ (c * (A @ c)), 1 / 8)
        conditions["b A c^2 = 1/12"] = (b @ A @ c**2, 1 / 12)
        conditions["b A A c = 1/24"] = (b @ A @ A @ c, 1 / 24)
    for name, (value, wanted) in conditions.items():
        if not abs(value - wanted) < 1e-14:
            raise ValueError(f"Butcher tableau: {name} does not hold: {value!r}")
    return Tableau(A, b, c, order)


# Dormand and Prince's fifth-order method, as a fixed-step solver: six stages, no error estimate.
DORMAND_PRINCE = explicit(
    [
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    ],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    order=5,
)
