"""Linear models of the actuator: against finite differences, a simulated sweep and a textbook's formula."""

import json
from itertools import product

import numpy as np
import pytest
from bad_input import PAPER
from plain_rates import EVERY, plain_rate
from readable_equations import full_order_rates
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from pneumo import linearise
from pneumo.configuration.experiment import Drive
from pneumo.equations.system import system
from pneumo.errors import InputError
from pneumo.linear.linear_model import derivatives
from pneumo.physics.cylinder import acceleration
from pneumo.simulation.full_order import run

N = 1.3
HELD = Drive(False, 0.0, np.inf)
POINT = {"u": 1.5, "x": 0.012, "v": 0.2, "P_A": 5.1e5, "P_B": 3.3e5}
# Steps of 1e-5 of each scale: their square and the difference's rounding, 1e-16 over 1e-5, are below this.
FINITE_DIFFERENCE = 1e-6
SCALES = {"x": 0.05, "v": 1.0, "P": 5e5, "T": 300.0, "u": 1.0, "force": 100.0}


def study_rates(model, plant):
    """Rates by the study's own functions, of all states and inputs in one array."""

    def full(y):
        return full_order_rates(y[:6], y[6], HELD, plant, y[7])

    def reduced(y):
        x, v, P_A, P_B, u, force = y.tolist()
        pressures = (plain_rate(model, N, plant, u, x, v, P, side) for P, side in ((P_A, "A"), (P_B, "B")))
        return np.array([v, acceleration(v, P_A, P_B, force, plant.cylinder), *pressures])

    return full if model == "full" else reduced


@pytest.mark.parametrize("model", [*EVERY, "full"], ids=lambda model: getattr(model, "name", model))
def test_derivatives_are_those_of_finite_differences(model, plant):
    temperatures = {"T_A": 310.0, "T_B": 275.0} if model == "full" else {}
    linear = linearise(model, N, plant, states="actuator", **POINT, **temperatures)
    chosen, known = system(model, N, plant, piston=True), POINT | temperatures | {"force": 0.0}
    names = (*chosen.states, *chosen.inputs)
    y, f = np.array([known[name] for name in names]), study_rates(model, plant)
    scales = np.array([SCALES[name.split("_")[0]] for name in names])
    columns = [
        (f(y + 1e-5 * scale * unit) - f(y - 1e-5 * scale * unit)) / (2e-5 * scale)
        for scale, unit in zip(scales, np.eye(len(y)), strict=True)
    ]
    expected, derivatives = np.array(columns).T, np.hstack([linear.A, linear.B])
    # In each rate, over what all states and inputs together do to it.
    size = np.sum(np.abs(expected) * scales, axis=1, keepdims=True) / scales
    assert np.max(np.abs(derivatives - expected) / size) < FINITE_DIFFERENCE
    assert list(linear.state_labels) == list(chosen.states)
    assert list(linear.input_labels) == ["u", "force"]


def test_frequency_response_is_that_of_a_simulated_sweep(plant):
    """From u to velocity, pressures, temperatures at an equilibrium held by a force."""
    plant = plant._replace(valve=plant.valve._replace(leak=2e-8))
    u_0, x_0, h, amplitude = 0.5, 0.01, 1e-4, 1e-4

    def held(_, chambers):
        return full_order_rates([x_0, 0.0, *chambers], u_0, HELD, plant, 0.0)[2:]

    rest = solve_ivp(held, (0, 20), [5e5, 293.0, 4e5, 293.0], "LSODA", rtol=1e-10, atol=1e-6).y[:, -1]
    P_A, T_A, P_B, T_B = rest
    force = -acceleration(0.0, P_A, P_B, 0.0, plant.cylinder) * plant.cylinder.M
    t = np.arange(10_000) * h  # one period
    sweep = np.sin(2 * np.pi * (1 + 19.5 * t) * t)  # 1 to 40 Hz
    u = u_0 + amplitude * np.tile(sweep, 12)
    states = run(np.array([x_0, 0.0, *rest]), np.append(u, u_0), force, HELD, plant, h).states
    response = np.fft.rfft(states[-10_001:-1], axis=0) / np.fft.rfft(amplitude * sweep)[:, None]
    point = {"u": u_0, "x": x_0, "P_A": P_A, "P_B": P_B, "T_A": T_A, "T_B": T_B}
    linear = linearise("full", None, plant, states="actuator", **point)
    # Commands are held over steps: exact for these.
    both = expm(h * np.block([[linear.A, linear.B[:, :1]], [np.zeros((1, 7))]]))
    for line in range(2, 40, 3):
        z = np.exp(2j * np.pi * line * h)
        expected = np.linalg.solve(z * np.eye(6) - both[:6, :6], both[:6, 6])
        # The sweep moves the valve by 1e-4 / 0.5 of its opening: what is not linear is of that size.
        np.testing.assert_allclose(response[line, 1:], expected[1:], rtol=2e-3)


