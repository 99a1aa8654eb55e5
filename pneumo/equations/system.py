"""Systems that are exported and linearised: both chambers by a model, with or without valve and piston."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from pneumo.configuration.experiment import Plant
from pneumo.equations.branches import complex_value
from pneumo.equations.equation_list import (
    PATHS,
    Equation,
    chamber_equations,
    piston_equations,
    valve_equations,
)
from pneumo.equations.named_model import FULL_ORDER, model_and_index
from pneumo.equations.substep import (
    STAGE,
    chamber_pace,
    chamber_substep,
    piston_after,
    piston_before,
    substep_length,
)
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.models import Model
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics

# Unit and meaning of states and inputs, without the chamber's suffix.
QUANTITIES = {
    "u": ("V", "command, limited inside; positive connects chamber A to the supply"),
    "u_A": ("V", "command of chamber A's valve, limited inside; positive connects it to the supply"),
    "u_B": ("V", "command of chamber B's valve, limited inside; positive connects it to the supply"),
    "m": ("kg/s", "mass flow into the chamber, negative out of it"),
    "x": ("m", "piston position from mid-stroke, positive where chamber A is larger"),
    "v": ("m/s", "piston velocity"),
    "opening": ("V", "command that the valve has followed"),
    "force": ("N", "external force on the piston, towards a larger chamber A"),
    "P": ("Pa", "absolute pressure"),
    "T": ("K", "temperature"),
}
RATE_UNITS = {"opening": "V/s", "x": "m/s", "v": "m/s^2", "P": "Pa/s", "T": "K/s"}


def quantity(name: str) -> tuple[str, str]:
    """Unit and meaning of a state or an input, from its name, such as "P_A"."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    base, _, side = name.partition("_")
    unit, meaning = QUANTITIES[base]
    return unit, f"{meaning}, chamber {side}"


def rate_unit(state: str) -> str:
    """Unit of a state's rate."""
    return RATE_UNITS[state.partition("_")[0]]


class System(NamedTuple):
    """Both chambers by one model, with or without valve and piston.

    Without the valve, mass flows are inputs; without the piston, position and velocity are.
    """

    model: Model | None  # None is the full order, eqs (4) and (5)
    n: float
    plant: Plant
    valve: bool = True  # else mass flows are inputs
    piston: bool = False  # else position and velocity are
    dynamics: ValveDynamics = PROPORTIONAL  # of the valve; its dead time is not in the equations
    two_valves: bool = False  # one for each chamber, with commands u_A and u_B
    own_name: str = ""  # of its exports, in place of the model's

    @property
    def model_name(self) -> str:
        """Name of the model; "full" for the full order."""
        return self.model.name if self.model else FULL_ORDER

    @property
    def name(self) -> str:
        """Name with which the names in exported code begin."""
        return self.own_name or self.model_name

    @property
    def chamber_states(self) -> tuple[str, ...]:
        """Names of the states of one chamber, without the suffix _A or _B."""
        return ("P",) if self.model else ("P", "T")

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, in the order of `rates`."""
        chambers = (f"{name}_{side.name}" for side in Side for name in self.chamber_states)
        return (*(("x", "v") if self.piston else ()), *self.openings, *chambers)

    @property
    def openings(self) -> tuple[str, ...]:
        """Names of the states of a valve with a lag."""
        return tuple(name.replace("u", "opening") for name in self.commands) if self.dynamics.lag else ()

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the valve's commands: none without it."""
        if not self.valve:
            return ()
        return ("u_A", "u_B") if self.two_valves else ("u",)

    @property
    def flow_inputs(self) -> tuple[str, ...]:
        """Names of the inputs of one chamber's equations that determine its flow."""
        if not self.valve:
            return ("m",)
        return PATHS if self.plant.valve.paths.knots else ("u",)

    def flows(self, side: Side) -> dict[str, tuple[int, str]]:
        """Sign and name, outside the chamber, of each of its `flow_inputs`."""
        if self.flow_inputs == ("u",):
            shared = int(side.sign), "u_valve"
            return {"u": (1, f"u_valve_{side.name}") if self.two_valves else shared}
        return {name: (1, f"{name}_{side.name}") for name in self.flow_inputs}

    @property
    def of_chambers(self) -> dict[str, dict[str, str]]:
        """Names of the constants in which the chambers differ, by side and by name inside the chamber."""
        ratios = [f"b_{path}" for path in PATHS if self.valve and self.plant.valve.paths.b]
        return {
            side: {"area": f"A_{side}", "V_d": f"V_d_{side}"} | {b: f"{b}_{side}" for b in ratios}
            for side in "AB"
        }

    def state(self, **quantities: float) -> list[float]:
        """State vector from one value for each of x, v, opening, P and T; P and T hold for both chambers."""
        return [quantities[name.partition("_")[0]] for name in self.states]

    @property
    def at_rest(self) -> list[float]:
        """State from which runs begin: mid-stroke, at the equilibrium pressure."""
        c = self.plant.conditions
        return self.state(x=0.0, v=0.0, opening=0.0, P=c.P_0, T=c.T_0)

    @property
    def scale(self) -> list[float]:
        """Typical magnitude of each state."""
        c, stroke = self.plant.conditions, self.plant.cylinder.stroke
        return self.state(x=stroke, v=1.0, opening=self.plant.valve.u_max, P=c.P_atm, T=c.T_0)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return (*(self.commands or ("m_A", "m_B")), *(("force",) if self.piston else ("x", "v")))


