"""The right-hand side on floats, arrays and symbols, and its linear model, against plain evaluation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_rates import EVERY, plain_rate, rate_size
from readable_equations import chamber_rates

from pneumo import MODELS, chamber_rate, linearise
from pneumo import testing as some
from pneumo.equations.branches import Choice, choices
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side, chamber_of
from pneumo.physics.valve import choked_flow

CONDITIONS = {"u": some.voltages(), "x": some.positions(), "v": some.velocities(), "P": some.pressures()}


@st.composite
def states(draw, plant):
    """Commands within the limiter, positions, velocities and pressures, as arrays."""
    rows = [[draw(strategy) for strategy in CONDITIONS.values()] for _ in range(4)]
    u, x, v, P = np.array(rows).T
    return np.clip(u, -plant.valve.u_max, plant.valve.u_max), x * plant.cylinder.stroke / 2, v, P


@st.composite
def cases(draw):
    plant = draw(some.plants())
    return plant, draw(states(plant)), draw(some.polytropic_indices())


def size(*state):
    return rate_size(*state, heat=1e3)


@pytest.mark.parametrize("side", ["A", "B"])
@settings(max_examples=20)
@given(case=cases(), model=st.sampled_from(EVERY))
def test_arrays_equal_the_scalar_loop(side, case, model):
    plant, state, n = case
    whole = chamber_rate(model, n, plant, *state, side)
    for i, row in enumerate(zip(*state, strict=True)):
        row = tuple(float(value) for value in row)
        expected = plain_rate(model, n, plant, *row, side)
        assert chamber_rate(model, n, plant, *row, side) == expected  # floats: the function itself
        # A vector power differs by some ulp, in eq (1) next to equal pressures their root, 1e-8.
        tolerance = 1e-12 * size(model, n, plant, *row, side) + 1e-7 * sonic_rate(plant, row[0], row[3])
        assert whole[i] == pytest.approx(expected, abs=tolerance)


def sonic_rate(plant, u, P):
    """Rate by the most air that the valve's opening lets through, Pa/s."""
    gas, c = plant.gas, plant.conditions
    T = max(c.T_in, c.T_0) * 10  # eq (6) far from P_0
    flow = choked_flow(plant.valve.k_xu * abs(u), max(P, c.P_s), c.T_in, gas)
    return gas.gamma * gas.R * flow * T / plant.cylinder.V_d_A


@pytest.mark.parametrize("side", Side)
def test_full_order_gives_the_rates_of_pressure_and_temperature(side, plant, random_states):
    u, x, v, P, T = random_states[:200].T
    u, T = np.clip(u, -10, 10), 200 + T / 5e3  # K
    arrays = chamber_rate("full", None, plant, u, x, v, P, side.name, T)
    chamber, sign = chamber_of(plant.cylinder, side), side.sign
    rows = np.column_stack([sign * u, sign * x, sign * v, P, T]).tolist()
    expected = np.transpose([chamber_rates(*row, chamber, plant) for row in rows])
    np.testing.assert_allclose(arrays, expected, rtol=1e-12, atol=1e-9 * abs(expected).max())
    sympy = pytest.importorskip("sympy")
    symbols = sympy.symbols("u x v P T", real=True)
    rates = chamber_rate("full", None, plant, *symbols[:4], side.name, symbols[4])
    values = dict(zip(symbols, (u[0], x[0], v[0], P[0], T[0]), strict=True))
    assert [float(rate.subs(values)) for rate in rates] == pytest.approx(expected[:, 0], rel=1e-9)


@pytest.mark.parametrize("model", EVERY, ids=lambda model: model.name)
def test_sympy_gives_the_same_numbers(model, plant, random_states):
    sympy = pytest.importorskip("sympy")
    symbols = sympy.symbols("u x v P", real=True)
    function = sympy.lambdify(symbols, chamber_rate(model, 1.3, plant, *symbols, "B"), "math")
    for u, x, v, P_A, _ in random_states[:100].tolist():
        state = (float(np.clip(u, -10, 10)), x, v, P_A)
        expected = plain_rate(model, 1.3, plant, *state, "B")
        assert function(*state) == pytest.approx(expected, abs=1e-12 * size(model, 1.3, plant, *state, "B"))


