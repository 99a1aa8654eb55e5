"""How a replay reads the signals of a run: exact, interpolated or held."""

from typing import Literal, NamedTuple


class Sampling(NamedTuple):
    """How a replay reads the signals u, x and v of a run, Fig. 6.

    By default they are interpolated linearly between all steps.
    """

    exact: bool = False  #: each stage has the signals of the full-order run at its own time; no samples
    held: bool = False  #: all stages of a step read one sample (zero-order hold); else linear interpolation
    next_at_end: bool = False  #: held, but a stage at the step's end reads the next sample
    #: Delay of u, x and v in samples; whole numbers where `held`.
    delay: tuple[float, float, float] = (0.0, 0.0, 0.0)
    every: int = 1  #: steps between samples

    @property
    def rule(self) -> Literal["exact", "linear", "hold", "hold_next"]:
        """Name of the rule, a key of `SAMPLINGS`; delay and time between samples are not part of it."""
        if self.exact:
            return "exact"
        return "linear" if not self.held else "hold_next" if self.next_at_end else "hold"


EXACT_SAMPLING = Sampling(exact=True)
INTERPOLATED = Sampling()
HELD = Sampling(held=True)
HELD_TO_NEXT = Sampling(held=True, next_at_end=True)
SAMPLINGS = {s.rule: s for s in (EXACT_SAMPLING, INTERPOLATED, HELD, HELD_TO_NEXT)}
