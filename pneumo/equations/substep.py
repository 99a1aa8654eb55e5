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
from typing import Any, NamedTuple

from pneumo.configuration.experiment import Plant
from pneumo.equations.equation_list import Equations
from pneumo.physics.chamber import wall_conductance, wall_heat
from pneumo.physics.cylinder import Chamber, Cylinder, heat_area, volume, with_spring
from pneumo.physics.models import Lane, Model, full_order_lane, lane, temperature
from pneumo.physics.valve import Gas, choked_flow, port_flows

LONGEST, SHORTEST = 1e-3, 9.1e-5  # s, of substeps: at most eleven in 1 ms
PACE = 0.035  # of a chamber's volume: what may flow or be displaced in a substep that is not the shortest
STAGE = 1 - 0.5**0.5  # of a substep: time of the first stage, and weight of the implicit term in both
LEAST_DROP = 1e-4  # of the port's pressure: below it the flow is proportional to q, within as much
LEAST_LOSS = 1e-6  # of the mass, in a substep: below it nothing flows out
LENGTHS = {"longest": LONGEST, "shortest": SHORTEST, "pace": PACE}
AT_STOP = 1e-6  # of the stroke: nearer to a stop the piston is on it


def _adiabatic(T: Any, P_before: Any, P_after: Any, a: Any) -> Any:
    """Approximation of T (P_after / P_before)^a without a power: off by 1e-5 where P changes by 10 %."""
    return T * ((1 + a) * P_after + (1 - a) * P_before) / ((1 - a) * P_after + (1 + a) * P_before)


def chamber_pace(plant: Plant, valve: bool) -> Equations:
    """Equations of the pace of a chamber, 1/s, from its flow's inputs, x, v, area and V_d, counted outward.

    It is the rate at which a sonic flow and the piston would replace the chamber's volume.
    """
    gas, restrictions, c, cylinder, *_ = plant
    equations, by_paths = Equations(), bool(restrictions.paths.knots)

    def flow(k: Any) -> Any:
        opening = k.inlet + k.outlet if by_paths else abs(k.u)
        A_t = restrictions.k_xu * opening + restrictions.leak
        return gas.gamma * gas.R * c.T_in * choked_flow(A_t, 1.0, c.T_in, gas)

    if valve:
        equations.let("flow", "m^3/s, sonic flow", flow)
    else:
        equations.let("flow", "m^3/s, given flow", lambda k: gas.gamma * gas.R * c.T_in * abs(k.m) / c.P_atm)
    equations.let("space", "m^3, volume", lambda k: volume(k.x, Chamber(k.area, k.V_d), cylinder))
    equations.let("pace", "1/s", lambda k: (k.flow + 2 * k.area * abs(k.v)) / k.space)
    return equations


def substep_length(left: Any, pace_A: Any, pace_B: Any) -> Any:
    """Length of the next substep, s, from the time left in the step and the paces of both chambers."""
    s = min(max(PACE / max(pace_A, pace_B, 1e-9), SHORTEST), LONGEST)
    return s if left > 1.001 * s else left


