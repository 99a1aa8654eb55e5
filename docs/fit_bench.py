"""Table and numbers of the bench of fits on fit.md, from docs/static/fit_bench.json."""

import json
from typing import Any

from cluster import STATIC
from fragments import table

COUNTS = (
    "refused",
    "warned",
    "outside",
    "wrong",
    "silent",
    "cause right",
    "cause tied",
    "cause none",
    "cause wrong",
)


def stored() -> dict[str, Any]:
    """Counts that `python -m benchmarks.fit_bench --page` wrote."""
    return json.loads((STATIC / "fit_bench.json").read_text(encoding="utf-8"))


def tables(bench: dict[str, Any]) -> dict[str, str]:
    """Counts by what is wrong with a record."""
    rows = [
        [
            row["text"],
            f"{row['records']}",
            *("" if row[name] is None else f"{row[name]:.2f}" for name in ("k_0", "C")),
            *(f"{row[name]}" for name in COUNTS),
        ]
        for row in bench["table"].values()
    ]
    return {"bench": table(["record", "cases", "k_0 over truth", "C over truth", *COUNTS], rows)}


def numbers(bench: dict[str, Any]) -> dict[str, str]:
    """Numbers of the sentences beside the table."""
    none, every = bench["table"]["none"], bench["table"].values()
    of_undisturbed = bench["undisturbed"]
    shares = {name: 100 * row["held"] / row["intervals"] for name, row in of_undisturbed.items()}
    return {
        "cases": f"{sum(row['records'] for row in every)}",
        "undisturbed": f"{none['records']}",
        "warned": f"{none['warned']}",
        "warned percent": f"{100 * none['warned'] / none['records']:.0f}",
        "silent": f"{sum(row['silent'] for row in every)}",
        "named wrong": f"{sum(row['cause wrong'] for row in every)}",
        "undisturbed named wrong": f"{none['cause wrong']}",
        "error": f"{100 * of_undisturbed['k_0']['error']:.1f}",
        "error unwarned": f"{100 * bench['unwarned']['k_0']['error']:.1f}",
        "lowest share": f"{min(shares.values()):.0f}",
        "highest share": f"{max(shares.values()):.0f}",
        "seconds": f"{bench['seconds']:.1f}",
    }
