"""Table of verdict.md: who reproduces the paper how well, from paper/2006/simulators.json."""

import json
from typing import Any

from fragments import table

from paper.study import PAPERS
from paper.study.pages.verdict_page import SIMULATORS

FILE = PAPERS / "2006" / SIMULATORS


def stored() -> list[dict[str, Any]]:
    """Rows that `python -m benchmarks.simulators` wrote, one for each simulator."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def tables(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Tables by name."""
    cells = []
    for row in rows:
        status, fit = row["statuses"], row["fit"]
        chi_square = f"{fit['chi_square']:,.0f}" if fit else ""
        cells.append(
            [
                row["name"],
                *(f"{status[name]}" for name in ("exact", "close", "explained", "contradicted", "missed")),
                f"{row['table_7']:.3f}",
                f"{row['table_9']:.3f}",
                f"{row['table_8']['exact']}",
                chi_square,
                *(_pascal(row["off"][loop]) for loop in ("open", "closed")),
            ]
        )
    heads = ["runs by", "exact", "close", "explained", "contradicted", "missed"]
    heads += ["Table 7", "Table 9", "Table 8", "chi-square"]
    return {"simulators": table([*heads, "off, open (Pa)", "off, closed (Pa)"], cells)}


def _pascal(value: float) -> str:
    return f"{value:.2g}" if value < 1 else f"{value:,.0f}"


def numbers(rows: list[dict[str, Any]]) -> dict[str, str]:
    """Numbers of the sentences beside the table."""
    (first, *_) = rows
    return {
        "judged": f"{first['items']}",
        "not judged": f"{first['not_judged']}",
        "cells": f"{first['table_8']['cells']}",
        "fitted": f"{first['fit']['numbers']}" if first["fit"] else "",
    }
