"""How each model is drawn, in figures and on pages; needs no plotting library."""

import itertools
from collections.abc import Iterable
from typing import NamedTuple

from pneumo.physics.models import MODELS
from pneumo.selection.error_budget import FULL_ORDER

LineStyle = str | tuple[int, tuple[float, ...]]


class Look(NamedTuple):
    """How one model is drawn."""

    color: str
    linestyle: LineStyle


_DASH = (0, (5.0, 1.6))
_DOT = (0, (1.2, 1.2))
_DASH_DOT = (0, (5.0, 1.4, 1.2, 1.4))
_LONG = (0, (9.0, 2.0))
_SHORT = (0, (2.4, 1.2))
_DASH_DOT_DOT = (0, (5.0, 1.4, 1.2, 1.4, 1.2, 1.4))

# One hue per error level of Fig. 9 (blue: constant T; orange: polytropic T; bluish green: explicit heat
# transfer; grey: M4), and within a hue a ladder of lightness, so that the order survives a grey printer.
# M7 is violet: it has explicit heat transfer without mixing, and as a dark green it looked like M8.
PAPER_LOOKS: dict[str, Look] = {
    "M1": Look("#04194a", "-"),
    "M2": Look("#2f74b5", _DASH),
    "M3": Look("#7fb3dc", _DASH_DOT),
    "M4": Look("#6b6b6b", _DOT),
    "M5": Look("#b8480b", "-"),
    "M6": Look("#f0922f", _DASH),
    "M7": Look("#452a86", "-"),
    "M8": Look("#007a62", _LONG),
    "M9": Look("#24a884", _SHORT),
    "M10": Look("#7ccfb3", _DASH_DOT_DOT),
}
# Models added to the paper's: hues that no model of the paper has, in 12 different pairs with these lines.
_COLORS = ("#8a6d1f", "#c51b7d", "#1b7f8a")
_LINES: tuple[LineStyle, ...] = ("-", _DASH, _DASH_DOT, _LONG)


def looks_of(models: Iterable[str]) -> dict[str, Look]:
    """Return the look of each model: the paper's, or for an added model the next free one."""
    free = map(Look, itertools.cycle(_COLORS), itertools.cycle(_LINES))
    return {name: PAPER_LOOKS.get(name) or next(free) for name in models}


MODEL_LOOKS = looks_of(MODELS)
FULL_ORDER_LOOK = Look("#a3186b", "-")
ADDED_MODELS = [name for name in MODELS if name not in PAPER_LOOKS]

DARK = "#161616"  # background of the pages' dark form
CONTRAST = 4.5  # lowest of a curve with `DARK`, by WCAG 2


def luminance(color: str) -> float:
    """Relative luminance of a colour #rrggbb, from 0 (black) to 1, by WCAG 2."""
    channels = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return sum(weight * c for weight, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def on_dark(color: str) -> str:
    """Mix a colour #rrggbb with white until its contrast with `DARK` is at least `CONTRAST`."""
    channels = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
    for percent in range(0, 101, 5):
        mixed = "#" + "".join(f"{round(c + (255 - c) * percent / 100):02x}" for c in channels)
        if (luminance(mixed) + 0.05) / (luminance(DARK) + 0.05) >= CONTRAST:
            return mixed
    return "#ffffff"


def colours() -> dict[str, tuple[str, str]]:
    """Colours of each model, and of the full order, on light and on dark ground."""
    looks = MODEL_LOOKS | {FULL_ORDER: FULL_ORDER_LOOK}
    return {name: (look.color, on_dark(look.color)) for name, look in looks.items()}