@pytest.mark.parametrize("kind", ["SX", "MX"])
def test_casadi_gives_the_same_numbers_and_derivatives(kind, plant, random_states):
    casadi = pytest.importorskip("casadi")
    symbols = [getattr(casadi, kind).sym(name) for name in "uxvP"]
    rate = chamber_rate("M10", 1.3, plant, *symbols)
    function = casadi.Function("f", symbols, [rate, casadi.jacobian(rate, casadi.vertcat(*symbols))])
    for u, x, v, P_A, P_B in random_states[:30].tolist():
        u = float(np.clip(u, -9.9, 9.9))
        value, slope = function(u, x, v, P_A)
        state = MODELS["M10"], 1.3, plant, u, x, v, P_A, "A"
        assert float(value) == pytest.approx(plain_rate(*state), abs=1e-12 * size(*state))
        linear = linearise("M10", 1.3, plant, u=u, x=x, v=v, P_A=P_A, P_B=P_B)
        expected = [*np.asarray(linear.B)[0], np.asarray(linear.A)[0, 0]]
        assert np.asarray(slope)[0] == pytest.approx(expected, rel=1e-9)


def test_choices_follow_every_branch():
    def function(x):
        return (1 if x > 2 else 2) if x > 0 else 3

    assert function(1.0) == choices(function, 1.0) == 2
    node = choices(function, np.array([-1.0, 1.0, 3.0]))
    assert node.condition.tolist() == [False, True, True]
    assert node.yes.condition.tolist() == [False, False, True]
    assert (node.yes.yes, node.yes.no, node.no) == (1, 2, 3)
    assert isinstance(node, Choice)
    # Branches that divide by zero are left out.
    assert choices(lambda x: x / 0.0 if x > 0 else 3, np.array([1.0, 2.0])) == 3
    with pytest.raises(ZeroDivisionError):
        choices(lambda x: x / 0 if x > 0 else 3 / (0.0 * 1), np.array([1.0, 2.0]))


def test_linear_model_is_a_state_space_where_control_is_installed(plant):
    control = pytest.importorskip("control")
    linear = linearise("M8", 1.35, plant, u=0.1, P_A=5e5, P_B=4e5)
    assert isinstance(linear, control.StateSpace)
    assert linear.input_labels == ["u", "x", "v"]
    assert linear.output_labels == linear.state_labels == ["P_A", "P_B"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        *(({"u": 0.0}, "u = 0"), ({"u": 11.0}, "limiter"), ({"x": 0.06}, "half the stroke")),
        *(({"P_A": 7e5}, "equal pressures"), ({"P_B": 1e5}, "equal pressures"), ({"P_B": -1.0}, "positive")),
        *(({"n": 0.0}, "n = 0"), ({"n": None}, "needs"), ({"n": float("nan")}, "n = nan")),
        *(({"v": float("nan")}, "finite"), ({"model": "M99"}, "no such model; there are M1, M2")),
    ],
)
def test_bad_points_and_sides_are_refused_in_one_line(changes, words, plant):
    point = {"model": "M8", "n": 1.35, "u": 0.1, "P_A": 5e5, "P_B": 4e5} | changes
    with pytest.raises(InputError, match=words) as caught:
        linearise(point.pop("model"), point.pop("n"), plant, **point)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="side"):
        chamber_rate("M1", None, plant, 0.0, 0.0, 0.0, 5e5, "C")
    for model, T in (("full", None), ("M1", 293.0)):
        with pytest.raises(InputError, match="T: "):
            chamber_rate(model, None, plant, 0.0, 0.0, 0.0, 5e5, T=T)
