"""The page of a verdict: one HTML file that loads nothing, for light and dark, wide and narrow screens.

First a line for each table and figure, then the facts, then each table with print and reproduction and each
figure with both; every number leads to its cell and its tolerance. Then errata and assumptions.
"""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

from paper_verdict.charts import LOGARITHM, chart_grid, curve_chart, point_charts
from paper_verdict.claims import UNITS_IN_TEXT
from paper_verdict.facts import (
    AGREES,
    BASES,
    EXPLAINED,
    MISPRINT,
    NOT_JUDGED,
    SCATTER,
    UNEXPLAINED,
    headline_text,
)
from paper_verdict.text import agree_text, cell_text, deviation_text, size_text, tolerance_text

LOOKS = {  # status -> class of the style sheet, symbol for readers without colour, and meaning
    AGREES: ("agrees", "=", "equal at the printed digits, or within its tolerance"),
    SCATTER: ("scatter", "≈", "other random numbers change it as much"),
    MISPRINT: ("misprint", "†", "a proof shows that the print is wrong"),
    EXPLAINED: ("explained", "≠", "for a reason that is stated, but not proved"),
    UNEXPLAINED: ("unexplained", "!", "no reason was found"),
    NOT_JUDGED: ("unjudged", "·", "cannot fail, or was not run"),
}
LONGEST_IN_GRID = 14  # characters of a result that is no number
Row = Mapping[str, Any]


def page(verdict: Mapping[str, Any], findings: str = "", evidence: Sequence[str] = ()) -> str:
    """Write the page of a verdict; the same verdict gives the same text.

    `findings` is HTML of the paper's own, shown after the overview; `evidence` has a text for each further
    file behind the verdict.
    """
    about = verdict["paper"]
    title = escape(about["title"])
    source = files("paper_verdict")
    style = source.joinpath("page.css").read_text(encoding="utf-8")
    script = source.joinpath("page.js").read_text(encoding="utf-8")
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        '<head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        f"<title>Verdict: {title}</title>",
        f"<style>\n{style}</style></head>",
        '<body><a class="skip" href="#lines">Skip to the overview</a>',
        *_header(verdict, about, findings),
        "<main>",
        *_lines(verdict),
        findings,
        *_facts(verdict, about),
        *_places(verdict),
        *_errata(verdict["errata"], about),
        *_assumptions(verdict["assumptions"]),
        "</main>",
        *_footer(about, evidence),
        f"<script>\n{script}</script>",
        "</body></html>",
        "",
    ]
    return "\n".join(parts)


def marked(text: str) -> str:
    """Escape a text; set indices, as in k_0, as subscripts, and names in backticks as code."""
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))
    return re.sub(r"\b([A-Za-z]|λ)_([A-Za-z0-9]+)\b", r"\1<sub>\2</sub>", text)


def _linked_words(text: str) -> str:
    """Escape a text as `marked` does; ``[words](address)`` become links."""
    return re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", r'<a href="\2">\1</a>', marked(text))


def badge(status: str, text: str = "") -> str:
    """A status as a coloured label."""
    look, symbol, meaning = LOOKS[status]
    return (
        f'<span class="badge {look}" title="{escape(meaning)}"><span aria-hidden="true">{symbol}</span> '
        f"{escape(text or status)}</span>"
    )


def _id(name: str) -> str:
    """Anchor of an item, fact or erratum: its name without spaces."""
    return escape(re.sub(r"\s", "_", name))


def _anchor(place: str) -> str:
    return "place-" + re.sub(r"\W+", "-", place.lower()).strip("-")


def _table(heads: Sequence[str], rows: Iterable[str], kind: str = "plain") -> str:
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in heads)
    body = "\n".join(rows)
    return (
        '<div class="scroll" tabindex="0"><table'
        f' class="{kind}"><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n'
        "</tbody></table></div>"
    )


