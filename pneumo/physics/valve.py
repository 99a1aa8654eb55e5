"""Servo-valve: mass flow through a restriction, eqs (1) and (2).

Functions take floats; `mass_flow` and `choked_flow` also take quantities with units.
"""

from decimal import Decimal
from typing import NamedTuple, TypeVar

import numpy as np

Real = TypeVar("Real", float, np.ndarray)
# Parts of the largest command between which a valve that is not linear gets straight lines; relative errors
# of small openings are below 1 %.
LINE_ENDS = (1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 3 / 4, 1.0)
MOST_STRAIGHT = 16  # knots of paths whose lines are longer


class Gas(NamedTuple):
    """A perfect gas and the two constants of eq (1) that follow from it."""

    R: float  #: gas constant, J/(kg K)
    gamma: float  #: ratio of specific heats
    #: Choked mass flow is ``sonic_coefficient * P_u * A_t / sqrt(T_u)``, s K^0.5/m.
    sonic_coefficient: float
    critical_ratio: float  #: flow is sonic at and below this P_d / P_u
    #: Whether the subsonic branch is the ellipse of ISO 6358, with the critical ratio b of a valve's
    #: catalogue, instead of eq (1).
    elliptic: bool = False


class Paths(NamedTuple):
    """Openings of a valve's paths as a table over the command, and their critical ratios.

    An opening is the area over `Valve.k_xu`, V.

    A chamber's own command is positive where it connects the chamber to the supply: u for chamber A and -u
    for chamber B where they share a valve. Between knots an opening is linear; beyond the ends it stays.
    """

    knots: int = 0  #: their number; 0: each opening is the command
    u: tuple[float, ...] = ()  #: own commands of the knots, V, increasing
    supply: tuple[tuple[float, ...], ...] = ()  #: opening from the supply by (chamber, knot), V
    exhaust: tuple[tuple[float, ...], ...] = ()  #: opening to the atmosphere, likewise
    #: Critical ratio by (chamber, path), supply first; empty: that of the gas.
    b: tuple[tuple[float, ...], ...] = ()

    def openings(self, u: float, side: int) -> tuple[float, float]:
        """Openings from the supply and to the atmosphere, V, at a chamber's own command, V."""
        supply, exhaust = self.supply[side], self.exhaust[side]
        if u <= self.u[0]:
            return supply[0], exhaust[0]
        for i in range(1, self.knots):
            if u <= self.u[i]:
                part = (u - self.u[i - 1]) / (self.u[i] - self.u[i - 1])
                low, high = (supply[i - 1], exhaust[i - 1]), (supply[i], exhaust[i])
                return low[0] + part * (high[0] - low[0]), low[1] + part * (high[1] - low[1])
        return supply[-1], exhaust[-1]

    @property
    def both_open(self) -> bool:
        """Whether a chamber has both paths open at some command."""
        pairs, spans = zip(self.supply, self.exhaust, strict=True), range(max(self.knots - 1, 1))
        return any(any(a[i : i + 2]) and any(b[i : i + 2]) for a, b in pairs for i in spans)

    @property
    def one_at_a_time(self) -> bool:
        """Whether a chamber has never both paths open, and every path has the critical ratio of the gas."""
        return not self.both_open and not self.b


class Valve(NamedTuple):
    """Servo-valve, section 2.1; matched and symmetric restrictions by default."""

    k_xu: float  #: area of an open restriction per volt of command, k_x k_u, m^2/V
    u_max: float  #: limit of the command's magnitude, V
    laminar: float = 0.0  #: 1 - P_d / P_u below which flow is proportional to it; 0 is eq (1) as printed
    #: Area of the path to the atmosphere over that of the path from the supply; 1 is symmetric.
    exhaust: float = 1.0
    leak: float = 0.0  #: area that stays open between a chamber and either of supply and atmosphere, m^2
    #: Whether leak in and leak out cancel before they cross the port, so that only the rest carries heat.
    net_leak: bool = False
    paths: Paths = Paths()  #: openings that are not the command, or differ between paths

    def with_exhaust(self, ratio: float) -> "Valve":
        """Return the valve with another `exhaust`, all paths to the atmosphere changed in proportion."""
        factor = ratio / self.exhaust
        openings = tuple(tuple(factor * opening for opening in side) for side in self.paths.exhaust)
        return self._replace(exhaust=ratio, paths=self.paths._replace(exhaust=openings))

    def with_linearity(self, off: float) -> "Valve":
        """Return the valve with its openings changed by `linearity_factor`, all paths alike."""
        if off == 0:
            return self
        of, end = self.paths, self.u_max
        if not of.knots:
            ends = (-end, 0.0, end)
            of = Paths(3, ends, ((0.0, 0.0, end),) * 2, ((self.exhaust * end, 0.0, 0.0),) * 2)
        u = np.array(of.u)
        if of.knots <= MOST_STRAIGHT:  # gets knots on the curve that its lines become
            u = np.union1d(u, end * np.array([*LINE_ENDS, *(-part for part in LINE_ENDS)]))
        factor = linearity_factor(np.minimum(np.abs(u) / end, 1.0), off)
        supply, exhaust = (
            tuple(tuple((factor * np.interp(u, of.u, side)).tolist()) for side in path)
            for path in (of.supply, of.exhaust)
        )
        return self._replace(paths=Paths(len(u), tuple(u.tolist()), supply, exhaust, of.b))


