"""Replays of two closed chambers: limiting cases, and balances by an independent solver."""

import numpy as np
import pytest
from closed_truth import Truth, measured, moving, pressures

from pneumo.configuration.parameters import load, study
from pneumo.fitting.closed.closed_fit import closed_record, problem_of_law
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

PERIOD, SAMPLES = 2e-3, 1000
T = PERIOD * np.arange(SAMPLES)
PLANT = configured_plant(study(load(TEMPLATE)), "mine", 1.0)
TRUTH = Truth((0.25, 0.18), (5e-6, 6e-6), T=(300.0, 288.0), leak=2e-10)
LEAKING = TRUTH._replace(P=(1.5e5, 6e5), T=(288.0, 300.0), leak=2e-9)
EXACT = {"V_d_A": 5e-6, "V_d_B": 6e-6, "k_0_A": 0.25, "k_0_B": 0.18, "T_A": 293.15, "T_B": 293.15}
EXACT |= {"first_A": 1.0, "first_B": 1.0, "leak": 0.0, "n": 1.2}


def replayed(law, P, x, chambers=(0, 1), **values):
    """Volumes, and pressures by a law with these parameters from the first ones in P."""
    record = closed_record(measured(0 * x, P, PERIOD, 1, 0.0), PLANT)._replace(
        x=x + PLANT.cylinder.stroke / 2
    )
    problem = problem_of_law(law, record, PLANT, SAMPLES, chambers)
    values = EXACT | values
    theta = problem.inner(values)
    values, areas = problem.values(theta), np.array([record.areas]).T
    V_d = np.array([[values["V_d_A"]], [values["V_d_B"]]])
    return V_d + areas * record.uncovered, problem.replay(theta, SAMPLES)


@pytest.mark.parametrize(("law", "n"), [("isothermal", 1.0), ("free n", 1.2), ("adiabatic", 1.4)])
def test_without_wall_heat_and_leakage_the_polytrope_is_followed(law, n):
    V, P = replayed(law, np.full((2, SAMPLES), 4e5), moving(T))
    # Fourth-order steps of 2 ms, while the volume changes in some 0.1 s: (0.02)^4.
    np.testing.assert_allclose(P * V**n, (P * V**n)[:, :1] * np.ones_like(T), rtol=1e-6)


@pytest.mark.parametrize("truth", [TRUTH, LEAKING])
@pytest.mark.parametrize(
    ("law", "e_A", "e_PT"),
    [
        ("wall heat, constant", 0.0, 0.0),
        ("wall heat, root of PT", 0.0, 0.5),
        ("wall heat, area and root of PT", 1.0, 0.5),
    ],
)
def test_balances_of_mass_and_energy_are_those_of_an_independent_solver(truth, law, e_A, e_PT):
    expected = pressures(truth._replace(e_A=e_A, e_PT=e_PT), PLANT, moving, T)
    starts = {f"T_{side}": T for side, T in zip("AB", truth.T, strict=True)}
    _, P = replayed(law, expected, moving(T), leak=truth.leak, **starts)
    # Volumes are linear between samples: 0.5 m/s^2 (2 ms)^2 / 12 of 15 mm or more.
    np.testing.assert_allclose(P, expected, rtol=1e-5)


@pytest.mark.parametrize("order", [1, -1])
def test_gas_leaks_from_an_open_chamber_at_its_pressure_between_samples(order):
    """Chamber A keeps volume and temperature; B is open, and its pressure rises on a line; or A and B."""
    leak, slope = 1e-9, 1e5  # Pa/s
    P = np.array([np.full(SAMPLES, 4e5), 4e5 + slope * T])[::order]
    V, found = replayed("isothermal", P, 0 * T, chambers=(0 if order == 1 else 1,), leak=leak)
    (found, V), is_open = (row[::order][0] for row in (found, V)), P[::order][1]
    # V / (R T) dP_A/dt = leak (P_B - P_A): behind a ramp by its slope times the time constant, less a decay.
    tau = V[0] / (PLANT.gas.R * PLANT.conditions.T_amb * leak)
    np.testing.assert_allclose(found, is_open - slope * tau * (1 - np.exp(-T / tau)), rtol=1e-8)