def _header(verdict: Mapping[str, Any], about: Row, findings: str) -> Iterable[str]:
    yield "<header>"
    yield '<p class="kicker">paper-verdict</p>'
    yield f"<h1>{escape(about['title'])}: what is reproduced</h1>"
    yield f'<p class="sharpest">{escape(headline_text(verdict["headline"]))}</p>'
    if about["meaning"]:
        yield f"<p>{_linked_words(about['meaning'])}</p>"
    counts = verdict["headline"]["statuses"]
    legend = [f"<li>{badge(s, f'{counts[s]} {s}')} {escape(LOOKS[s][2])}</li>" for s in LOOKS if counts[s]]
    yield f'<ul class="legend">{"".join(legend)}</ul>'
    yield f"<p>{_words(verdict)}</p>"
    source = [about["authors"], about["journal"]]
    words = [escape(", ".join(filter(None, source)))]
    if about["doi"]:
        words.append(f'<a href="https://doi.org/{escape(about["doi"])}">doi:{escape(about["doi"])}</a>')
    lead = ", ".join(filter(None, words))
    others = "".join(
        f' Another paper: <a href="{escape(address)}">{escape(name)}</a>.'
        for name, address in about["others"].items()
    )
    lead += ". " if lead else ""
    yield f"<p>{lead}{marked(about['how'])}{others}</p>"
    titles = re.findall(r'class="finding".*?<h2 id="([^"]+)">(.*?)</h2>', findings, re.DOTALL)
    links = [f'<li><a href="#{name}">{title}</a></li>' for name, title in titles]
    if links:
        yield f"<ul>{''.join(links)}</ul>"
    if verdict["study"]:
        yield (
            f'<p class="warning"><strong>This is “{escape(verdict["study"])}”, not the paper\'s own'
            " study:</strong>"
            " what needs another run is not judged.</p>"
        )
    for name, reason in verdict["failures"].items():
        yield f'<p class="warning"><strong>{escape(name)}:</strong> {escape(reason)}.</p>'
    yield "</header>"


def _words(verdict: Mapping[str, Any]) -> str:
    """What the words of the headline mean, as far as they occur."""
    headline = verdict["headline"]
    count = len(verdict["items"])
    judged = sum(place["judged"] for place in verdict["places"])
    left = ""
    if judged < count:
        set_up = sum(place["set_up"] for place in verdict["places"])
        kind = "are inputs, which cannot fail" if set_up == count - judged else "are inputs or were not run"
        left = f"; the others {kind}"
    scatter = ""
    if headline["statuses"][SCATTER]:
        scatter = " Numbers outside their tolerance still agree if other random numbers change them as much."
    text = (
        f"A <b>fact</b> is one thing that the paper says; it is as good as its worst number.{scatter}"
        f" Of the paper's numbers and statements {count} were collected, and {judged} of them judged{left}."
    )
    if headline["choices"]:
        text += (
            ' A <b>free choice</b> is a value or rule that <a href="#assumptions">the paper leaves open</a>'
            " and that was chosen with printed numbers in view."
        )
    if headline["predictions"]:
        text += " A <b>prediction</b> is a fact for which none was made."
    return text


def _lines(verdict: Mapping[str, Any]) -> Iterable[str]:
    """A line for each table and figure with a verdict, and one for all others."""
    yield '<section aria-labelledby="lines"><h2 id="lines">Table by table, figure by figure</h2>'
    measures = {item["tolerance"]["measure"] for item in verdict["items"]}
    other = "; for a mean error, of σ" if "sigma" in measures else ""
    if any(item["unit"].startswith(LOGARITHM) for item in verdict["items"]):
        other += "; where the logarithm of a number is printed, of the number itself"
    yield (
        "<p>Here numbers are counted. A deviation is reproduced minus printed, in per cent of the printed"
        f" number{other}. The largest of all deviations may be that of a number that agrees.</p>"
    )
    yield _table(
        ["of the paper", "result", "largest of all deviations", "free choices", "file"],
        [_line(place, verdict["headline"]["choices"]) for place in verdict["places"] if place["judged"]],
        "plain lines",
    )
    others: dict[str, list[str]] = {}
    for place in verdict["places"]:
        if not place["judged"]:
            others.setdefault(agree_text(place), []).append(_linked(place))
    if others:
        listed = "; ".join(f"{', '.join(names)} ({marked(says)})" for says, names in others.items())
        yield f'<p class="rest">Without a verdict: {listed}.</p>'
    yield "</section>"


