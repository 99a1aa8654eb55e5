"""How a replay reads the signals of a run: exact, interpolated or held."""

from typing import Literal, NamedTuple


class Sampling(NamedTuple):
    """How a replay reads the signals u, x and v of a run, Fig. 6.

    By default they are interpolated linearly between all steps.
    """

    #: exact: each stage has the signals of the full-order run at its own time; hold: all stages of a step
    #: read one sample; hold_next: likewise, but a stage at the step's end reads the next one.
    rule: Literal["exact", "linear", "hold", "hold_next"] = "linear"
    #: Delay of u, x and v in samples; whole numbers where they are held.
    delay: tuple[float, float, float] = (0.0, 0.0, 0.0)
    every: int = 1  #: steps between samples


EXACT_SAMPLING = Sampling("exact")
INTERPOLATED = Sampling("linear")
HELD = Sampling("hold")
