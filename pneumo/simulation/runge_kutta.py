# pyright: basic
"""One compiled step of Dormand and Prince's method, for any scalar equations."""

from collections.abc import Callable
from typing import Any

from numba.extending import register_jitable

from pneumo.simulation.tableau import DORMAND_PRINCE

A, B, C = DORMAND_PRINCE.A, DORMAND_PRINCE.b, DORMAND_PRINCE.c
STAGES = len(B)


def dormand_prince(rates: Callable[..., None]) -> Callable[..., None]:
    """Return the step of a set of equations, to be called from compiled code.

    Parameters
    ----------
    rates : callable
        ``rates(y, i, context, dy)`` writes the derivatives of the state y at stage i into dy. ``context`` is
        whatever the equations need beside the state.

    Returns
    -------
    callable
        ``step(y, context, h, Y, K, y_next)`` writes the state one step h later into y_next, which may be y
        itself, the six stage states into Y and their derivatives into K, both of shape (6, len(y)).
    """

    @register_jitable
    def step(y: Any, context: Any, h: float, Y: Any, K: Any, y_next: Any) -> None:
        for i in range(STAGES):
            for s in range(len(y)):
                total = 0.0
                for j in range(i):
                    total += A[i, j] * K[j, s]
                Y[i, s] = y[s] + h * total
            rates(Y[i], i, context, K[i])
        for s in range(len(y)):
            total = 0.0
            for i in range(STAGES):
                total += B[i] * K[i, s]
            y_next[s] = y[s] + h * total

    return step