def system(
    model: Model | str,
    n: float | None,
    plant: Plant,
    *,
    valve: bool = True,
    piston: bool = False,
    dynamics: ValveDynamics = PROPORTIONAL,
    two_valves: bool = False,
    own_name: str = "",
) -> System:
    """A `System` from a model's row or name, or "full" for the full order; errors as in `model_and_index`."""
    if two_valves and not valve:
        raise InputError("--two-valves: not with --no-valve")
    row, n = (None, 1.0) if model == FULL_ORDER else model_and_index(model, n, FULL_ORDER)
    return System(row, n, plant, valve, piston, dynamics, two_valves, own_name)


def _solve(
    equations: list[Equation], known: dict[str, Any], evaluate: Callable[..., Any] = complex_value
) -> None:
    """Evaluate equations in their order; add their results to the dictionary `known`, by name."""
    for equation in equations:
        result = evaluate(equation.function, known)
        values = result if isinstance(result, tuple) else (result,)
        known |= zip(equation.names, values, strict=True)


def rates(system: System, state: Sequence[Any], inputs: Sequence[Any]) -> list[Any]:
    """Rates of a system's states at a state and inputs, which are floats or complex numbers.

    By eqs (1) to (8) for the full order; for a reduced model by eqs (1) to (3), (6) and (10).
    """
    known = dict(zip((*system.states, *system.inputs), (*state, *inputs), strict=True))
    result: list[Any] = []
    if system.piston:
        _solve(piston_equations(system.plant), known)
        result += [known["dx_dt"], known["dv_dt"]]
    of_chambers = [rate for side in Side for rate in chamber_rates(system, side, known)]
    result += [known[f"d{name}_dt"] for name in system.openings]
    return result + of_chambers


def chamber_rates(
    system: System, side: Side, known: dict[str, Any], evaluate: Callable[..., Any] = complex_value
) -> list[Any]:
    """Rates of one chamber's states, from the inputs and states in `known`, by name.

    `evaluate` calls a function on what `known` holds: floats, complex numbers, arrays or symbols.
    """
    if system.valve:
        _solve(valve_equations(system.plant, system.dynamics, system.two_valves), known, evaluate)
    outward = _inside(system, side, known, system.chamber_states)
    outward |= {"x": side.sign * known["x"], "v": side.sign * known["v"]}
    equations = chamber_equations(system.model, system.n, system.plant, system.valve)
    _solve(equations, outward, evaluate)
    return [outward[f"d{name}_dt"] for name in system.chamber_states]


