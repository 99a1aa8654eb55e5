"""A valve that follows its command: first-order lag, dead time, null offset and dead band.

Not part of `Valve`, which is eq (2): there the opening is proportional to the command, without delay.
"""

from typing import NamedTuple


class ValveDynamics(NamedTuple):
    """How the opening of a valve follows its command; by default proportional, without delay."""

    lag: float = 0.0  #: time constant of the first-order lag, s
    dead_time: float = 0.0  #: time after which the valve sees its command, s; negative: before it was logged
    null: float = 0.0  #: command at which the valve is shut, V
    dead_band: float = 0.0  #: the valve stays shut for commands within this distance of `null`, V

    @property
    def proportional(self) -> bool:
        """Whether the opening equals the limited command, apart from a dead time."""
        return not (self.lag or self.null or self.dead_band)


PROPORTIONAL = ValveDynamics()


def opening_rate(u: float, opening: float, lag: float) -> float:
    """Rate of the opening behind a first-order lag, V/s, at the limited command u, V."""
    return (u - opening) / lag


def beyond_dead_band(u: float, null: float, dead_band: float) -> float:
    """Command that the restrictions see, V: the spool's position u, V, less null offset and dead band.

    It is 0 within the dead band.
    """
    u = u - null
    if not dead_band:
        return u
    if u > dead_band:
        return u - dead_band
    if u < -dead_band:
        return u + dead_band
    return 0.0