def test_natural_frequency_of_adiabatic_air_is_the_textbook_s(plant):
    """M3: ω^2 = γ (P_A A_A^2 / V_A + P_B A_B^2 / V_B) / M, and 2 ζ ω = k_f / M, with the valve shut."""
    cylinder = plant.cylinder._replace(A_B=0.8 * plant.cylinder.A_A, V_d_B=2e-6)
    shut = system("M3", None, plant._replace(cylinder=cylinder), valve=False, piston=True)
    for x, P_A in product(np.linspace(-0.045, 0.045, 5).tolist(), (2e5, 6e5)):
        P_B = P_A * cylinder.A_A / cylinder.A_B
        poles = np.linalg.eigvals(derivatives(shut, [x, 0.0, P_A, P_B], [0.0] * 3)[:, :4])
        V_A = cylinder.V_d_A + cylinder.A_A * (cylinder.stroke / 2 + x)
        V_B = cylinder.V_d_B + cylinder.A_B * (cylinder.stroke / 2 - x)
        stiffness = plant.gas.gamma * (P_A * cylinder.A_A**2 / V_A + P_B * cylinder.A_B**2 / V_B)
        pole = poles[np.argmax(poles.imag)]
        assert abs(pole) ** 2 == pytest.approx(stiffness / cylinder.M, rel=1e-9)
        assert -2 * pole.real == pytest.approx(cylinder.k_f / cylinder.M, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"states": "all"}, "'chambers' or 'actuator'"),
        ({"x": 0.05}, "between the end stops"),
        ({"T_A": 300.0}, "M8 computes temperatures"),
        ({"model": "full", "T_B": -3.0}, "T_B = -3 K"),
        ({"model": "full", "u": 0.0}, "u = 0"),
        ({"v": 0.0, "coulomb": 5.0}, "Coulomb"),
        ({"P_A": 1e5, "leak": 1e-8}, "equal pressures"),
    ],
)
def test_points_without_derivative_are_refused(changes, words, plant):
    point = {"model": "M8", "n": N, "states": "actuator"} | POINT | changes
    cylinder = plant.cylinder._replace(coulomb=point.pop("coulomb", 0.0))
    leaking = plant._replace(cylinder=cylinder, valve=plant.valve._replace(leak=point.pop("leak", 0.0)))
    with pytest.raises(InputError, match=words):
        linearise(point.pop("model"), point.pop("n"), leaking, **point)


def test_command_prints_the_actuator(inside):
    at = ["--u", 1, "--P_A", "5e5", "--P_B", "6e5", "--cylinder", "D", "--k0", 0.5, "--config", PAPER]
    code, out, _ = inside("linearise", "full", "--states", "actuator", *at, "--json")
    printed = json.loads(out)
    assert code == 0 and printed["states"] == ["x", "v", "P_A", "T_A", "P_B", "T_B"]
    assert np.shape(printed["A"]) == (6, 6) and np.shape(printed["B"]) == (6, 2)
    code, out, _ = inside("linearise", "full", *at)
    assert code == 0 and "dT_B/dt (K/s)" in out and "v (m/s)" in out
