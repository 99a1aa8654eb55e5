"""Named checks of the physics of a chamber model: balances, limits, flow, wall heat, symmetry, order.

A check takes a model and a point that Hypothesis chooses, or only the model where it simulates; `CHECKS` is
their table. Rates are compared as powers, W.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import log2
from typing import Any, NamedTuple
from unittest import SkipTest

from hypothesis import HealthCheck, Phase, given
from hypothesis import settings as Settings
from hypothesis import strategies as st

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import Model
from pneumo.testing.chamber_model import ChamberModel, Point, chamber_model

DERANDOMISED = Settings(
    derandomize=True,
    max_examples=20,
    database=None,
    deadline=None,
    phases=(Phase.explicit, Phase.generate, Phase.shrink),  # what explains a failure takes ten seconds
    report_multiple_bugs=False,
    suppress_health_check=[HealthCheck.too_slow],
)
CHOKED = 0.99  # of the critical ratio: a model may round it
ROUNDED = 1e-3  # of a flow: printed constants have three digits


def _equal(m: ChamberModel, at: Point, value: float, expected: float, tolerance: float = 0.0) -> None:
    """Compare two powers, W, within a part of the size of the rate's terms."""
    error, limit = abs(value - expected), max(tolerance, m.tolerance) * m.size(at)
    assert error <= limit, f"{value:.6g} W instead of {expected:.6g}, at {at}"


def _at_least(m: ChamberModel, at: Point, value: float, low: float) -> None:
    assert value >= low - m.tolerance * m.size(at), f"{value:.6g} W instead of {low:.6g} or more, at {at}"


def _flow_power(m: ChamberModel, at: Point) -> float:
    """Power of the flow that the command opens, W."""
    return m.power(at) - m.power(at, u=0.0)


def _net_flow(m: ChamberModel, at: Point, **changes: float) -> float:
    """R T dm/dt, W, that both rates imply by m = P V / (R T)."""
    at = at._replace(**changes)
    power, heating = m.rates(at)
    return power + m.work(at) - heating


def _open_port(m: ChamberModel, at: Point) -> float:
    """Pressure, Pa, to which the command opens the chamber."""
    return m.plant.conditions.P_s if at.u > 0 else m.plant.conditions.P_atm


def _rest(m: ChamberModel, at: Point) -> None:
    at = at._replace(P=m.plant.conditions.P_0, T=m.plant.conditions.T_amb)
    for value in m.rates(at, v=0.0, u=0.0):
        _equal(m, at, value, 0.0)


def _half_open(m: ChamberModel, at: Point) -> None:
    gas, valve, c, *_ = m.plant
    P_0 = equilibrium_pressure(c.P_s, c.P_atm, gas)
    c = c._replace(P_0=P_0, T_0=c.T_amb, T_in=c.T_amb)
    m = m.within(m.plant._replace(valve=valve._replace(leak=valve.k_xu * valve.u_max / 2), conditions=c))
    _equal(m, at, m.power(at, P=P_0, T=c.T_amb, v=0.0, u=0.0), 0.0, ROUNDED)


def _equal_pressures(m: ChamberModel, at: Point) -> None:
    at = at._replace(P=_open_port(m, at))
    _equal(m, at, _flow_power(m, at), 0.0)


def _direction(m: ChamberModel, at: Point) -> None:
    flow = _flow_power(m, at)
    _at_least(m, at, flow if _open_port(m, at) > at.P else -flow, 0.0)