def _inside(system: System, side: Side, known: dict[str, Any], states: Sequence[str] = ()) -> dict[str, Any]:
    """Inputs of one chamber's equations, without x and v, from what is known of the system."""
    chamber, ratios = chamber_of(system.plant.cylinder, side), system.plant.valve.paths.b
    inside = {"area": chamber.area, "V_d": chamber.V_d}
    inside |= {f"b_{path}": b for path, b in zip(PATHS, ratios[side] if ratios else (), strict=bool(ratios))}
    inside |= {name: sign * known[outer] for name, (sign, outer) in system.flows(side).items()}
    return inside | {name: known[f"{name}_{side.name}"] for name in states}


def closed_drift(system: System) -> float | None:
    """Rate of pressure, Pa/s, of a closed chamber at rest in mid-stroke, at P_atm and the walls' temperature.

    None for models that keep such a chamber as it is; of others the pressure drifts to P_0.
    """
    model, c = system.model, system.plant.conditions
    if model is None or model.temperature == "constant" or model.wall == "none":
        return None
    closed = system._replace(valve=False, piston=False, dynamics=PROPORTIONAL)
    return rates(closed, [c.P_atm] * 2, [0.0] * 4)[0]


def substep(
    system: System, state: Sequence[float], inputs: Sequence[Sequence[float]], s: float
) -> tuple[list[float], float]:
    """State after a substep of s seconds at most, by `pneumo.equations.substep`, and the time that it took.

    `inputs` are those at the middle of the substep, at its first stage and at its end.
    """
    at = [dict(zip(system.inputs, values, strict=True)) for values in inputs]
    known = dict(zip(system.states, state, strict=True)) | at[0] | {"s": s, "s_part": s}
    plant, places = system.plant, list[tuple[Any, Any]]()
    if system.piston:
        _solve(piston_before(plant), known)
        speed = (known["x_after"] - known["x"]) / known["s_part"]
        places = [(known["x"] + STAGE * (known["x_after"] - known["x"]), speed), (known["x_after"], speed)]
    else:
        places = [(values["x"], values["v"]) for values in at[1:]]
    if system.valve:
        known["s"] = known["s_part"]
        _solve(valve_equations(plant, system.dynamics, system.two_valves, substep=True), known)
    equations = chamber_substep(system.model, system.n, plant, system.valve)
    for side in Side:
        outward = _inside(system, side, known, system.chamber_states) | {"s": known["s_part"]}
        for name, (x, v) in zip(("mid", "end"), places, strict=True):
            outward |= {f"x_{name}": side.sign * x, f"v_{name}": side.sign * v}
        _solve(equations, outward)
        known |= {f"{name}_{side.name}_after": outward[f"{name}_after"] for name in system.chamber_states}
    if system.piston:
        _solve(piston_after(plant), known)
    return [known[f"{name}_after"] for name in system.states], known["s_part"]


def paces(system: System, state: Sequence[float], inputs: Sequence[float]) -> list[float]:
    """Pace of each chamber, 1/s, as `chamber_pace` has it."""
    known = dict(zip((*system.inputs, *system.states), (*inputs, *state), strict=True))
    result = list[float]()
    if system.valve:
        _solve(valve_equations(system.plant, system.dynamics, system.two_valves), known)
    for side in Side:
        of_side = _inside(system, side, known)
        of_side |= {"x": side.sign * known["x"], "v": side.sign * known["v"]}
        _solve(chamber_pace(system.plant, system.valve), of_side)
        result.append(of_side["pace"])
    return result


def step(
    system: System, state: Sequence[float], start: Sequence[float], end: Sequence[float], h: float
) -> list[float]:
    """State after h s; inputs change linearly from `start` to `end`.

    The step is divided into substeps as `pneumo.equations.substep.substep_length` says; one in which the
    piston meets a stop is cut there.
    """
    left, state = h, list(state)
    while left > 0:
        s = substep_length(left, *paces(system, state, end))
        at = [(h - left + part * s) / h for part in (0.5, STAGE, 1.0)]
        inputs = [[a + w * (b - a) for a, b in zip(start, end, strict=True)] for w in at]
        state, taken = substep(system, state, inputs, s)
        left -= taken
    return state
