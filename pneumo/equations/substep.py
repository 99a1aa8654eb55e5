"""A substep of valve, chambers and piston that stays stable and accurate up to rest at an open port.

Where a chamber's pressure P reaches that of its open port, the slope of eq (1) is infinite and explicit
methods fail at any step. But in q, the square root of the difference between both pressures, the flow is
smooth, and P is quadratic in q. So the implicit equation of a chamber's pressure, with the flow linear in q,
is a quadratic equation whose root has the right sign: a chamber never passes its port's pressure by an error
of the method. Two such stages make the L-stable method of second order of Alexander (1977),
doi:10.1137/0714068. Temperatures follow from the mass balance while a chamber fills, and from the entropy
while it empties. The piston moves by Verlet's method, with friction implicit; a substep that reaches an end
stop is cut there.

Equations are in the order in which they are solved, as in `pneumo.equations.equation_list`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from pneumo.configuration.experiment import Plant
from pneumo.equations.equation_list import PATHS, Equation, equation
from pneumo.physics.chamber import wall_conductance, wall_heat
from pneumo.physics.cylinder import Chamber, Cylinder, heat_area, volume
from pneumo.physics.models import Model, full_order_lane, lane, temperature
from pneumo.physics.valve import Gas, Valve, choked_flow, port_flows

LONGEST, SHORTEST = 1e-3, 9.1e-5  # s, of substeps: at most eleven in 1 ms
PACE = 0.035  # of a chamber's volume: what may flow or be displaced in a substep that is not the shortest
STAGE = 1 - 0.5**0.5  # of a substep: time of the first stage, and weight of the implicit term in both
LEAST_DROP = 1e-4  # of the port's pressure: below it the flow is proportional to q, within as much
LEAST_LOSS = 1e-6  # of the mass, in a substep: below it nothing flows out
LENGTHS = {"longest": LONGEST, "shortest": SHORTEST, "pace": PACE}
AT_STOP = 1e-6  # of the stroke: nearer to a stop the piston is on it


def flow_and_exponent(A_t: Any, P_u: Any, ratio: Any, T_u: Any, gas: Gas, valve: Valve) -> tuple[Any, Any]:
    """Mass flow, kg/s, as `mass_flow` has it with `laminar_factor`, and its logarithmic slope.

    `ratio` is P_d / P_u. The slope is that of ln m over ln(1 - P_d / P_u) at constant P_u.
    """
    choked, drop, exponent = choked_flow(A_t, P_u, T_u, gas), 1 - ratio, 0.0
    if ratio <= gas.critical_ratio:
        m = choked
    elif gas.elliptic:
        above = (ratio - gas.critical_ratio) / (1 - gas.critical_ratio)
        below = 1 - above**2
        m = choked * below**0.5  # ISO 6358
        exponent = drop * above / ((1 - gas.critical_ratio) * below)
    else:
        g = gas.gamma
        root = ratio ** (1 / g)  # the only power
        subsonic = root - ratio
        m = A_t * P_u * (2 * g / ((g - 1) * gas.R * T_u) * root * subsonic) ** 0.5  # (1)
        exponent = drop * ((g + 1) / g * ratio - 2 / g * root) / (2 * ratio * subsonic)
    if valve.laminar and drop < valve.laminar:
        m, exponent = m * (drop / valve.laminar) ** 0.5, exponent + 0.5
    return m, exponent


def _adiabatic(T: Any, P_before: Any, P_after: Any, a: Any) -> Any:
    """Approximation of T (P_after / P_before)^a without a power: off by 1e-5 where P changes by 10 %."""
    return T * ((1 + a) * P_after + (1 - a) * P_before) / ((1 - a) * P_after + (1 + a) * P_before)


def chamber_pace(plant: Plant, valve: bool) -> list[Equation]:
    """Equations of the pace of a chamber, 1/s, from its flow's inputs, x, v, area and V_d, counted outward.

    It is the rate at which a sonic flow and the piston would replace the chamber's volume.
    """
    gas, restrictions, c, cylinder, _ = plant
    if valve:

        def flow(u: Any, *outlet: Any) -> Any:
            opening = u + outlet[0] if outlet else abs(u)
            A_t = restrictions.k_xu * opening + restrictions.leak
            return gas.gamma * gas.R * c.T_in * choked_flow(A_t, 1.0, c.T_in, gas)

        known = " ".join(PATHS) if restrictions.paths.knots else "u"
        flows = equation("flow", flow, known, "m^3/s, sonic flow")
    else:
        given = lambda m: gas.gamma * gas.R * c.T_in * abs(m) / c.P_atm  # noqa: E731
        flows = equation("flow", given, "m", "m^3/s, given flow")

    space = lambda x, *of: volume(x, Chamber(*of), cylinder)  # noqa: E731
    pace = lambda flow, space, v, area: (flow + 2 * area * abs(v)) / space  # noqa: E731
    return [
        flows,
        equation("space", space, "x area V_d", "m^3, volume"),
        equation("pace", pace, "flow space v area", "1/s"),
    ]


def substep_length(left: Any, pace_A: Any, pace_B: Any) -> Any:
    """Length of the next substep, s, from the time left in the step and the paces of both chambers."""
    s = min(max(PACE / max(pace_A, pace_B, 1e-9), SHORTEST), LONGEST)
    return s if left > 1.001 * s else left


def chamber_substep(model: Model | None, n: Any, plant: Plant, valve: bool) -> list[Equation]:
    """Equations of one chamber over a substep of s seconds.

    Their inputs are those of `chamber_equations`, with position and velocity `x_mid` and `v_mid` at the first
    stage, `x_end` and `v_end` at the end, and s. Results are `P_after` and, in the full order, `T_after`.
    """
    gas, restrictions, c, cylinder, k_0 = plant
    g, A_q0 = gas.gamma, heat_area(0.0, cylinder)
    row = lane(model, n, g) if model else full_order_lane(g)
    a = row.a if model else (g - 1) / g
    equations = list[Equation]()

    def add(names: str, function: Callable[..., Any], arguments: str, comment: str) -> None:
        equations.append(equation(names, function, arguments, comment))

    if model:
        law = "eq (6)" if model.temperature == "polytropic" else "constant"
        add("T", lambda P: temperature(P, c.P_0, c.T_0, row.a), "P", f"K, {law}")
    space = lambda x, *of: volume(x, Chamber(*of), cylinder)  # noqa: E731
    for at in ("mid", "end"):
        add(f"space_{at}", space, f"x_{at} area V_d", "m^3, volume")
        add(f"growth_{at}", lambda v, area: area * v, f"v_{at} area", "m^3/s, its rate")
    paths = restrictions.paths
    two = bool(restrictions.leak) or paths.both_open  # whether air may flow through both ports
    if valve and paths.knots:
        both = " A_other P_other" if two else ""
        ratios = " b b_other" if two and paths.b else " b" if paths.b else ""

        def opened_paths(inlet: Any, outlet: Any, P: Any, *b: Any) -> tuple[Any, ...]:
            areas = [restrictions.k_xu * opening + restrictions.leak for opening in (inlet, outlet)]
            # If both are open, first the port where the flow changes most with the pressure.
            slopes = areas[0] ** 2 * abs(P - c.P_atm), areas[1] ** 2 * abs(c.P_s - P)
            first = slopes[0] >= slopes[1] if two else inlet > 0
            ports = list(zip(areas, (c.P_s, c.P_atm), strict=True))
            (A_t, P_port), other = ports if first else reversed(ports)
            ratios = b if first else b[::-1]
            return (A_t, P_port, *other, *ratios) if two else (A_t, P_port, *ratios[:1])

        known = " b_inlet b_outlet" if paths.b else ""
        add(f"A_t P_port{both}{ratios}", opened_paths, f"inlet outlet P{known}", "m^2, Pa, of the open port")
    elif valve:

        def opened(u: Any) -> tuple[Any, ...]:
            if u >= 0:
                open_now = restrictions.k_xu * u + restrictions.leak, c.P_s, restrictions.leak, c.P_atm
            else:
                area = -restrictions.k_xu * u * restrictions.exhaust + restrictions.leak
                open_now = area, c.P_atm, restrictions.leak, c.P_s
            return open_now if two else open_now[:2]

        add("A_t P_port" + (" A_other P_other" if two else ""), opened, "u", "m^2, Pa, eq (2)")
    half = (0.5 - STAGE) / (1 - STAGE)  # of the way from the first stage to the end
    halfway = lambda x_mid, x_end: heat_area(x_mid + half * (x_end - x_mid), cylinder) / A_q0  # noqa: E731
    add("area_ratio", halfway, "x_mid x_end", "A_q(x)/A_q(0) at half the substep")

    def heat(P: Any, T: Any, area_ratio: Any) -> Any:
        conductance = wall_conductance(k_0, area_ratio, P * T / (c.P_0 * c.T_0), row.e_A, row.e_PT)
        return row.wall_scale * wall_heat(T, conductance, c.T_amb)

    def energies(T: Any) -> tuple[Any, Any]:
        """Factors R n T of inflow and outflow in eq (10)."""
        T_inlet = row.mixing * c.T_in + (1 - row.mixing) * T
        return row.n_in * gas.R * T_inlet, row.n_out * gas.R * T

    def wanted(first: Any, *flows: Any) -> tuple[Any, ...]:
        """All results, or only the first: flows are needed for the temperature of the full order."""
        return (first,) if model else (first, *flows)

    def named(first: str, at: str, flows: str) -> str:
        return " ".join(f"{name}_{at}" for name in wanted(first, *flows.split()))

    def stage(at: str, P_guess: str, T_guess: str, base: str) -> None:
        """Equations of P_at, m_in_at and m_out_at that solve P = base + STAGE s dP_dt(P)."""

        def fixed(P: Any, s: Any, V: Any, growth: Any, heat: Any, *leak: Any) -> tuple[Any, Any]:
            w = STAGE * s / V
            return 1 + w * row.n_V * growth, P + w * ((g - 1) * heat + (leak[0] if leak else 0.0))

        known = f"{base} s space_{at} growth_{at} heat_{at}"
        comment = "1, Pa: P_port, or a pressure, times the first is the second where nothing flows"
        if not valve:

            def given(m: Any, T: Any) -> tuple[Any, ...]:
                inlet, outlet = energies(T)
                return wanted(inlet * m, m, 0.0) if m > 0 else wanted(outlet * m, 0.0, -m)

            add(named("power", at, "m_in m_out"), given, f"m {T_guess}", "W, kg/s, given flow")
            add(f"resists_{at} still_{at}", fixed, f"{known} power_{at}", comment)
            add(f"P_{at}", lambda resists, still: still / resists, f"resists_{at} still_{at}", "Pa")
            return
        if two:

            def leaking(P: Any, T: Any, A_other: Any, P_other: Any, *b: Any) -> tuple[Any, ...]:
                its_gas = gas._replace(critical_ratio=b[0]) if b else gas
                m_in, m_out = port_flows(A_other, P_other, P, T, restrictions, its_gas, c)
                inlet, outlet = energies(T)
                return wanted(inlet * m_in - outlet * m_out, m_in, m_out)

            known_leak = f"{P_guess} {T_guess} A_other P_other" + " b_other" * bool(paths.b)
            add(named("leak_power", at, "leak_in leak_out"), leaking, known_leak, "W, kg/s, other port")
            known += f" leak_power_{at}"
        add(f"resists_{at} still_{at}", fixed, known, comment)
        add(
            f"excess_{at}",
            lambda P_port, resists, still: P_port * resists - still,
            f"P_port resists_{at} still_{at}",
            "Pa, positive: air flows in",
        )

        def between(excess: Any, P_port: Any, P: Any, T: Any) -> tuple[Any, Any, Any, Any, Any]:
            inlet, outlet = energies(T)
            if excess >= 0:
                drop = max(P_port - P, LEAST_DROP * P_port)
                return drop, P_port, 1 - drop / P_port, c.T_in, inlet
            drop = max(P - P_port, LEAST_DROP * P_port)
            return drop, P_port + drop, P_port / (P_port + drop), T, outlet

        add(
            f"drop_{at} P_u_{at} ratio_{at} T_u_{at} energy_{at}",
            between,
            f"excess_{at} P_port {P_guess} {T_guess}",
            "Pa, Pa, 1, K, J/kg: of the restriction, at a first guess",
        )

        def flowing(A_t: Any, P_u: Any, ratio: Any, T_u: Any, *b: Any) -> tuple[Any, Any]:
            its_gas = gas._replace(critical_ratio=b[0]) if b else gas
            return flow_and_exponent(A_t, P_u, ratio, T_u, its_gas, restrictions)

        add(
            f"m_{at} exponent_{at}",
            flowing,
            f"A_t P_u_{at} ratio_{at} T_u_{at}" + " b" * bool(paths.b),
            "kg/s, eq (1), and d ln(m) / d ln(1 - P_d/P_u)",
        )

        # The temperature of eq (6), or of an isentropic change, follows the pressure.
        def slope(exponent: Any, ratio: Any, excess: Any) -> Any:
            if excess >= 0:
                return min(2 * exponent, 1.0)
            return (2 + a) * (1 - ratio) + 2 * exponent * ratio

        add(f"slope_{at}", slope, f"exponent_{at} ratio_{at} excess_{at}", "d ln(m) / d ln(q)")
        add(
            f"gain_{at}",
            lambda s, V, energy, m: STAGE * s * energy * m / V,
            f"s space_{at} energy_{at} m_{at}",
            "Pa, by this flow in this stage",
        )
        # resists q^2 + linear q = rest, with q over the square root of drop
        add(
            f"rest_{at}",
            lambda excess, gain, slope: abs(excess) - gain * (1 - slope),
            f"excess_{at} gain_{at} slope_{at}",
            "Pa: resists drop q^2 + gain slope q equals it, q in roots of drop",
        )

        # Whether incoming air becomes warmer with the pressure.
        warms = model and model.temperature != "constant" and not row.mixing

        def root(rest: Any, resists: Any, drop: Any, gain: Any, slope: Any, *filling: Any) -> Any:
            square = resists * drop
            if warms:
                excess, P = filling
                # At mid the guess is the pressure before: the slope is that of a secant.
                ahead = (1 - a) / 2 * gain if at == "mid" else 0.0
                more = min(a * gain / (P + ahead), resists / 2) * drop if excess >= 0 else 0.0
                square, rest = square - more, rest - more
            if rest > 0:
                linear = gain * slope
                return 2 * rest / (linear + (linear**2 + 4 * square * rest) ** 0.5)
            return 0.0

        filling = f" excess_{at} {P_guess}" if warms else ""
        add(f"q_{at}", root, f"rest_{at} resists_{at} drop_{at} gain_{at} slope_{at}{filling}", "1")

        def solved(q: Any, *known: Any) -> tuple[Any, ...]:
            excess, P_port, drop, resists, energy, V, s, *leaks = known
            leak_in, leak_out = leaks or (0.0, 0.0)
            m = (abs(excess) - resists * drop * q**2) * V / (STAGE * s * energy)  # that the balance needs
            if excess >= 0:
                return wanted(P_port - drop * q**2, m + leak_in, leak_out)
            return wanted(P_port + drop * q**2, leak_in, m + leak_out)

        leaks = f" leak_in_{at} leak_out_{at}" if two and not model else ""
        known = f"q_{at} excess_{at} P_port drop_{at} resists_{at} energy_{at} space_{at} s{leaks}"
        add(named("P", at, "m_in m_out"), solved, known, "Pa" if model else "Pa, kg/s")

    add("heat_mid", heat, "P T area_ratio", "W, wall heat: explicit, as it is slow")
    stage("mid", "P", "T", "P")
    further = 1 / STAGE - 1

    def later() -> None:
        """Equations of the second stage's wall heat: the mean of both is that at half the substep."""
        add("heat_next", heat, "P_mid T_mid area_ratio", "W")
        add("heat_end", lambda mid, after: after + 2 * further * (after - mid), "heat_mid heat_next", "W")

    add("base", lambda P, P_mid: max(P + further * (P_mid - P), P_mid / 2), "P P_mid", "Pa")
    add("P_guess", lambda P, P_mid: max(P + (P_mid - P) / STAGE, P_mid / 2), "P P_mid", "Pa, at the end")
    if model:
        add("T_mid", lambda T, P, P_mid: _adiabatic(T, P, P_mid, a), "T P P_mid", "K, nearly eq (6)")
        add("T_guess", lambda T, P, P_guess: _adiabatic(T, P, P_guess, a), "T P P_guess", "K, nearly eq (6)")
        later()
        stage("end", "P_guess", "T_guess", "base")
        add("P_after", lambda P: P, "P_end", "Pa")
        return equations

    def before(P: Any, T: Any, V: Any, s: Any, at_mid: Any, at_end: Any) -> tuple[Any, Any]:
        V_before = V - s * ((1 - STAGE) * at_mid + STAGE * at_end)
        return V_before + STAGE * s * at_mid, P * V_before / (gas.R * T)

    add("air_mid mass", before, "P T space_end s growth_mid growth_end", "m^3, kg")

    def warmed(weight: float, *known: Any) -> Any:
        P, T, mass, P_new, V, s, m_in, m_out, heat = known
        if weight * s * (m_out - m_in) <= LEAST_LOSS * mass:
            return P_new * V / (gas.R * (mass + weight * s * (m_in - m_out)))  # mass balance
        work = (P_new * V + mass * gas.R * T) / 2
        after = _adiabatic(T, P, P_new, a) * (1 + a * weight * s * heat / work)  # entropy
        if not two:
            return after
        mixed = weight * s * gas.R * T * m_in / work  # air from the other port over that inside
        return (after + mixed * (c.T_in - T / 2)) / (1 + mixed / 2)

    known = "P T mass P_mid air_mid s m_in_mid m_out_mid heat_mid"
    add("T_mid", lambda *known: warmed(STAGE, *known), known, "K")
    extrapolated = lambda T, T_mid: min(max(T + (T_mid - T) / STAGE, T / 2), 2 * T)  # noqa: E731
    add("T_guess", extrapolated, "T T_mid", "K, at the end")
    later()
    stage("end", "P_guess", "T_guess", "base")
    add("P_after", lambda P: P, "P_end", "Pa")
    for name in ("m_in", "m_out", "heat"):
        add(name, lambda mid, end: (1 - STAGE) * mid + STAGE * end, f"{name}_mid {name}_end", "mean")
    known = "P T mass P_after space_end s m_in m_out heat"
    add("T_after", lambda *known: warmed(1.0, *known), known, "K")
    return equations


