"""Cylinder: chamber volume, heat transfer area and Newton's law, section 2.2.

Functions of one chamber take the piston position as positive where it enlarges that chamber: x for chamber A,
-x for chamber B.
"""

from enum import IntEnum
from math import pi
from typing import NamedTuple

from pneumo.physics.valve import Real


class Cylinder(NamedTuple):
    """Geometry and moving parts."""

    bore: float  #: actuator diameter phi, m
    stroke: float  #: stroke l, m
    A_A: float  #: piston area of chamber A, m^2
    A_B: float  #: piston area of chamber B, m^2
    V_d_A: float  #: dead volume of chamber A, m^3
    V_d_B: float  #: dead volume of chamber B, m^3
    M: float  #: moving mass with load, kg
    k_f: float  #: viscous friction coefficient, N s/m
    x_min: float  #: end stop where chamber A is smallest, m from the central position
    x_max: float  #: end stop where chamber B is smallest, m from there
    #: Whether a piston at rest on a stop stays while the force points into the stop; else the stop only
    #: clips the position. ASSUME: not printed.
    rests: bool = True
    load: float = 0.0  #: constant force towards a larger chamber A, N, of gravity, of the atmosphere on a rod
    coulomb: float = 0.0  #: Coulomb friction, N, which holds a piston at rest while no greater force acts
    spring: float = 0.0  #: rate of a return spring, N/m; `load` includes its force in mid-stroke

    def with_bore(self, bore: float) -> "Cylinder":
        """Return the cylinder with another bore, and both areas changed in proportion to its square."""
        wider = bore / self.bore
        return self._replace(bore=bore, A_A=self.A_A * wider**2, A_B=self.A_B * wider**2)


class Side(IntEnum):
    """Side of the piston, A or B; its value is the chamber's index in arrays, 0 or 1."""

    A = 0
    B = 1

    @property
    def sign(self) -> float:
        """Factor, 1 or -1, that makes u, x and v positive where they enlarge the chamber."""
        return 1.0 - 2.0 * self


class Chamber(NamedTuple):
    """Piston area and dead volume of one chamber."""

    area: float  #: of the piston, m^2
    V_d: float  #: dead volume, m^3
    side: int = 0  #: index of the chamber


def chamber_of(cylinder: Cylinder, side: int) -> Chamber:
    """Geometry of the chamber on a `Side`; compiled code passes the index, 0 or 1, instead."""
    ends = (cylinder.A_A, cylinder.V_d_A), (cylinder.A_B, cylinder.V_d_B)
    return Chamber(*ends[side], side)


def volume(x: Real, chamber: Chamber, cylinder: Cylinder) -> Real:
    """Chamber volume, m^3, at x, m: the piston position for chamber A, its negative for chamber B."""
    return chamber.V_d + chamber.area * (cylinder.stroke / 2 + x)


def heat_area(x: float, cylinder: Cylinder) -> float:
    """Heat transfer area A_q(x), m^2: two end faces and the uncovered wall (before eq (12)).

    x, m, is the piston position for chamber A, its negative for chamber B.
    """
    return pi / 2 * cylinder.bore**2 + abs(pi * cylinder.bore * (x + cylinder.stroke / 2))


def wetted_area(V: Real, bore: Real) -> Real:
    """Heat transfer area, m^2, of a cylindrical space of volume V, m^3, and a given bore, m: eq (27) of 2007.

    V includes the dead volume.
    """
    return 4 * V / bore + pi / 2 * bore**2


def with_spring(force: Real, x: Real, cylinder: Cylinder) -> Real:
    """External force on the piston, N, with what a return spring adds to its force in mid-stroke."""
    return force - cylinder.spring * x if cylinder.spring else force


def acceleration(v: float, P_A: float, P_B: float, force: float, cylinder: Cylinder) -> float:
    """Piston acceleration, m/s^2: eq (3) with friction, the cylinder's load and an external force, N.

    Forces are positive where they enlarge chamber A.
    """
    F = P_A * cylinder.A_A - P_B * cylinder.A_B - cylinder.k_f * v + force
    if cylinder.load:
        F += cylinder.load
    if cylinder.coulomb:
        F = beyond_coulomb(F, v, cylinder.coulomb)
    return F / cylinder.M  # (3)


def beyond_coulomb(F: float, v: float, coulomb: float) -> float:
    """Net force on the piston, N: F less the Coulomb friction that opposes the velocity v.

    It is 0 for a piston at rest that friction holds.
    """
    if v == 0 and abs(F) <= coulomb:
        return 0.0
    return F - coulomb if v > 0 or (v == 0 and F > 0) else F + coulomb


def motion(x: float, v: float, a: float, cylinder: Cylinder) -> tuple[float, float]:
    """Rates of position, m/s, and velocity, m/s^2; both are 0 for a piston held on a stop by the force."""
    pushed = (x == cylinder.x_min and a < 0) or (x == cylinder.x_max and a > 0)
    if cylinder.rests and v == 0 and pushed:
        return 0.0, 0.0
    return v, a


def stopped(x: float, v: float, v_before: float, cylinder: Cylinder) -> tuple[float, float]:
    """Position, m, and velocity, m/s, after the end stops: position clipped, impact fully plastic.

    With Coulomb friction, a step that changes the velocity's sign (from that of `v_before`) leaves the piston
    at rest.
    """
    if cylinder.coulomb and v * v_before < 0:
        v = 0.0
    if x <= cylinder.x_min:
        return cylinder.x_min, max(v, 0.0)
    if x >= cylinder.x_max:
        return cylinder.x_max, min(v, 0.0)
    return x, v
