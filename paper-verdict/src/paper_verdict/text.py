"""The verdict as text for a terminal of 80 columns, and as annotations of GitHub."""

import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from paper_verdict.facts import AGREES, BASES, MISPRINT, NOT_JUDGED, SCATTER, headline_text

WIDTH = 80
TEXT_WIDTH = 100
PROVED = {True: "holds", False: "FAILS", None: "open"}


def verdict_lines(judged: Mapping[str, Any]) -> Iterator[str]:
    """Lines of a verdict: headline, tables and figures, and the facts that do not plainly agree."""
    yield textwrap.fill(headline_text(judged["headline"]), WIDTH)
    yield ""
    yield from place_lines(judged["places"])
    for status in dict.fromkeys(fact["status"] for fact in judged["facts"]):
        if status in (AGREES, NOT_JUDGED):
            continue
        yield f"\n{status}"
        for fact in judged["facts"]:
            if fact["status"] == status:
                text = f"{fact['says']} ({size_text(fact)})" if size_text(fact) else fact["says"]
                yield textwrap.fill(text, WIDTH, initial_indent="  ", subsequent_indent="    ")


def place_lines(places: list[dict[str, Any]]) -> Iterator[str]:
    """A line for each table and figure."""
    width = max((len(place["name"]) for place in places), default=0)
    for place in places:
        parts = [agree_text(place)]
        if place["worst"]:
            parts.append(f"worst {deviation_text(place['deviation'])} ({place['worst']})")
        if place["choices"]:
            parts.append(f"free choices: {place['choices']}")
        text = f"{place['name']:{width}}  {'; '.join(filter(None, parts))}"
        yield textwrap.fill(text, WIDTH, subsequent_indent=" " * (width + 4), break_long_words=False)


def agree_text(place: Mapping[str, Any]) -> str:
    """How many numbers of a table or figure agree, and what became of the others."""
    if not place["items"]:
        return place["says"] or "nothing to judge"
    if not place["judged"]:
        kind = f"{place['set_up']} inputs, equal" if place["set_up"] == place["items"] else "not judged"
        return f"{place['says']}: {kind}" if place["says"] else kind
    statuses = place["statuses"]
    text = f"{place['agree']} of {place['judged']} agree"
    if SCATTER in statuses:
        text += f", {statuses[SCATTER]} of them within the seeds' scatter"
    for status, count in statuses.items():
        if status not in (AGREES, SCATTER):
            word = {MISPRINT: "misprint" + "s" * (count > 1)}.get(
                status, status.replace("differs", "differ" + "s" * (count == 1))
            )
            text += f"; {count} {word}"
    if left := place["items"] - place["judged"] - place["set_up"]:
        text += f"; {left} not judged"
    return text


def size_text(fact: Mapping[str, Any]) -> str:
    """Size of a fact's deviation: agreeing items, chi-square, largest deviation in per cent and in seeds'."""
    parts = [f"{fact['agree']} of {fact['judged']} within tolerance" if fact["judged"] > 1 else ""]
    if fact["judged"] < fact["items"]:
        parts.append(f"{fact['items'] - fact['judged']} not run")
    if fact["chi_square"] is not None:
        parts.append(f"χ² {fact['chi_square']:.0f} for {fact['left']:.0f} degrees of freedom")
    if fact["largest"]:
        which = "largest of all deviations" if fact["judged"] > 1 else "deviation"
        parts.append(f"{which} {deviation_text(fact['largest'])}")
    if fact["seeds"]:
        parts.append(f"at most {fact['seeds']:.1f} seed deviations")
    return "; ".join(filter(None, parts))


def deviation_text(relative: float | None) -> str:
    """Deviation in per cent; empty without a number."""
    if relative is None:
        return ""
    text = f"{100 * relative:+.2f}" if abs(relative) < 0.1 else f"{100 * relative:+.0f}"
    return f"{'0' if float(text) == 0 else text} %"


def tolerance_text(item: Mapping[str, Any]) -> str:
    """The tolerance of an item in words."""
    tolerance = item["tolerance"]
    limit = tolerance["limit"]
    words = {
        "absolute": f"within {limit:g}" if limit else "as printed, to half a unit of the last digit",
        "relative": f"within {100 * limit:g} %",
        "sigma": f"within {limit:g} sigma",
        "swing": f"within {100 * limit:g} % of the change during the run",
        "truth": "true",
        "log10": f"against {limit:g} decades",
        "index": f"within {limit:g}, where that costs little",
    }[tolerance["measure"]]
    if tolerance["floor"]:
        words += f", at least {tolerance['floor']:g}"
    if tolerance["seeds"]:
        words += f", and {tolerance['seeds']:g} of the deviation over seeds"
    if tolerance["sense"] != "equal":
        words = f"{tolerance['sense'].replace('_', ' ')}; {words}"
    return f"{words} (class {tolerance['class']})"


def cell_text(item: Mapping[str, Any]) -> str:
    """Where the reproduced number of an item is: file, variable and selection, or the computation."""
    evidence = item["evidence"]
    computed = f"computed by {evidence['compute']}" if evidence["compute"] else ""
    read = ": ".join(filter(None, (evidence["path"], evidence["select"])))
    return "; ".join(filter(None, (read, computed)))


def item_text(item: Mapping[str, Any], errata: Mapping[str, Any]) -> str:
    """Text of a judged item: claim, reproduced value, status, reason; `errata` are the verdict's by name."""
    scale = "" if item["scale"] in (1, 0.01) else f" x {item['scale']:g}"
    status = item["status"]
    if item["agreement"] is None and item["relative"] is not None:
        status += f", {deviation_text(item['relative'])}"
    lines = [
        ("where", item["where"]),
        ("claim", item["statement"]),
        ("printed", f"{item['printed']}{scale} {item['unit']}".strip()),
        ("reproduced", item["shown"] or "nothing"),
        ("status", status),
        ("reason", item["reason"]),
        ("tolerance", tolerance_text(item)),
        ("basis", f"{item['basis']}: {BASES[item['basis']]}"),
        ("fact", item["fact"]),
        ("seeds", "" if item["seeds"] is None else f"{item['seeds']:+.2g} standard deviations over seeds"),
    ]
    for source, found in item["also"].items():
        if found and found["holds"] is not None:
            words = "true" if found["holds"] else "not true"
            lines.append((f"by {source}", f"{words}: {found['shown']}" if found["shown"] else words))
    for name in item["errata"]:
        erratum = errata[name]
        lines.append(("erratum", f"{name}: {erratum['printed']} -> {erratum['meant']}"))
        label = "indication" if erratum["items"] else "proof"  # with items of its own it is only suspected
        lines.append((label, f"{PROVED[erratum['passes']]}: {erratum['evidence']}"))
    lines += [("print", item["source"]), ("evidence", cell_text(item))]
    wrapped = textwrap.TextWrapper(TEXT_WIDTH, subsequent_indent=" " * 16, break_long_words=False)
    filled = (wrapped.fill(f"  {label:14}{text}") for label, text in lines if text)
    return "\n".join([item["id"], *filled])


def annotation(kind: str, source: str, title: str, text: str) -> str:
    """One annotation of GitHub: `kind` is error, warning or notice; `source` a file and line."""
    file, _, line = source.rpartition(":")
    if not line.isdigit():
        file, line = source, ""
    place = f"file={_escaped(file, ':,')}" + (f",line={line}" if line else "")
    return f"::{kind} {place},title={_escaped(title, ':,')}::{_escaped(text)}"


def _escaped(text: str, more: str = "") -> str:
    for character in f"%\r\n{more}":
        text = text.replace(character, f"%{ord(character):02X}")
    return text