def _kicked(v: Any, F: Any, s: Any, cylinder: Cylinder) -> Any:
    """Velocity after s seconds of a force F, N, with viscous and Coulomb friction, both implicit."""
    pull, heavy = F - cylinder.k_f * v / 2, cylinder.M + s * cylinder.k_f / 2
    if not cylinder.coulomb:
        return (cylinder.M * v + s * pull) / heavy
    for sign in (1, -1):
        slides = sign * (cylinder.M * v + s * pull) - s * cylinder.coulomb
        if sign * v > 0 and slides > 0:
            return sign * slides / heavy
    for sign in (1, -1):
        push = sign * pull - cylinder.coulomb
        if push > 0:
            # First it stops, after this time.
            stops = -sign * cylinder.M * v / (sign * pull + cylinder.coulomb)
            return sign * push * (s - stops) / heavy
    return 0.0


def _started(F_before: Any, F_after: Any, s: Any, cylinder: Cylinder) -> Any:
    """Velocity after s seconds of a force that at first is held, and changes linearly."""
    for sign in (1, -1):
        push = sign * F_after - cylinder.coulomb
        if push > 0:
            part = push / max(sign * (F_after - F_before), push)  # of s, in which the piston moves
            return sign * part * s * push / 2 / (cylinder.M + part * s * cylinder.k_f / 2)
    return 0.0