class _Filling(NamedTuple):
    """What the equations of a chamber over a substep share; the methods' k has what is known by name."""

    model: Model | None  # None is the full order
    row: Lane
    plant: Plant
    valve: bool  # else the mass flow m is given

    @property
    def a(self) -> Any:
        """Exponent of the temperature over the pressure, eq (6) or isentropic."""
        g = self.plant.gas.gamma
        return self.row.a if self.model else (g - 1) / g

    @property
    def flows(self) -> str:
        """Names of the flows, which the temperature of the full order needs."""
        return "" if self.model else " m_in m_out"

    @property
    def two(self) -> bool:
        """Whether air may flow through both ports at a time."""
        return bool(self.plant.valve.leak) or self.plant.valve.paths.both_open

    @property
    def warms(self) -> bool:
        """Whether incoming air becomes warmer with the pressure."""
        return self.model is not None and self.model.temperature != "constant" and not self.row.mixing

    # --- the ports: areas, pressures and critical ratios, first of the one that is open ---

    def ports(self) -> tuple[str, Callable[[Any], Any]]:
        """Names and function of the open port, and of the other one if it may be open too."""
        paths = self.plant.valve.paths
        names = "A_t P_port" + " A_other P_other" * self.two
        if paths.b:
            names += " b_port" + " b_other" * self.two
        return names, self.port_of_paths if paths.knots else self.port_of_command

    def port_of_command(self, k: Any) -> tuple[Any, ...]:
        restrictions, c = self.plant.valve, self.plant.conditions
        if k.u >= 0:
            return restrictions.k_xu * k.u + restrictions.leak, c.P_s, restrictions.leak, c.P_atm
        area = -restrictions.k_xu * k.u * restrictions.exhaust + restrictions.leak
        return area, c.P_atm, restrictions.leak, c.P_s

    def port_of_paths(self, k: Any) -> tuple[Any, ...]:
        restrictions, c = self.plant.valve, self.plant.conditions
        areas = [restrictions.k_xu * opening + restrictions.leak for opening in (k.inlet, k.outlet)]
        # If both are open, first the port where the flow changes most with the pressure: it is solved for,
        # the other's flow is at a guess. A slope is as area / root of drop; squared, times both drops.
        slopes = areas[0] ** 2 * abs(k.P - c.P_atm), areas[1] ** 2 * abs(c.P_s - k.P)
        first = slopes[0] >= slopes[1] if self.two else k.inlet > 0
        ratios = (k.b_inlet, k.b_outlet) if restrictions.paths.b else (None, None)
        ports = list(zip(areas, (c.P_s, c.P_atm), ratios, strict=True))
        (A_t, P_port, b), (A_other, P_other, b_other) = ports if first else reversed(ports)
        return (A_t, P_port, A_other, P_other, b, b_other) if self.two else (A_t, P_port, b)

    def gas_through(self, k: Any, b: str) -> Gas:
        """Gas with the critical ratio of a path, of the name b, where paths have their own."""
        gas = self.plant.gas
        return gas._replace(critical_ratio=getattr(k, b)) if self.plant.valve.paths.b else gas

    # --- wall heat ---

    def ratio_at_half(self, k: Any) -> Any:
        cylinder = self.plant.cylinder
        half = (0.5 - STAGE) / (1 - STAGE)  # of the way from the first stage to the end
        return heat_area(k.x_mid + half * (k.x_end - k.x_mid), cylinder) / heat_area(0.0, cylinder)

    def heat(self, k: Any) -> Any:
        c, row = self.plant.conditions, self.row
        PT = k.P * k.T / (c.P_0 * c.T_0)
        conductance = wall_conductance(self.plant.k_0, k.area_ratio, PT, row.e_A, row.e_PT)
        return row.wall_scale * wall_heat(k.T, conductance, c.T_amb)

    # --- a stage: P = base + STAGE s dP_dt(P) ---

    def energies(self, T: Any) -> tuple[Any, Any]:
        """Factors R n T of inflow and outflow in eq (10)."""
        row, R = self.row, self.plant.gas.R
        T_inlet = row.mixing * self.plant.conditions.T_in + (1 - row.mixing) * T
        return row.n_in * R * T_inlet, row.n_out * R * T

    def given(self, k: Any) -> tuple[Any, Any, Any]:
        inlet, outlet = self.energies(k.T_guess)
        return (inlet * k.m, k.m, 0.0) if k.m > 0 else (outlet * k.m, 0.0, -k.m)

    def leaking(self, k: Any) -> tuple[Any, Any, Any]:
        restrictions, c = self.plant.valve, self.plant.conditions
        its_gas = self.gas_through(k, "b_other")
        m_in, m_out = port_flows(k.A_other, k.P_other, k.P_guess, k.T_guess, restrictions, its_gas, c)
        inlet, outlet = self.energies(k.T_guess)
        return inlet * m_in - outlet * m_out, m_in, m_out

    def fixed(self, k: Any) -> tuple[Any, Any]:
        w = STAGE * k.s / k.space
        power = k.leak_power if self.two and self.valve else 0.0 if self.valve else k.power
        heating = (self.plant.gas.gamma - 1) * k.heat
        return 1 + w * self.row.n_V * k.growth, k.base + w * (heating + power)

    def between(self, k: Any) -> tuple[Any, Any, Any, Any, Any]:
        inlet, outlet = self.energies(k.T_guess)
        if k.excess >= 0:
            drop = max(k.P_port - k.P_guess, LEAST_DROP * k.P_port)
            return drop, k.P_port, 1 - drop / k.P_port, self.plant.conditions.T_in, inlet
        drop = max(k.P_guess - k.P_port, LEAST_DROP * k.P_port)
        return drop, k.P_port + drop, k.P_port / (k.P_port + drop), k.T_guess, outlet

    def root_of_ratio(self, k: Any) -> Any:
        """The only power in eq (1), in a variable of its own, as C would call pow wherever it is used."""
        return k.ratio ** (1 / self.plant.gas.gamma) if k.ratio > self.plant.gas.critical_ratio else 0.0

    def flowing(self, k: Any) -> tuple[Any, Any]:
        """Mass flow, kg/s, as `mass_flow` has it with `laminar_factor`, and its logarithmic slope.

        The slope is that of ln m over ln(1 - P_d / P_u) at constant P_u.
        """
        gas, laminar = self.gas_through(k, "b_port"), self.plant.valve.laminar
        choked = choked_flow(k.A_t, k.P_u, k.T_u, gas)
        drop = 1 - k.ratio
        if k.ratio <= gas.critical_ratio:
            m, exponent = choked, 0.0
        elif gas.elliptic:
            above = (k.ratio - gas.critical_ratio) / (1 - gas.critical_ratio)
            below = 1 - above**2
            m = choked * below**0.5  # ISO 6358
            exponent = drop * above / ((1 - gas.critical_ratio) * below)
        else:
            g = gas.gamma
            subsonic = k.root - k.ratio
            m = k.A_t * k.P_u * (2 * g / ((g - 1) * gas.R * k.T_u) * k.root * subsonic) ** 0.5  # (1)
            exponent = drop * ((g + 1) / g * k.ratio - 2 / g * k.root) / (2 * k.ratio * subsonic)
        if laminar and drop < laminar:
            m, exponent = m * (drop / laminar) ** 0.5, exponent + 0.5
        return m, exponent

    def slope(self, k: Any) -> Any:
        """The temperature of eq (6), or of an isentropic change, follows the pressure."""
        if k.excess >= 0:
            return min(2 * k.exponent, 1.0)
        return (2 + self.a) * (1 - k.ratio) + 2 * k.exponent * k.ratio

    def root(self, k: Any, secant: bool) -> Any:
        square, rest = k.resists * k.drop, k.rest
        if self.warms:
            a = self.a
            ahead = (1 - a) / 2 * k.gain if secant else 0.0
            more = min(a * k.gain / (k.P_guess + ahead), k.resists / 2) * k.drop if k.excess >= 0 else 0.0
            square, rest = square - more, rest - more
        if rest > 0:
            linear = k.gain * k.slope
            return 2 * rest / (linear + (linear**2 + 4 * square * rest) ** 0.5)
        return 0.0

    def solved(self, k: Any) -> tuple[Any, Any, Any]:
        change = k.drop * k.q**2
        leak_in, leak_out = (k.leak_in, k.leak_out) if self.two and not self.model else (0.0, 0.0)
        # The flow that the balance needs.
        m = (abs(k.excess) - k.resists * k.drop * k.q**2) * k.space / (STAGE * k.s * k.energy)
        if k.excess >= 0:
            return k.P_port - change, m + leak_in, leak_out
        return k.P_port + change, leak_in, m + leak_out

    def stage(self, equations: Equations, at: str, **guesses: str) -> None:
        """Append the equations of P, m_in and m_out at a stage.

        `guesses` renames base and the first guesses, P_guess and T_guess.
        """
        let = partial(equations.let, at=at, **guesses)
        if not self.valve:
            let("power" + self.flows, "W, kg/s, given flow", self.given)
        elif self.two:
            let("leak_power" + self.flows.replace("m_", "leak_"), "W, kg/s, other port", self.leaking)
        let(
            "resists still",
            "1, Pa: P_port, or a pressure, times the first is the second where nothing flows",
            self.fixed,
        )
        if not self.valve:
            let("P", "Pa", lambda k: k.still / k.resists)
            return
        comment = "Pa, Pa, 1, K, J/kg: of the restriction, at a first guess"
        let("excess", "Pa, positive: air flows in", lambda k: k.P_port * k.resists - k.still)
        let("drop P_u ratio T_u energy", comment, self.between)
        if not self.plant.gas.elliptic:
            let("root", "1, ratio^(1/gamma) where not sonic", self.root_of_ratio)
        let("m exponent", "kg/s, eq (1), and d ln(m) / d ln(1 - P_d/P_u)", self.flowing)
        let("slope", "d ln(m) / d ln(q)", self.slope)
        let("gain", "Pa, by this flow in this stage", lambda k: STAGE * k.s * k.energy * k.m / k.space)
        # resists q^2 + linear q = rest, with q over the square root of drop
        comment = "Pa: resists drop q^2 + gain slope q equals it, q in roots of drop"
        let("rest", comment, lambda k: abs(k.excess) - k.gain * (1 - k.slope))
        # At mid the guess is the pressure before: the slope is that of a secant.
        let("q", "1", lambda k: self.root(k, secant=at == "_mid"))
        let("P" + self.flows, "Pa" if self.model else "Pa, kg/s", self.solved)

    # --- temperatures ---

    def polytropic(self, k: Any) -> Any:
        return temperature(k.P, self.plant.conditions.P_0, self.plant.conditions.T_0, self.row.a)

    def adiabatic(self, k: Any) -> Any:
        return _adiabatic(k.T, k.P, k.P_new, self.a)

    def before(self, k: Any) -> tuple[Any, Any]:
        V_before = k.space_end - k.s * ((1 - STAGE) * k.growth_mid + STAGE * k.growth_end)
        return V_before + STAGE * k.s * k.growth_mid, k.P * V_before / (self.plant.gas.R * k.T)

    def warmed(self, k: Any, weight: float) -> Any:
        s, R = weight * k.s, self.plant.gas.R
        if s * (k.m_out - k.m_in) <= LEAST_LOSS * k.mass:
            return k.P_new * k.V / (R * (k.mass + s * (k.m_in - k.m_out)))  # mass balance
        work = (k.P_new * k.V + k.mass * R * k.T) / 2
        after = self.adiabatic(k) * (1 + self.a * weight * k.s * k.heat / work)  # entropy
        if not self.two:
            return after
        mixed = s * R * k.T * k.m_in / work  # air from the other port over that inside
        return (after + mixed * (self.plant.conditions.T_in - k.T / 2)) / (1 + mixed / 2)


