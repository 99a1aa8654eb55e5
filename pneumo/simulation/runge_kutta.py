# pyright: basic
"""One compiled step of Dormand and Prince's method, for any scalar equations, and its error estimate."""

from collections.abc import Callable
from typing import Any

from pneumo.simulation.compiled import inlined
from pneumo.simulation.tableau import DORMAND_PRINCE, EMBEDDED_DIFFERENCE

A, B, C = DORMAND_PRINCE.A, DORMAND_PRINCE.b, DORMAND_PRINCE.c
STAGES = len(B)
E = EMBEDDED_DIFFERENCE
# Error estimate of a step, over P_0, T_0 or the stroke, above which it is halved where it may be
# (paper/decisions/0036).
STEP_TOLERANCE = 1e-4


def dormand_prince(rates: Callable[..., None]) -> Callable[..., None]:
    """Return a function for compiled code that advances given equations by one step of Dormand and Prince.

    Parameters
    ----------
    rates : callable
        ``rates(y, i, context, dy)`` writes the derivatives of the state y at stage i into dy. ``context`` is
        whatever the equations need beside the state.

    Returns
    -------
    callable
        ``step(y, context, h, Y, K, y_next)`` writes into y_next, which may be y itself, the state h later. It
        writes the six stage states into Y and their derivatives into K, a row for each stage.
    """

    @inlined
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


def embedded_error(rates: Callable[..., None]) -> Callable[..., None]:
    """Return a function for compiled code that estimates the error of a step made by `dormand_prince`.

    ``estimate(y_next, context, h, K, error)`` writes the fifth-order minus the fourth-order result into
    `error`. It reads the six derivatives that the step left in K, shape (7, len(y)), and writes the
    derivative at y_next into the seventh row of K.
    """

    @inlined
    def estimate(y_next: Any, context: Any, h: float, K: Any, error: Any) -> None:
        rates(y_next, STAGES, context, K[STAGES])
        for s in range(len(y_next)):
            total = 0.0
            for i in range(STAGES + 1):
                total += E[i] * K[i, s]
            error[s] = h * total

    return estimate