def _net_force(P_A: Any, P_B: Any, force: Any, cylinder: Cylinder) -> Any:
    F = P_A * cylinder.A_A - P_B * cylinder.A_B + force
    return F + cylinder.load if cylinder.load else F


def piston_before(plant: Plant) -> list[Equation]:
    """Equations from (x, v, P_A, P_B, force, s) to x_after, and the part s_part of s that it takes.

    A piston that reaches a stop does so at the end of s_part; `stop` is then 2, it is 1 for a piston that was
    on a stop and stays there, and 0 else.
    """
    cylinder = plant.cylinder

    def met(x: Any, v: Any, v_free: Any, s: Any) -> tuple[Any, Any, Any]:
        x_free = x + s * (v + v_free) / 2
        if x_free >= cylinder.x_max:
            end, room, fast, faster = cylinder.x_max, cylinder.x_max - x, v, v_free
        elif x_free <= cylinder.x_min:
            end, room, fast, faster = cylinder.x_min, x - cylinder.x_min, -v, -v_free
        else:
            return x_free, s, 0.0
        if room <= AT_STOP * cylinder.stroke:
            return end, s, 1.0
        # room = fast t + (faster - fast) t^2 / (2 s)
        at_end = max(fast**2 + 2 * (faster - fast) * room / s, 0.0) ** 0.5
        return end, min(2 * room / (fast + at_end), s), 2.0

    return [
        equation("F_before", partial(_net_force, cylinder=cylinder), "P_A P_B force", "N, eq (3)"),
        equation("v_free", partial(_kicked, cylinder=cylinder), "v F_before s", "m/s, eq (3)"),
        equation("x_after s_part stop", met, "x v v_free s", "m, s, end stops"),
    ]


def piston_after(plant: Plant) -> list[Equation]:
    """Equation from (x_after, stop, v, v_free, F_before, s_part) and the new pressures to v_after."""
    cylinder = plant.cylinder

    def after(x: Any, stop: Any, v: Any, v_free: Any, F_before: Any, F: Any, s: Any) -> Any:
        if stop > 1.5:  # plastic impact
            return 0.0
        if stop > 0.5:
            away = _started(F_before, F, s, cylinder)
            return min(away, 0.0) if x >= cylinder.x_max else max(away, 0.0)
        if cylinder.coulomb and v == 0 and v_free == 0:
            return _started(F_before, F, s, cylinder)
        return _kicked(v, (F_before + F) / 2, s, cylinder)

    net_force, known = partial(_net_force, cylinder=cylinder), "x_after stop v v_free F_before F_after s_part"
    return [
        equation("F_after", net_force, "P_A_after P_B_after force", "N, eq (3)"),
        equation("v_after", after, known, "m/s, eq (3)"),
    ]