def _command(m: ChamberModel, at: Point) -> None:
    at = at._replace(P=min(max(at.P, m.plant.conditions.P_atm), m.plant.conditions.P_s))
    powers = [m.power(at, u=part * abs(at.u)) for part in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    for lower, higher in pairwise(powers):
        _at_least(m, at, higher, lower)


def _choked_inflow(m: ChamberModel, at: Point) -> None:
    choked, P_s = CHOKED * m.plant.gas.critical_ratio, m.plant.conditions.P_s
    high = at._replace(P=min(at.P, P_s) * choked, u=abs(at.u))
    low = high._replace(P=high.P / 2)
    warmer = 1.0 if m.lane and m.lane.mixing else m.temperature(low) / m.temperature(high)
    _equal(m, high, _flow_power(m, low), _flow_power(m, high) * warmer)


def _choked_outflow(m: ChamberModel, at: Point) -> None:
    choked = CHOKED * m.plant.gas.critical_ratio
    at = at._replace(P=at.P + m.plant.conditions.P_atm / choked, u=-abs(at.u))
    other = at._replace(P=1.5 * at.P, T=1.1 * at.T)
    factor = 1.5 * (m.temperature(other) / m.temperature(at)) ** 0.5  # its enthalpy is proportional to T
    _equal(m, other, _flow_power(m, other), _flow_power(m, at) * factor)


def _compression(m: ChamberModel, at: Point) -> None:
    c, gamma = m.plant.conditions, m.plant.gas.gamma
    middle = Point(c.P_0, c.T_amb, 0.0, 1.0, 0.0, Side.A)
    k = (m.power(middle, v=0.0) - m.power(middle)) / m.work(middle)
    assert 1 - ROUNDED <= k <= gamma + ROUNDED, f"k = {k:.6g}, at {middle}"
    _equal(m, at, m.power(at, u=0.0) - m.power(at, u=0.0, v=0.0), -k * m.work(at))


def _isentropic(m: ChamberModel, at: Point) -> None:
    gamma = m.plant.gas.gamma
    m = m.within(m.plant._replace(k_0=0.0), gamma)
    moving, still = m.rates(at, u=0.0), m.rates(at, u=0.0, v=0.0)
    _equal(m, at, moving[0] - still[0], -gamma * m.work(at))
    if m.full:
        _equal(m, at, moving[1] - still[1], -(gamma - 1) * m.work(at))


def _isothermal(m: ChamberModel, at: Point) -> None:
    m = m.within(m.plant._replace(k_0=10 * abs(m.work(at))), n=1.0)  # a wall that conducts well, W/K
    low, high = m.plant.conditions.T_amb - 20, m.plant.conditions.T_amb + 20
    for _ in range(30 if m.full else 0):  # to the temperature at which it takes what compression gives
        at = at._replace(T=(low + high) / 2)
        low, high = (at.T, high) if m.rates(at, u=0.0)[1] > 0 else (low, at.T)
    _equal(m, at, m.power(at, u=0.0), -m.work(at))


def _symmetry(m: ChamberModel, at: Point) -> None:
    other = at._replace(side=Side(1 - at.side))
    other = other._replace(v=at.v * m.area(at) / m.area(other))
    for here, there in zip(m.rates(at), m.rates(other), strict=True):
        _equal(m, other, there, here)


def _mass_balance(m: ChamberModel, at: Point) -> None:
    _equal(m, at, _net_flow(m, at), _net_flow(m, at, v=0.0))
    _equal(m, at, _net_flow(m, at, u=0.0), 0.0)


def _mass_flow(m: ChamberModel, at: Point) -> None:
    m_in, m_out = m.valve_flows(at)
    _equal(m, at, _net_flow(m, at), m.plant.gas.R * at.T * (m_in - m_out), ROUNDED)


def _terms(m: ChamberModel, at: Point) -> None:
    T, R, shut, row = m.temperature(at), m.plant.gas.R, at._replace(u=0.0), m.lane
    assert row
    if m.full:  # whatever its valve lets through
        net = (_net_flow(m, at) - _net_flow(m, shut)) / (R * T)
        m_in, m_out, tolerance = max(net, 0.0), max(-net, 0.0), 0.0
    else:
        m_in, m_out = (a - b for a, b in zip(m.valve_flows(at), m.valve_flows(shut), strict=True))
        tolerance = ROUNDED
    T_inlet = row.mixing * m.plant.conditions.T_in + (1 - row.mixing) * T
    expected = R * (row.n_in * m_in * T_inlet - row.n_out * m_out * T) - row.n_V * m.work(at)
    _equal(m, at, m.power(at) - m.power(shut, v=0.0), expected, tolerance)


def _wall_heat(m: ChamberModel, at: Point) -> None:
    c = m.plant.conditions
    colder = c.T_amb > at.T if m.full else at.P < c.P_0
    for value in m.rates(at, v=0.0, u=0.0):
        _at_least(m, at, value if colder else -value, 0.0)


def _conductance(m: ChamberModel, at: Point) -> None:
    c, gamma = m.plant.conditions, m.plant.gas.gamma
    at = at._replace(P=1.001 * c.P_0, T=1.001 * c.T_amb, x=0.0)
    heat, expected = m.power(at, v=0.0, u=0.0) / (gamma - 1), m.plant.k_0 * (c.T_amb - m.temperature(at))
    assert abs(heat - expected) <= 0.01 * abs(expected), f"{heat:.6g} W instead of {expected:.6g}, at {at}"


def _no_wall_heat(m: ChamberModel, at: Point) -> None:
    limits = [m.within(m.plant._replace(k_0=0.0))] * ("plant" in m.reads)
    limits += [m.within(n=1.0)] * ("n" in m.reads and not m.full)
    for limit in limits:
        _equal(limit, at, limit.power(at, v=0.0, u=0.0), 0.0)


def _positivity(m: ChamberModel, at: Point) -> None:
    c, gamma = m.plant.conditions, m.plant.gas.gamma
    thin = at._replace(P=1e-3 * c.P_atm, T=c.T_amb, u=-abs(at.u))
    _at_least(m, thin, m.power(thin), -gamma * abs(m.work(thin)))
    if m.full:
        cold = at._replace(P=c.P_atm, T=1.0, u=0.0)
        _at_least(m, cold, m.rates(cold)[1], -(gamma - 1) * abs(m.work(cold)))


def _cycle(m: ChamberModel) -> None:
    steps = 400 if "h" in m.reads else 100
    run, tolerance = m.swing(steps, 2.0)[steps:], max(ROUNDED, m.tolerance)
    work = sum((a.P + b.P) / 2 * (m.volume(b) - m.volume(a)) for a, b in pairwise(run))
    size = run[0].P * (max(map(m.volume, run)) - m.volume(run[0]))
    assert work <= tolerance * size, f"{work:.4g} J from a chamber that got nothing ({size:.4g} J moved)"
    if m.full:
        kept = run[-1].P / run[-1].T / (run[0].P / run[0].T)
        assert abs(kept - 1) <= tolerance, f"{kept:.6g} of the air is left after a cycle from {run[0]}"


def _order(m: ChamberModel) -> None:
    runs = [[at.P for at in m.swing(steps, 1.25)[:: steps // 32]] for steps in (32, 64, 128)]
    errors = [max(abs(a - b) for a, b in zip(*pair, strict=True)) for pair in pairwise(runs)]
    order = 1 if "h" in m.reads else 2
    observed = log2(errors[0] / errors[1]) if errors[1] else order
    assert observed > order - 0.5, f"order {observed:.2f} instead of {order}"


class Check(NamedTuple):
    """A named check."""

    name: str
    physics: str  #: what it checks, in a sentence, and its source
    function: Callable[..., None]
    needs: tuple[str, ...] = ()  #: of `ChamberModel.features`, all without which a model does not claim it


NO_LEAK = "no leak"
OPENINGS = "no table of openings"
LIKE = "declared features (`like`)"
# fmt: off
CHECKS = (
    Check("rest", "A shut chamber at P_0 and the walls' temperature stays as it is: eqs (4), (5).",
          _rest, (NO_LEAK, "T_0 = T_amb")),
    Check("half open", "Half open to both ports, a chamber rests at P_0: Appendix 2.",
          _half_open, ("parameter plant", OPENINGS, "n_in = n_out")),
    Check("equal pressures", "No air flows between equal pressures: eq (1).", _equal_pressures, (OPENINGS,)),
    Check("direction", "Air flows from the higher pressure to the lower: eq (1).", _direction, (OPENINGS,)),
    Check("command", "Between the ports' pressures, a higher command lowers no rate: eqs (1), (2).",
          _command, (OPENINGS,)),
    Check("choked inflow", "Choked inflow does not depend on the chamber's pressure: eq (1).",
          _choked_inflow, (OPENINGS, LIKE)),
    Check("choked outflow", "Choked outflow is proportional to P / T^(1/2), whatever is downstream: eq (1).",
          _choked_outflow, (OPENINGS, LIKE)),
    Check("compression", "A shut chamber keeps P V^k, with one k from 1 to gamma everywhere: eqs (4), (10).",
          _compression),
    Check("isentropic", "Without wall heat a shut chamber keeps P V^gamma and T V^(gamma - 1): eqs (4), (5).",
          _isentropic, (LIKE, "n_V = gamma at n = gamma")),
    Check("isothermal", "A shut chamber whose air stays at its walls' temperature keeps P V: eqs (4), (6).",
          _isothermal, (LIKE, "an isothermal limit, by n or k_0", NO_LEAK)),
    Check("symmetry", "Both chambers obey one law, each with its own area and dead volume: section 2.2.",
          _symmetry, ("parameter side", OPENINGS)),
    Check("mass balance", "Neither the piston's motion nor wall heat makes air: eqs (4), (5).",
          _mass_balance, ("T as a state", NO_LEAK)),
    Check("mass flow", "The flow is that of the plant's valve: eqs (1), (2).", _mass_flow, ("T as a state",)),
    Check("energy balance", "Inner energy changes by enthalpy, at T_in or T, wall heat and P dV: eq (4).",
          _terms, (LIKE, "variable temperature", "indices gamma", "mixing")),
    Check("indices", "Compression, inflow and outflow have the indices that the model declares: eq (10).",
          _terms, (LIKE,)),
    Check("wall heat", "Wall heat opposes the difference of temperatures: eqs (7), (11), (13).",
          _wall_heat, (NO_LEAK, "T_0 = T_amb")),
    Check("conductance", "At P_0 and mid-stroke the wall conducts k_0: eq (12).",
          _conductance, (LIKE, "wall heat", NO_LEAK, "T_0 = T_amb")),
    Check("no wall heat", "No heat comes from walls without k_0, nor at n = 1, where T = T_0: eqs (6), (13).",
          _no_wall_heat, ("parameter plant or n", NO_LEAK, "T_0 = T_amb")),
    Check("positivity", "Pressure and temperature stay positive: eqs (4), (5).", _positivity, (NO_LEAK,)),
    Check("cycle", "Over a cycle a shut chamber keeps its air, and walls can only take work: second law.",
          _cycle, (NO_LEAK,)),
    Check("order", "Halved steps divide the error by 4, with inputs held in each step by 2: midpoint rule.",
          _order, (NO_LEAK,)),
)
# fmt: on


def _points(m: ChamberModel) -> st.SearchStrategy[Point]:
    """Points within the stroke, around the pressures of the ports, with a command and a moving piston."""
    c, u_max, reach = m.plant.conditions, m.plant.valve.u_max, 0.48 * m.plant.cylinder.stroke

    def either_sign(high: float) -> st.SearchStrategy[float]:
        return st.floats(0.01 * high, high) | st.floats(-high, -0.01 * high)

    return st.builds(
        Point,
        P=st.floats(0.5 * c.P_atm, 1.3 * c.P_s),
        T=st.floats(0.8 * c.T_amb, 1.2 * c.T_amb),
        x=st.floats(-reach, reach),
        v=either_sign(3.0),
        u=either_sign(u_max),
        side=st.sampled_from(Side) if "side" in m.reads else st.just(Side.A),
    )


@dataclass(frozen=True)
class ModelCheck:
    """A check of one model; call it as a test."""

    name: str
    physics: str  #: what is checked, in a sentence, and its source
    not_claimed: str  #: why the model does not claim it; "" if it does
    run: Callable[[], None]

    def __call__(self) -> None:
        """Run the check: `AssertionError` if the model fails it; skipped where it is not claimed."""
        if self.not_claimed:
            raise SkipTest(self.not_claimed)
        self.run()

    def __str__(self) -> str:
        return self.name


class CheckReport(NamedTuple):
    """Results of all checks of a model."""

    passed: list[str]  #: names
    failed: dict[str, str]  #: name -> counterexample
    not_claimed: dict[str, str]  #: name -> reason

    def __repr__(self) -> str:
        lines = [f"{len(self.passed)} checks passed, {len(self.failed)} failed"]
        lines += [f"failed: {name}: {text}" for name, text in self.failed.items()]
        return "\n".join([*lines, *(f"not claimed: {name}: {why}" for name, why in self.not_claimed.items())])


def model_checks(
    model: Model | str | Callable[..., Any],
    plant: Plant,
    n: float | None = None,
    *,
    like: Model | str | None = None,
    not_claimed: Mapping[str, str] | None = None,
    settings: Settings = DERANDOMISED,
) -> list[ModelCheck]:
    """Checks of a chamber model's physics, as values for `pytest.mark.parametrize`.

    Parameters
    ----------
    model : callable, Model or str
        A function that returns dP/dt, Pa/s, or, if it has a parameter T, dP/dt and dT/dt, K/s. It gets
        numbers by the names of its parameters: P, Pa; x, m; v, m/s; u, V, with the signs of `chamber_rate`;
        and, where it has them, T, K, side ("A" or "B"), plant and n, which allow more checks, and h, s, if
        its rates are means over a step. Or a row of `MODELS`, its name, or "full".
    plant : Plant
        The plant that the model describes.
    n : float or None
        Polytropic index, of a row or of `like`.
    like : Model or str or None
        For a function without T: the row of `MODELS`, or one of your own, whose features it has.
    not_claimed : mapping of str to str
        Names of checks that the model does not claim, with reasons, beyond those that follow from the above.
    settings : hypothesis.settings
        By default 20 points for each check, the same in each run.

    Raises
    ------
    InputError
        If there is no such model or check, or the function has other parameters.
    """
    m = chamber_model(model, plant, n, like)
    further, names = dict(not_claimed or {}), [check.name for check in CHECKS]
    if unknown := further.keys() - set(names):
        raise InputError(f"not_claimed: {', '.join(unknown)}: no such check; there are {', '.join(names)}")
    features, checks = m.features, list[ModelCheck]()
    for check in CHECKS:
        missing = [f"needs {feature}" for feature in check.needs if not features[feature]]
        reason = further.get(check.name) or "".join(missing[:1])
        if check.function in (_cycle, _order):
            run = partial(check.function, m)
        else:
            run = settings(given(st.just(m), _points(m))(check.function))
        checks.append(ModelCheck(check.name, check.physics, reason, run))
    return checks


def check_model(
    model: Model | str | Callable[..., Any], plant: Plant, n: float | None = None, **options: Any
) -> CheckReport:
    """Run all `model_checks`, whose parameters these are: `failed` of the report is empty if all is well."""
    report = CheckReport([], {}, {})
    for check in model_checks(model, plant, n, **options):
        try:
            check()
            report.passed.append(check.name)
        except SkipTest as reason:
            report.not_claimed[check.name] = str(reason)
        except AssertionError as error:
            report.failed[check.name] = str(error)
    return report
