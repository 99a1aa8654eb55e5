"""The scheme of a rig on rig.md: volumes of gas and restrictions, with the names of the file's quantities."""

from pneumo.fit.rig.rig_file import QUANTITIES

MIDDLE, EXHAUST = 80, 290  # y of the line from the supply to the chamber, x of that to the atmosphere
TOP, WIDTH, HEIGHT = -75, 780, 405
NODES = (  # x, y, width, height, head, quantities
    (10, 55, 90, 50, "source", ("P_s",)),
    (150, 55, 105, 50, "supply", ("supply_volume",)),
    (325, 55, 95, 50, "hose", ("hose_volume",)),
    (475, 35, 130, 90, "chamber, or vessel", ("dead_volume", "bore", "volume")),
    (660, 0, 115, 36, "wall", ("T_surroundings",)),
    (660, 120, 115, 36, "heat store", ("store_c",)),
    (EXHAUST - 60, -70, 120, 36, "atmosphere", ("P_surroundings",)),
    (EXHAUST - 60, 185, 120, 50, "silencer", ("silencer_volume",)),
    (EXHAUST - 60, 285, 120, 36, "atmosphere", ("P_surroundings",)),
)
RESTRICTIONS = (  # x, y, whether the flow is upright, quantities
    (125, MIDDLE, False, ("regulator_C", "regulator_b")),
    (EXHAUST - 18, MIDDLE, False, ("valve_C_in", "valve_b")),
    (447, MIDDLE, False, ("hose_C", "hose_b")),
    (EXHAUST, 150, True, ("valve_C_out", "valve_b_out")),
    (EXHAUST, 260, True, ("silencer_C", "silencer_b")),
    (EXHAUST, 5, True, ("orifice", "C_d", "orifice_b")),
)
LINES = (  # points of the pipes
    "100,80 150,80",
    "255,80 325,80",
    "420,80 475,80",
    f"{EXHAUST},80 {EXHAUST},185",
    f"{EXHAUST},235 {EXHAUST},285",
    f"{EXHAUST},-34 {EXHAUST},80",
)
HEAT = (  # points of a conductance, place of its name, name
    ("605,55 660,25", (610, 24), "k_0"),
    ("605,105 660,135", (585, 145), "store_k"),
    ("718,36 718,120", (640, 82), "store_back"),
)
OPEN_TO_SURROUNDINGS = ("source", "wall", "atmosphere")  # drawn dashed
DESCRIPTION = (
    "From left to right: a source at constant pressure, a regulator, the supply's volume, the on/off valve's"
    " way in, the hose's volume, the hose's conductance, and the chamber or vessel with wall and heat store."
    " From the valve down: its way out, the silencer's volume, its conductance, the atmosphere. Instead of"
    " the valve there may be an orifice to the atmosphere."
)


def _label(x: float, y: float, text: str, *, head: bool = False, anchor: str = "middle") -> str:
    """A text; the name of a quantity in another face than what a part is called."""
    if not head and text not in QUANTITIES:
        raise ValueError(f"{text}: no quantity of a rig")
    face = "" if head else ' font-family="monospace"'
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}"{face}>{text}</text>'


def _node(x: int, y: int, width: int, height: int, head: str, names: tuple[str, ...]) -> list[str]:
    """A volume of gas, or what is never emptied or warmed."""
    dashes = ' stroke-dasharray="4 3"' if head in OPEN_TO_SURROUNDINGS else ""
    box = f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="5"{dashes}/>'
    texts = [(head, True), *((name, False) for name in names)]
    first = y + height / 2 + 4 - 7 * (len(texts) - 1)
    return [
        box,
        *(
            _label(x + width / 2, first + 14 * row, text, head=is_head)
            for row, (text, is_head) in enumerate(texts)
        ),
    ]


def _restriction(x: int, y: int, upright: bool, names: tuple[str, ...]) -> list[str]:
    """Two arcs that leave a throat, and its quantities: below, or beside where the flow is upright."""
    turned = f' transform="rotate(90 {x} {y})"' if upright else ""
    arcs = f'<path d="M{x - 8},{y - 9} q8,6 16,0 M{x - 8},{y + 9} q8,-6 16,0"{turned}/>'
    left, first, anchor = (x + 14, y - 3, "start") if upright else (x + 10, y + 40, "end")
    return [arcs, *(_label(left, first + 14 * row, name, anchor=anchor) for row, name in enumerate(names))]


def rig_scheme() -> str:
    """The scheme as SVG in a page, with a description for those who do not see it."""
    parts = [f'<polyline points="{points}"/>' for points in LINES]
    parts += [part for node in NODES for part in _node(*node)]
    parts += [part for restriction in RESTRICTIONS for part in _restriction(*restriction)]
    for points, (x, y), name in HEAT:
        parts += [f'<polyline points="{points}" stroke-dasharray="2 3"/>', _label(x, y, name, anchor="start")]
    head = (
        f'<svg viewBox="0 {TOP} {WIDTH} {HEIGHT}" width="{WIDTH}" role="img" aria-labelledby="rig-scheme"'
        ' fill="none" stroke="currentColor" font-size="12"'
        f' style="color: var(--color-foreground-primary)"><desc id="rig-scheme">{DESCRIPTION}</desc>'
        "<style>text { fill: currentColor; stroke: none }</style>"
    )
    scrolls = '<div style="overflow-x: auto" tabindex="0">'
    return "\n".join(["```{raw} html", scrolls + head, *parts, "</svg></div>", "```"])