def _linked(place: Row) -> str:
    """Name of a place, with a link to its part of the page, else to its file."""
    address = f"#{_anchor(place['name'])}" if place["items"] or place["draws"] else place["link"]
    name = escape(place["name"])
    return f'<a href="{escape(address)}">{name}</a>' if address else name


def _line(place: Row, choices: int) -> str:
    largest = ""
    if place["worst"]:
        link = f'<a href="#{_id(place["worst"])}">{escape(place["worst"])}</a>'
        largest = f"{deviation_text(place['deviation'])} ({link})"
    chosen = ""
    if place["choices"]:
        chosen = f'<a href="#assumptions">{place["choices"]} of {choices}</a>'
    picture = ""
    if place["link"]:
        picture = f'<a href="{escape(place["link"])}">{escape(place["link"].rpartition("/")[2])}</a>'
    cells = {
        "": f"{badge(place['status'])} {marked(agree_text(place))}",
        "largest of all deviations": largest,
        "free choices": chosen,
        "file": picture,
    }
    return f'<tr><th scope="row">{_linked(place)}</th>{_labelled(cells.items())}</tr>'


def _places(verdict: Mapping[str, Any]) -> Iterable[str]:
    """Each table with print and reproduction, each figure with both curves, and statements."""
    yield '<section aria-labelledby="places"><h2 id="places">Print and reproduction</h2>'
    yield (
        "<p>In each cell the print is above and the reproduction below it, coloured by status."
        " Select a number to see its file, its place in the file, and its tolerance.</p>"
    )
    errata = {erratum["id"]: erratum for erratum in verdict["errata"]}
    for place in verdict["places"]:
        items = [item for item in verdict["items"] if item["place"] == place["name"]]
        curves = [curve for curve in verdict["curves"] if f"Fig. {curve['figure']}" == place["name"]]
        points = [item for item in verdict["items"] if item["id"] in place["draws"]]
        if place["name"].startswith("Fig.") and not curves:
            points += [item for item in items if item["row"]]
        if not (items or curves or points):
            continue
        yield f'<section id="{_anchor(place["name"])}"><h3>{escape(place["name"])}</h3>'
        yield f"<p>{badge(place['status']) if items else ''} {marked(agree_text(place))}</p>"
        if curves:
            yield chart_grid(map(curve_chart, curves), "band")
        if points:
            yield chart_grid(point_charts(points, place["linear"]), "points")
        yield from _items(items, errata)
        yield "</section>"
    yield "</section>"


def _items(items: Sequence[Row], errata: Mapping[str, Row]) -> Iterable[str]:
    """The items of a place as a table, and one by one."""
    yield from _grids([item for item in items if item["row"]])
    if items:
        yield f"<details><summary>Each of the {len(items)}: place, tolerance, deviation</summary>"
        heads = ["item", "printed", "reproduced", "deviation", "status", "from, within"]
        yield _table(heads, (_item_row(item, errata) for item in items), "plain items")
        yield "</details>"


