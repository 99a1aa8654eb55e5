"""How each model is drawn, in figures and on pages; needs no plotting library."""

from typing import Any, NamedTuple


class Look(NamedTuple):
    """How one model is drawn; no two models share both line style and marker."""

    color: str
    linestyle: str | tuple[int, tuple[float, ...]]
    marker: str

    def line(self) -> dict[str, Any]:
        """Keywords for `Axes.plot`: the curve without markers."""
        return {"color": self.color, "linestyle": self.linestyle}

    def points(self) -> dict[str, Any]:
        """Keywords for `Axes.plot`: the curve with open markers."""
        return self.line() | {
            "marker": self.marker,
            "markerfacecolor": "white",
            "markeredgecolor": self.color,
        }


_DASH = (0, (5.0, 1.6))
_DOT = (0, (1.2, 1.2))
_DASH_DOT = (0, (5.0, 1.4, 1.2, 1.4))
_LONG = (0, (9.0, 2.0))
_SHORT = (0, (2.4, 1.2))
_DASH_DOT_DOT = (0, (5.0, 1.4, 1.2, 1.4, 1.2, 1.4))

# One hue per error level of Fig. 9 (blue: constant T; orange: polytropic T; bluish green: explicit heat
# transfer; grey: M4), and within a hue a ladder of lightness, so that the order survives a grey printer.
MODEL_STYLE: dict[str, Look] = {
    "M1": Look("#04194a", "-", "o"),
    "M2": Look("#2f74b5", _DASH, "s"),
    "M3": Look("#7fb3dc", _DASH_DOT, "^"),
    "M4": Look("#6b6b6b", _DOT, "X"),
    "M5": Look("#b8480b", "-", "D"),
    "M6": Look("#f0922f", _DASH, "v"),
    "M7": Look("#00503f", "-", "P"),
    "M8": Look("#007a62", _LONG, "<"),
    "M9": Look("#24a884", _SHORT, ">"),
    "M10": Look("#7ccfb3", _DASH_DOT_DOT, "h"),
}
OWN_ROW = Look("#7f7f7f", "-", "o")  # a model that is not the paper's