def chamber_substep(model: Model | None, n: Any, plant: Plant, valve: bool) -> Equations:
    """Equations of one chamber over a substep of s seconds.

    Their inputs are those of `chamber_equations`, with position and velocity `x_mid` and `v_mid` at the first
    stage, `x_end` and `v_end` at the end, and s. Results are `P_after` and, in the full order, `T_after`.
    """
    g = plant.gas.gamma
    row = lane(model, n, g) if model else full_order_lane(g, plant.wall)
    of = _Filling(model, row, plant, valve)
    equations = Equations("x_mid v_mid x_end v_end")
    let = equations.let
    if model:
        law = "eq (6)" if model.temperature == "polytropic" else "constant"
        let("T", f"K, {law}", of.polytropic)
    for at in ("_mid", "_end"):
        let("space", "m^3, volume", lambda k: volume(k.x, Chamber(k.area, k.V_d), plant.cylinder), at)
        let("growth", "m^3/s, its rate", lambda k: k.area * k.v, at)
    if valve:
        names, function = of.ports()
        let(names, "m^2, Pa, of the open port" if plant.valve.paths.knots else "m^2, Pa, eq (2)", function)
    let("area_ratio", "A_q(x)/A_q(0) at half the substep", of.ratio_at_half)
    let("heat_mid", "W, wall heat: explicit, as it is slow", of.heat)
    of.stage(equations, "_mid", base="P", P_guess="P", T_guess="T")
    further = 1 / STAGE - 1
    let("base", "Pa", lambda k: max(k.P + further * (k.P_mid - k.P), k.P_mid / 2))
    let("P_guess", "Pa, at the end", lambda k: max(k.P + (k.P_mid - k.P) / STAGE, k.P_mid / 2))
    if model:
        let("T_mid", "K, nearly eq (6)", of.adiabatic, P_new="P_mid")
        let("T_guess", "K, nearly eq (6)", of.adiabatic, P_new="P_guess")
    else:
        let("air_mid mass", "m^3, kg", of.before)
        mid = {name: f"{name}_mid" for name in ("m_in", "m_out", "heat")}
        let("T_mid", "K", lambda k: of.warmed(k, STAGE), P_new="P_mid", V="air_mid", **mid)
        extrapolated = lambda k: min(max(k.T + (k.T_mid - k.T) / STAGE, k.T / 2), 2 * k.T)  # noqa: E731
        let("T_guess", "K, at the end", extrapolated)
    # The mean of both stages' wall heat is that at half the substep.
    let("heat_next", "W", of.heat, P="P_mid", T="T_mid")
    let("heat_end", "W", lambda k: k.heat_next + 2 * further * (k.heat_next - k.heat_mid))
    of.stage(equations, "_end")
    let("P_after", "Pa", lambda k: k.P_end)
    if not model:
        for name in ("m_in", "m_out", "heat"):
            mean = lambda k: (1 - STAGE) * k.mid + STAGE * k.end  # noqa: E731
            let(name, "mean", mean, mid=f"{name}_mid", end=f"{name}_end")
        let("T_after", "K", lambda k: of.warmed(k, 1.0), P_new="P_after", V="space_end")
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


