"""Labels that figures, tables and pages use for short names in results; experiments that figures show."""

from collections.abc import Collection

SAMPLING = {  # how the signals of a full-order run reach the replays -> label
    "published": "signals as in the paper",
    "exact": "exact signals",
    "linear": "interpolated",
    "hold": "held",
    "delay": "held, one sample late",
}
STUDY_SAMPLING = {name: SAMPLING[name] for name in ("published", "exact")}
ORIGINS = {  # of the numbers of a verdict's findings -> label
    "printed": "as printed",
    "published": f"reproduced, {SAMPLING['published']}",
    "exact": f"reproduced, {SAMPLING['exact']}",
}
SOURCES = {  # of a mean square error in Figs 8 to 11 -> label
    "published": "printed in the paper",
    "reproduced": "reproduced",
    "exact": f"reproduced, {SAMPLING['exact']}",
}
# Experiments that single figures show: the example of the paper, and one in which the sampling of the signals
# alone decides whether mixing pays.
SHOWN = {"fig07": "E14", "traces": "E06"}


def shown(figure: str, experiments: Collection[str]) -> str:
    """Name of the experiment that a figure shows; the first one if the study lacks the usual one."""
    return SHOWN[figure] if SHOWN[figure] in experiments else next(iter(experiments))
