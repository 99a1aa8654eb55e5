"""The verdict as text for a terminal of 80 columns: counts, then what disagrees, largest deviation first."""

from collections.abc import Iterator, Mapping
from typing import Any

from pneumo.publish.text.formatting import percent_text
from pneumo.verdict.judging import NEAR_MISS, STATUSES

DISAGREEING = ("missed", "contradicted")


def verdict_lines(judged: Mapping[str, Any]) -> Iterator[str]:
    """Lines for `pneumo.verdict.judging.verdict`: counts by kind of evidence, and items that disagree."""
    yield f"{'':16}" + "".join(f"{key:>{max(6, len(key) + 1)}}" for key in ("items", *STATUSES))
    rows = {"all": judged["counts"]} | judged["counts_by_basis"]
    facts = {f"{basis}, facts": judged["headline"][basis] for basis in ("measured", "fitted")}
    for name, counts in (rows | facts).items():
        yield f"{name:16}" + "".join(f"{counts[key]:{max(6, len(key) + 1)}}" for key in ("items", *STATUSES))
    missed = judged["counts"]["missed"]
    yield f"missed by at most {percent_text(NEAR_MISS)}: {judged['near_misses']} of {missed}"
    items = [item for item in judged["items"] if item["status"] in DISAGREEING]
    if not items:
        return
    yield f"\n{'deviation':>10}  {'':12}  {'item':26}  {'printed':>9}  reproduced"
    for item in sorted(items, key=_size, reverse=True):
        deviation = "" if item["relative"] is None else f"{100 * item['relative']:+.1f} %"
        printed = item["meant"] if len(item["meant"]) <= 9 else ""  # words are in `pneumo paper explain`
        line = f"{deviation:>10}  {item['status']:12}  {item['id']:26}  {printed:>9}  "
        yield (line + (item["shown"].split()[0] if isinstance(item["reproduced"], float) else "")).rstrip()


def _size(item: Mapping[str, Any]) -> float:
    """Size of the deviation; statements, which have none, come last."""
    return -1.0 if item["relative"] is None else abs(item["relative"])