def _grids(cells: Sequence[Row]) -> Iterable[str]:
    """A table of a place's cells, laid out as printed; groups where a row and a column are not enough."""
    if not cells:
        return
    keys = _telling_keys(cells)
    columns = list(dict.fromkeys(item["column"] for item in cells))
    if keys and len(columns) == 1:  # rows by key
        columns = list(dict.fromkeys(_group(item, keys) for item in cells))
        by_place = {(item["row"], _group(item, keys), ""): item for item in cells}
        groups = [""]
    else:
        by_place = {(item["row"], item["column"], _group(item, keys)): item for item in cells}
        groups = list(dict.fromkeys(_group(item, keys) for item in cells))
    units = {column: _unit_of_column(column, by_place) for column in columns}
    head = "".join(
        f'<th scope="col">{marked(column)}{f"<small>{escape(unit)}</small>" if unit else ""}</th>'
        for column, unit in units.items()
    )
    rows: list[str] = []
    for group in groups:
        if group:
            rows.append(
                f'<tr class="group"><th colspan="{len(columns) + 1}"'
                f' scope="rowgroup">{marked(group)}</th></tr>'
            )
        for row in dict.fromkeys(item["row"] for item in cells):
            members = [by_place.get((row, column, group)) for column in columns]
            if any(members):
                body = "".join(_cell(item) if item else '<td class="empty"></td>' for item in members)
                rows.append(f'<tr><th scope="row">{marked(row)}</th>{body}</tr>')
    yield f'<div class="scroll" tabindex="0"><table class="grid"><thead><tr><th></th>{head}</tr></thead>'
    yield "<tbody>" + "\n".join(rows) + "</tbody></table></div>"


def _telling_keys(cells: Sequence[Row]) -> list[str]:
    """Fewest keys that tell apart cells with the same row and column."""
    names = list(dict.fromkeys(key for item in cells for key in item["keys"]))

    def unique(keys: Sequence[str]) -> bool:
        places = [(i["row"], i["column"], *(i["keys"].get(key, "") for key in keys)) for i in cells]
        return len(set(places)) == len(places)

    if unique([]):
        return []
    return next(([name] for name in names if unique([name])), names)


def _group(item: Row, keys: Sequence[str]) -> str:
    values = [item["keys"].get(key, "") for key in keys]
    return ", ".join(f"{k} {v}" if re.match(r"[-+\d.]", v) else v for k, v in zip(keys, values, strict=True))


def _unit_of_column(column: str, by_place: Mapping[tuple[str, ...], Row]) -> str:
    """Unit of a column's cells, with the power of ten in its heading; empty if they differ."""
    units = {_unit(item) for place, item in by_place.items() if place[1] == column}
    return units.pop() if len(units) == 1 else ""


def _unit(item: Row) -> str:
    unit: str = UNITS_IN_TEXT.get(item["unit"]) or ("" if item["unit"] in UNITS_IN_TEXT else item["unit"])
    if item["scale"] in (1, 0.01):
        return unit
    exponent = round(math.log10(item["scale"]), 9)
    power = "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(d)] if d.isdigit() else "⁻" for d in f"{exponent:g}")
    return f"10{power} {unit}".strip() if exponent.is_integer() else f"{item['scale']:g} {unit}".strip()


def _cell(item: Row) -> str:
    look = LOOKS[item["status"]][0]
    shown = _shown(item)
    tip = escape(f"{item['id']}: {item['status']}", quote=True)
    return (
        f'<td class="{look}"><a href="#{_id(item["id"])}" title="{tip}">{marked(item["printed"])}'
        f"<b>{marked(shown)}</b></a></td>"
    )


def _shown(item: Row) -> str:
    """The reproduction in a cell: the number without its unit, or a short word."""
    if isinstance(item["reproduced"], (int, float)) and not isinstance(item["reproduced"], bool):
        return item["shown"].split(" ", 1)[0]
    if item["reproduced"] in (True, False):
        return "✓" if item["reproduced"] else "✗"
    return item["shown"] if len(item["shown"]) <= LONGEST_IN_GRID else LOOKS[item["status"]][1]