class Conditions(NamedTuple):
    """Pressures and temperatures of supply and surroundings, and of the equilibrium from which runs start."""

    P_s: float  #: absolute supply pressure, Pa
    P_atm: float  #: atmospheric pressure, Pa
    T_in: float  #: temperature of incoming air, K
    T_amb: float  #: temperature of the cylinder's walls, K
    P_0: float  #: equilibrium pressure, Pa
    T_0: float  #: equilibrium temperature, K


def _power(base: float, exponent: float) -> float:
    """Power by decimal arithmetic, which rounds alike on every processor."""
    return float(Decimal(float(base)) ** Decimal(float(exponent)))


def critical_ratio(gamma: float) -> float:
    """Pressure ratio P_d / P_u at which the throat becomes sonic (0.5283 for air)."""
    return _power(2 / (gamma + 1), gamma / (gamma - 1))


def sonic_coefficient(R: float, gamma: float) -> float:
    """Exact coefficient of the sonic branch of eq (1), s K^0.5/m (printed: 0.0404).

    Eq (17) misprints it; this form makes the two branches of eq (1) meet.
    """
    return _power(2 / (gamma + 1), 1 / (gamma - 1)) * (2 * gamma / ((gamma + 1) * R)) ** 0.5


def exact_gas(R: float, gamma: float) -> Gas:
    """A `Gas` whose two constants of eq (1) are computed from R and gamma, not taken as printed."""
    return Gas(R, gamma, sonic_coefficient(R, gamma), critical_ratio(gamma))


# Air as in the papers, with which figures of valves are converted; R of dry air, below, is 0.02 % larger.
AIR = exact_gas(287.0, 1.4)
# Ideal gases by name. R is 8.314462618 J/(mol K) (CODATA 2018) over the molar mass (IUPAC 2021; dry air
# 28.9652 g/mol, ISO 2533). The ratio is that at 293 K: NIST Chemistry WebBook (SRD 69), Shomate equations; of
# air, 1.4.
GASES: dict[str, Gas] = {
    "air": exact_gas(287.05, 1.4),
    "nitrogen": exact_gas(296.80, 1.4),
    "helium": exact_gas(2077.3, 5 / 3),
    "hydrogen": exact_gas(4124.5, 1.405),
    "argon": exact_gas(208.13, 5 / 3),
    "CO2": exact_gas(188.92, 1.291),
}


def choked_flow(A_t: Real, P_u: float, T_u: float, gas: Gas) -> Real:
    """Sonic mass flow, kg/s: second branch of eq (1), from throat area, m^2, and upstream state, Pa and K."""
    return gas.sonic_coefficient * P_u * A_t / T_u**0.5


def mass_flow(A_t: float, P_u: float, P_d: float, T_u: float, gas: Gas) -> float:
    """Mass flow through a restriction, kg/s: eq (1), or ISO 6358 where the gas is `elliptic`.

    A_t is the throat area, m^2; P_u and P_d are the absolute pressures upstream and downstream, Pa, with
    ``P_u >= P_d > 0``; T_u is the temperature upstream, K.
    """
    ratio = P_d / P_u
    if ratio <= gas.critical_ratio:
        return choked_flow(A_t, P_u, T_u, gas)
    if gas.elliptic:
        above = (ratio - gas.critical_ratio) / (1 - gas.critical_ratio)
        return choked_flow(A_t, P_u, T_u, gas) * (1 - above**2) ** 0.5  # ISO 6358
    g = gas.gamma
    subsonic = ratio ** (2 / g) - ratio ** ((g + 1) / g)
    return A_t * P_u * (2 * g / ((g - 1) * gas.R * T_u) * subsonic) ** 0.5  # (1)


