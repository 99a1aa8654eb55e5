"""Bars of `pneumo study`: expected errors by cause, as numbers for its page and figure."""

from typing import NamedTuple

import numpy as np

from pneumo.publish.text.formatting import KILO
from pneumo.selection.answer import Answer
from pneumo.selection.error_budget import Row

MOST_SHOWN = 4.0  # times the lowest error: models with more have no bar
ITSELF = "model itself"
PART_COLORS = ("#2f74b5", "#f0922f", "#007a62", "#8a6d1f", "#6b6b6b")  # of the groups, then of the model


class Bar(NamedTuple):
    """Expected error of a model, divided in proportion to the squares of its causes; in kPa."""

    row: Row
    parts: tuple[tuple[float, float, str], ...]  #: left end, width and colour of each cause
    low: float
    high: float
    measured: float  #: on data held out of a fit; NaN without


def causes(answer: Answer) -> dict[str, str]:
    """Causes of the errors, in the order of a bar's parts, with their colours."""
    return dict(zip([*answer.budget.groups, ITSELF], PART_COLORS, strict=False))


def budget_bars(answer: Answer) -> list[Bar]:
    """Bar of each model whose expected error is at most four times the lowest one."""
    bars: list[Bar] = []
    for row in answer.rows:
        if row.rms > MOST_SHOWN * answer.rows[0].rms:
            continue
        squares = [*(row.part(group) ** 2 for group in answer.budget.groups), row.own**2]
        ends = row.rms / KILO * np.cumsum([0.0, *squares]) / (sum(squares) or 1.0)
        parts = tuple(zip(ends[:-1].tolist(), np.diff(ends).tolist(), causes(answer).values(), strict=True))
        measured = answer.budget.measured.get(row.model, np.nan) / KILO
        bars.append(Bar(row, parts, row.low / KILO, row.high / KILO, measured))
    return bars
