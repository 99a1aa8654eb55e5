"""Cylinder: chamber volume, heat transfer area and Newton's law, section 2.2.

A chamber sees the piston position that enlarges it: x for chamber A, -x for chamber B.
"""

from math import pi
from typing import NamedTuple

from numba.extending import register_jitable


class Cylinder(NamedTuple):
    """Geometry and moving parts.

    Attributes
    ----------
    bore, stroke : float
        Actuator diameter (phi) and stroke (l), m.
    A_A, A_B : float
        Piston areas of chambers A and B, m^2.
    V_d : float
        Dead volume of each chamber, m^3.
    M : float
        Moving mass with load, kg.
    k_f : float
        Viscous friction coefficient, N s/m.
    x_min, x_max : float
        End stops, m from the central position.
    rests : bool
        A piston that stands on a stop and is pushed onto it stays; if not, the stop only clips.
    """

    bore: float
    stroke: float
    A_A: float
    A_B: float
    V_d: float
    M: float
    k_f: float
    x_min: float
    x_max: float
    rests: bool = True  # ASSUME: not printed


@register_jitable
def volume(x, area, cylinder):
    """Chamber volume, m^3, at outward position x, m, for piston area `area`, m^2."""
    return cylinder.V_d + area * (cylinder.stroke / 2 + x)


@register_jitable
def heat_area(x, cylinder):
    """Heat transfer area A_q(x), m^2: two end faces and the uncovered wall (before eq (12))."""
    return pi / 2 * cylinder.bore**2 + abs(pi * cylinder.bore * (x + cylinder.stroke / 2))


@register_jitable
def acceleration(v, P_A, P_B, force, cylinder):
    """Piston acceleration, m/s^2: eq (3) with viscous friction and an external force, N."""
    return (P_A * cylinder.A_A - P_B * cylinder.A_B - cylinder.k_f * v + force) / cylinder.M  # (3)


@register_jitable
def motion(x, v, a, cylinder):
    """Rates of position and velocity; a piston that rests on a stop and is pushed onto it stays."""
    pushed = (x == cylinder.x_min and a < 0) or (x == cylinder.x_max and a > 0)
    if cylinder.rests and v == 0 and pushed:
        return 0.0, 0.0
    return v, a


@register_jitable
def stopped(x, v, cylinder):
    """Position and velocity after the end stops: position clipped, impact fully plastic."""
    if x <= cylinder.x_min:
        return cylinder.x_min, max(v, 0.0)
    if x >= cylinder.x_max:
        return cylinder.x_max, min(v, 0.0)
    return x, v