def _net_force(x: Any, P_A: Any, P_B: Any, force: Any, cylinder: Cylinder) -> Any:
    F = P_A * cylinder.A_A - P_B * cylinder.A_B + with_spring(force, x, cylinder)
    return F + cylinder.load if cylinder.load else F


def piston_before(plant: Plant) -> Equations:
    """Equations from (x, v, P_A, P_B, force, s) to x_after, and the part s_part of s that it takes.

    A piston that reaches a stop does so at the end of s_part; `stop` is then 2, it is 1 for a piston that was
    on a stop and stays there, and 0 else.
    """
    cylinder, equations = plant.cylinder, Equations()

    def met(k: Any) -> tuple[Any, Any, Any]:
        x_free = k.x + k.s * (k.v + k.v_free) / 2
        if x_free >= cylinder.x_max:
            end, room, fast, faster = cylinder.x_max, cylinder.x_max - k.x, k.v, k.v_free
        elif x_free <= cylinder.x_min:
            end, room, fast, faster = cylinder.x_min, k.x - cylinder.x_min, -k.v, -k.v_free
        else:
            return x_free, k.s, 0.0
        if room <= AT_STOP * cylinder.stroke:
            return end, k.s, 1.0
        # room = fast t + (faster - fast) t^2 / (2 s)
        at_end = max(fast**2 + 2 * (faster - fast) * room / k.s, 0.0) ** 0.5
        return end, min(2 * room / (fast + at_end), k.s), 2.0

    equations.let("F_before", "N, eq (3)", lambda k: _net_force(k.x, k.P_A, k.P_B, k.force, cylinder))
    equations.let("v_free", "m/s, eq (3)", lambda k: _kicked(k.v, k.F_before, k.s, cylinder))
    equations.let("x_after s_part stop", "m, s, end stops", met)
    return equations


def piston_after(plant: Plant) -> Equations:
    """Equations of the velocity after a substep, from the values of `piston_before` and the new pressures."""
    cylinder, equations = plant.cylinder, Equations()

    def after(k: Any) -> Any:
        if k.stop > 1.5:  # plastic impact
            return 0.0
        if k.stop > 0.5:
            away = _started(k.F_before, k.F_after, k.s_part, cylinder)
            return min(away, 0.0) if k.x_after >= cylinder.x_max else max(away, 0.0)
        if cylinder.coulomb and k.v == 0 and k.v_free == 0:
            return _started(k.F_before, k.F_after, k.s_part, cylinder)
        return _kicked(k.v, (k.F_before + k.F_after) / 2, k.s_part, cylinder)

    force = lambda k: _net_force(k.x_after, k.P_A_after, k.P_B_after, k.force, cylinder)  # noqa: E731
    equations.let("F_after", "N, eq (3)", force)
    equations.let("v_after", "m/s, eq (3)", after)
    return equations