def _item_row(item: Row, errata: Mapping[str, Row]) -> str:
    name = f"<code>{escape(item['id'])}</code>"
    if item["statement"]:
        name += f" {marked(item['statement'])}"
    name += f"<small>{marked(item['where'])}</small>"
    unit = "" if item["scale"] == 1 else f" {_unit(item)}"
    printed = marked(item["printed"]) + (
        f" ({marked(item['meant'])} meant)" if item["meant"] != item["printed"] else ""
    )
    off = deviation_text(item["relative"])
    if item["seeds"] is not None:
        off += f"<small>{item['seeds']:+.1f} seed deviations</small>"
    status = badge(item["status"])
    if item["reason"] and item["status"] != AGREES:
        status += f" {marked(item['reason'])}"
    for erratum in item["errata"]:
        if erratum in errata:
            status += f' <a href="#erratum-{_id(erratum)}">erratum</a>'
    for source, found in item["also"].items():
        if found and found["holds"] is False and not item["row"] and item["agreement"]:
            status += f' <span class="tag">not true by {escape(source)}</span>'
    cell = f"{marked(tolerance_text(item))}<small>{escape(cell_text(item))}</small>"
    shown = marked(item["shown"]) + (escape(unit) if item["scale"] not in (1, 0.01) else "")
    cells = [
        ("printed", printed + escape(unit)),
        ("reproduced", shown),
        ("deviation", off),
        ("", status),
        ("", cell),
    ]
    return f'<tr id="{_id(item["id"])}"><th scope="row">{name}</th>{_labelled(cells)}</tr>'


def _labelled(cells: Iterable[tuple[str, str]]) -> str:
    """Cells of a row with the label that a narrow screen shows before them."""
    return "".join(
        f'<td data-label="{label}">{text}</td>' if label and text else f"<td>{text}</td>"
        for label, text in cells
    )


def _facts(verdict: Mapping[str, Any], about: Row) -> Iterable[str]:
    """Facts that differ, worst first; those that agree are folded."""
    yield '<section aria-labelledby="facts"><h2 id="facts">Facts, worst first</h2>'
    failed = [
        fact
        for fact in verdict["facts"]
        if fact["basis"] == "prediction" and fact["status"] in (UNEXPLAINED, EXPLAINED, MISPRINT)
    ]
    if failed:
        links = "; ".join(f'<a href="#fact-{_id(f["name"])}">{marked(f["says"])}</a>' for f in failed)
        yield f"<p>Predictions that did not come out: {links}.</p>"
    words = (
        "A seed deviation is the standard deviation over other random numbers. Tolerances differ from number"
        " to number, so that a smaller deviation may differ where a larger one agrees. An assumption with"
        " several values counts as one free choice for each value."
    )
    if any(fact["chosen"] for fact in verdict["facts"]):
        words += (
            " Facts for which the same free choices were made share the degrees of freedom that these cost."
        )
    if about["tolerances"]:
        words += f" Tolerances: {marked(about['tolerances'])}."
    yield f"<p>{words}</p>"
    shared = Counter(tuple(fact["chosen"]) for fact in verdict["facts"] if fact["chosen"])
    groups = [chosen for chosen, count in shared.items() if count > 1]
    for number, chosen in enumerate(groups, 1):
        yield f'<p id="choices-{number}">Free choices, group {number}: {_choice_links(chosen)}.</p>'
    folded = [fact for fact in verdict["facts"] if fact["status"] in (AGREES, NOT_JUDGED)]
    yield from (_fact(fact, verdict, groups) for fact in verdict["facts"] if fact not in folded)
    if folded:
        yield f"<details><summary>{len(folded)} that agree or are not judged</summary>"
        yield from (_fact(fact, verdict, groups) for fact in folded)
        yield "</details>"
    yield "</section>"


def _choice_links(names: Iterable[str]) -> str:
    return ", ".join(f'<a href="#assumption-{_id(name)}">{escape(name)}</a>' for name in names)


