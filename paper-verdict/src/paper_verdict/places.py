"""A line for each table and figure of the paper: how many numbers agree, the worst one, what was fitted."""

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from paper_verdict.about import About, Place
from paper_verdict.facts import (
    AGREES,
    NOT_JUDGED,
    SCATTER,
    SET_UP,
    WORST_FIRST,
    Assumption,
    Fact,
    Item,
    choices,
)

ORDER = ("Table", "Fig.", "Equations")


def _order(name: str) -> tuple[int, int, str]:
    match = re.fullmatch(r"(\S+) (\d+)", name)
    kind = match[1] if match else name
    return (ORDER.index(kind) if kind in ORDER else len(ORDER), int(match[2]) if match else 0, name)


def overview(
    items: Sequence[Item],
    facts: Mapping[str, Fact],
    assumptions: Mapping[str, Assumption],
    about: About,
    drawn: Sequence[str] = (),
) -> list[dict[str, Any]]:
    """Rows by table, figure, equations and text, in the paper's order; `drawn` are figures with curves."""
    members: dict[str, list[Item]] = {name: [] for name in (*about.places, *drawn)}
    for item in items:
        members.setdefault(item["place"], []).append(item)
    rows: list[dict[str, Any]] = []
    for name in sorted(members, key=_order):
        every = members[name]
        place = about.places.get(name) or Place()
        of_set_up = [item for item in every if item["basis"] == SET_UP]
        judged = [item for item in every if item["status"] != NOT_JUDGED]
        statuses = {status: sum(item["status"] == status for item in judged) for status in WORST_FIRST}
        worst = max(judged, key=lambda item: abs(item["relative"] or 0.0), default=None)
        chosen = {c: None for item in every for c in facts[item["fact"]].chosen}
        rows.append(
            {
                "name": name,
                **place.model_dump(include={"says", "link", "linear"}),
                "draws": [i["id"] for i in items if any(fnmatchcase(i["id"], p) for p in place.draws)],
                "items": len(every),
                "judged": len(judged),
                "set_up": len(of_set_up),
                "agree": statuses[AGREES] + statuses[SCATTER],
                "statuses": {status: count for status, count in statuses.items() if count},
                "status": next((status for status in WORST_FIRST if statuses[status]), NOT_JUDGED),
                "worst": worst["id"] if worst and worst["relative"] else "",
                "deviation": worst["relative"] if worst and worst["relative"] else None,
                "seeds": worst["seeds"] if worst else None,
                "choices": sum(choices(list(chosen), assumptions).values()),
            }
        )
    return rows