def laminar_factor(P_u: float, P_d: float, laminar: float) -> float:
    """Factor on eq (1) that makes the flow laminar where the pressures are nearly equal.

    Near P_d = P_u eq (1) is proportional to the square root of 1 - P_d / P_u; its slope is infinite there,
    and no step is short enough. With this factor the flow is proportional to 1 - P_d / P_u wherever that is
    less than `laminar`; elsewhere the factor is 1.
    """
    difference = 1 - P_d / P_u
    return (difference / laminar) ** 0.5 if difference < laminar else 1.0


def linearity_factor(part: np.ndarray, off: float) -> np.ndarray:
    """Opening over that of a linear valve at commands that are `part` of the largest.

    The deviation, over the largest opening, is a parabola: `off` at half the largest command, and 0 at the
    largest and at none.
    """
    return 1 + 4 * off * (1 - part)


def limited(u: float, u_max: float) -> float:
    """Command after the limiter, V: u within -u_max ... u_max."""
    return min(max(u, -u_max), u_max)


def port_flows(
    A_t: float, P_port: float, P: float, T: float, valve: Valve, gas: Gas, conditions: Conditions
) -> tuple[float, float]:
    """Mass flows into and out of a chamber, kg/s, through one restriction; one of them is 0.

    A_t is the area of the restriction, m^2, P_port the pressure on its other side, Pa; P, Pa, and T, K, are
    those of the chamber. Inflow has `conditions.T_in`, even from the atmosphere.
    """
    if P_port >= P:
        if valve.laminar:
            A_t *= laminar_factor(P_port, P, valve.laminar)
        return mass_flow(A_t, P_port, P, conditions.T_in, gas), 0.0
    if valve.laminar:
        A_t *= laminar_factor(P, P_port, valve.laminar)
    return 0.0, mass_flow(A_t, P, P_port, T, gas)


def path_flows(
    openings: tuple[float, float],
    ratios: tuple[float, ...],
    P: float,
    T: float,
    valve: Valve,
    gas: Gas,
    conditions: Conditions,
) -> tuple[float, float]:
    """Mass flows into and out of a chamber, kg/s, through the paths from the supply and to the atmosphere.

    `openings`, V, are those of `Paths.openings`; `ratios` are their critical ratios, or empty for that of the
    gas.
    """
    m_in, m_out = 0.0, 0.0
    ports = conditions.P_s, conditions.P_atm
    for P_port, opening, b in zip(ports, openings, ratios or (gas.critical_ratio,) * 2, strict=True):
        its_gas = gas._replace(critical_ratio=b)
        area = valve.k_xu * opening + valve.leak
        flows = port_flows(area, P_port, P, T, valve, its_gas, conditions)
        m_in, m_out = m_in + flows[0], m_out + flows[1]
    return m_in, m_out


def chamber_flows(
    u: float, P: float, T: float, valve: Valve, gas: Gas, conditions: Conditions, side: int = 0
) -> tuple[float, float]:
    """Mass flows into and out of one chamber, kg/s, through the restriction that eq (2) opens.

    The pressures decide the direction: a chamber above supply pressure flows back into the supply line, and
    one below atmospheric pressure draws air in through the exhaust. A leaking valve also lets air through the
    other restriction.

    The limited command u, V, is positive where it connects this chamber to the supply: the command itself for
    chamber A, its negative for chamber B. Both flows are non-negative; at most one of them is positive,
    except where the valve leaks without `Valve.net_leak`.
    """
    if valve.paths.knots:
        ratios = valve.paths.b[side] if valve.paths.b else ()
        m_in, m_out = path_flows(valve.paths.openings(u, side), ratios, P, T, valve, gas, conditions)
    else:
        A_t = valve.k_xu * abs(u)  # (2), with the magnitude that the printed u < 0 case leaves out
        if u >= 0:
            P_port, P_other = conditions.P_s, conditions.P_atm
        else:
            P_port, P_other = conditions.P_atm, conditions.P_s
            A_t *= valve.exhaust
        m_in, m_out = port_flows(A_t + valve.leak, P_port, P, T, valve, gas, conditions)
        if valve.leak:
            leak_in, leak_out = port_flows(valve.leak, P_other, P, T, valve, gas, conditions)
            m_in, m_out = m_in + leak_in, m_out + leak_out
    if valve.net_leak:
        return max(m_in - m_out, 0.0), max(m_out - m_in, 0.0)
    return m_in, m_out
