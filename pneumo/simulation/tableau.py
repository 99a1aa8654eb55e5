"""Explicit Runge-Kutta methods as tables that check themselves."""

from typing import NamedTuple

import numpy as np


class Tableau(NamedTuple):
    """Butcher tableau of an explicit method."""

    A: np.ndarray  # stage coefficients, shape (stages, stages), strictly lower triangular
    b: np.ndarray  # weights, shape (stages,)
    c: np.ndarray  # nodes, shape (stages,)
    order: int


def explicit(rows: list[list[float]], weights: list[float], order: int) -> Tableau:
    """Build the tableau of an explicit method and check its order conditions.

    `rows` are the stage coefficients from the second stage on: one number, then two, and so on.

    Raises
    ------
    ValueError
        If one of the order conditions (17 up to order five; Hairer, Norsett and Wanner, Solving Ordinary
        Differential Equations I, section II.2) does not hold, or `order` is not 1 to 5.
    """
    if order not in range(1, 6):
        raise ValueError(f"order = {order}: conditions are known here for orders 1 to 5")
    s = len(weights)
    A = np.zeros((s, s))
    for i, row in enumerate(rows, start=1):
        A[i, :i] = row
    b, c = np.array(weights, dtype=float), A.sum(axis=1)
    conditions = [  # order, name, value, wanted
        (1, "b 1 = 1", b.sum(), 1),
        (2, "b c = 1/2", b @ c, 1 / 2),
        (3, "b c^2 = 1/3", b @ c**2, 1 / 3),
        (3, "b A c = 1/6", b @ A @ c, 1 / 6),
        (4, "b c^3 = 1/4", b @ c**3, 1 / 4),
        (4, "b (c A c) = 1/8", b @ (c * (A @ c)), 1 / 8),
        (4, "b A c^2 = 1/12", b @ A @ c**2, 1 / 12),
        (4, "b A A c = 1/24", b @ A @ A @ c, 1 / 24),
        (5, "b c^4 = 1/5", b @ c**4, 1 / 5),
        (5, "b (c^2 A c) = 1/10", b @ (c**2 * (A @ c)), 1 / 10),
        (5, "b (c A c^2) = 1/15", b @ (c * (A @ c**2)), 1 / 15),
        (5, "b (c A A c) = 1/30", b @ (c * (A @ A @ c)), 1 / 30),
        (5, "b (A c)^2 = 1/20", b @ (A @ c) ** 2, 1 / 20),
        (5, "b A c^3 = 1/20", b @ A @ c**3, 1 / 20),
        (5, "b A (c A c) = 1/40", b @ A @ (c * (A @ c)), 1 / 40),
        (5, "b A A c^2 = 1/60", b @ A @ A @ c**2, 1 / 60),
        (5, "b A A A c = 1/120", b @ A @ A @ A @ c, 1 / 120),
    ]
    for condition_order, name, value, wanted in conditions:
        if condition_order <= order and not abs(value - wanted) < 1e-14:
            raise ValueError(f"Butcher tableau: {name} does not hold: {value!r}")
    return Tableau(A, b, c, order)


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
    order=5,
)

STAGES = len(DORMAND_PRINCE.b)

# Fifth-order minus fourth-order weights; a seventh stage is at the end of the step.
EMBEDDED_DIFFERENCE = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