def _fact(fact: Row, verdict: Mapping[str, Any], groups: Sequence[tuple[str, ...]]) -> str:
    """A fact with its numbers; free choices of several facts are listed once, as one of the `groups`."""
    members = [item for item in verdict["items"] if item["fact"] == fact["name"]]
    links = ", ".join(f'<a href="#{_id(i["id"])}">{escape(i["id"])}</a>' for i in members)
    chosen = _choice_links(fact["chosen"])
    if tuple(fact["chosen"]) in groups:
        number = groups.index(tuple(fact["chosen"])) + 1
        chosen = f'<a href="#choices-{number}">group {number}</a> (listed above)'
    spent = (
        f" Free choices: {chosen}. They use up {fact['spent']} of the {fact['items']} degrees of freedom of"
        " this fact's numbers."
    )
    why = f"{marked(fact['why'])}. " if fact["why"] else ""
    return (
        f'<details class="fact" id="fact-{_id(fact["name"])}"><summary>{badge(fact["status"])}'
        f" <span>{marked(fact['says'])}</span> <small>{escape(size_text(fact))}</small></summary>"
        f"<p>{why}{fact['basis'].capitalize()}:"
        f" {escape(BASES[fact['basis']])}.{spent if chosen else ''}</p><p>{links}</p></details>"
    )


def _errata(errata: Sequence[Row], about: Row) -> Iterable[str]:
    yield f'<details><summary><h2 id="errata">Errata: {len(errata)}</h2></summary>'
    functions = (
        f"; the checks are functions of <code>{escape(about['proofs'])}</code>" if about["proofs"] else ""
    )
    yield (
        "<p>Each proof checks the paper's own numbers and formulas, and ran with this"
        f" verdict{functions}. A suspected"
        " misprint is inferred from the results: it may explain a difference, but it proves nothing.</p>"
    )
    rows: list[str] = []
    for erratum in errata:
        outcome = {
            True: badge(AGREES, "likely" if erratum["items"] else "proved"),
            False: badge(UNEXPLAINED, "false"),
        }
        shown = outcome.get(erratum["passes"], "open:")
        rows.append(
            f'<tr id="erratum-{_id(erratum["id"])}"><th scope="row">{escape(erratum["id"])}<br>'
            f"<small>{escape(erratum['kind'])}</small></th>"
            f"<td>{marked(erratum['where'])}</td><td>{marked(erratum['printed'])}</td>"
            f'<td>{marked(erratum["meant"])}</td><td class="words">{shown}'
            f" {escape(erratum['evidence'])}</td></tr>"
        )
    yield _table(["erratum", "where", "printed", "meant", "proof"], rows)
    yield "</details>"


def _assumptions(assumptions: Mapping[str, Row]) -> Iterable[str]:
    count = len(assumptions)
    title = f"What the paper leaves open, and what was assumed: {count}"
    yield f'<details><summary><h2 id="assumptions">{title}</h2></summary>'
    rows: list[str] = []
    for name, entry in assumptions.items():
        value = entry["value"]
        shown = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
        shown = f"{shown} {entry['unit']}".strip()
        others = "; ".join(entry["alternatives"]) or "none"
        rows.append(
            f'<tr id="assumption-{_id(name)}"><th'
            f' scope="row">{escape(name)}</th><td>{marked(entry["open"])}</td>'
            f"<td>{escape(shown)}</td><td>{marked(entry['basis'])}</td><td>{escape(others)}</td></tr>"
        )
    yield _table(["assumption", "left open", "assumed", "basis", "alternatives"], rows)
    yield "</details>"


def _footer(about: Row, evidence: Sequence[str]) -> Iterable[str]:
    yield f"<footer><p>Made by paper-verdict. {marked(about['footer'])}</p>"
    if evidence:
        yield f"<p>Evidence beside the study: {escape('; '.join(evidence))}.</p>"
    yield "</footer>"
