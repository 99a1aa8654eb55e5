"""Hypothesis strategies for cylinders, gases and signals, to test models with.

Each is named by its quantity and gives finite floats in SI units, without subnormals. Ranges are those of
industrial servo-pneumatics with a wide margin. Quantities that may be zero give zero or a realistic size.
"""

import math
from typing import TypeAlias

import numpy as np
from hypothesis import strategies as st

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Cylinder
from pneumo.physics.valve import Conditions, Gas, Valve, exact_gas

Floats: TypeAlias = st.SearchStrategy[float]


def _between(low: float, high: float) -> Floats:
    return st.floats(low, high, allow_nan=False, allow_infinity=False, allow_subnormal=False)


def _zero_or_between(low: float, high: float) -> Floats:
    return st.just(0.0) | _between(low, high)


def _zero_or_either_sign(low: float, high: float) -> Floats:
    return st.just(0.0) | _between(low, high) | _between(-high, -low)


def pressures(low: float = 0.5e5, high: float = 15e5) -> Floats:
    """Absolute pressure of a chamber or a supply, Pa."""
    return _between(low, high)


def temperatures(low: float = 200.0, high: float = 400.0) -> Floats:
    """Temperature of air, wall or surroundings, K."""
    return _between(low, high)


def positions(fraction: float = 0.96) -> Floats:
    """Position of the piston from mid-stroke as a fraction of half the stroke, from -fraction to fraction."""
    return _zero_or_either_sign(min(1e-6, fraction), fraction)


def velocities(high: float = 3.0) -> Floats:
    """Velocity of the piston, m/s."""
    return _zero_or_either_sign(1e-6, high)


def polytropic_indices(low: float = 1.0, high: float = 1.4) -> Floats:
    """Polytropic index n, from isothermal to adiabatic air."""
    return _between(low, high)


def gammas() -> Floats:
    """Ratio of specific heats, from large molecules to a monatomic gas."""
    return _between(1.05, 5 / 3)


def gas_constants() -> Floats:
    """Specific gas constant, J/(kg K), from heavy vapours to helium."""
    return _between(80.0, 2100.0)


def conductances() -> Floats:
    """Thermal conductance k_0 at equilibrium, W/K."""
    return _zero_or_between(1e-3, 10.0)


def voltages(high: float = 10.0) -> Floats:
    """Command of the servo-valve, V."""
    return _zero_or_either_sign(1e-6, high)


def gases() -> st.SearchStrategy[Gas]:
    """Gases whose sonic coefficient and critical ratio follow from R and gamma."""
    return st.builds(exact_gas, gas_constants(), gammas())


def conditions() -> st.SearchStrategy[Conditions]:
    """Supply above atmosphere, with any inlet, wall and equilibrium state."""

    def build(P_atm: float, ratio: float, T_in: float, T_amb: float, P_0: float, T_0: float) -> Conditions:
        return Conditions(ratio * P_atm, P_atm, T_in, T_amb, P_0, T_0)

    T = temperatures()
    return st.builds(build, _between(0.5e5, 2e5), _between(1.1, 15.0), T, T, pressures(), T)


def cylinders() -> st.SearchStrategy[Cylinder]:
    """Cylinders of industrial size without a rod, with end stops at the ends of the stroke."""

    def build(bore: float, stroke: float, dead_A: float, dead_B: float, M: float, k_f: float) -> Cylinder:
        area = math.pi * bore**2 / 4
        half = area * stroke / 2
        return Cylinder(
            bore=bore,
            stroke=stroke,
            A_A=area,
            A_B=area,
            V_d_A=dead_A * half,
            V_d_B=dead_B * half,
            M=M,
            k_f=k_f,
            x_min=-stroke / 2,
            x_max=stroke / 2,
        )

    bore, stroke, dead, M = _between(5e-3, 0.2), _between(10e-3, 2.0), _between(0.01, 0.5), _between(0.1, 100)
    return st.builds(build, bore, stroke, dead, dead, M, _zero_or_between(1.0, 1e4))


def plants() -> st.SearchStrategy[Plant]:
    """Plants with T_0 = T_amb, as at equilibrium."""

    def build(gas: Gas, valve: Valve, conditions: Conditions, cylinder: Cylinder, k_0: float) -> Plant:
        return Plant(gas, valve, conditions._replace(T_0=conditions.T_amb), cylinder, k_0)

    # `builds` would also draw the fields that have defaults.
    valves = st.tuples(_between(1e-9, 1e-5), _between(1.0, 20.0)).map(lambda values: Valve(*values))
    return st.builds(build, gases(), valves, conditions(), cylinders(), conductances())


def commands(steps: int, every: int = 50, high: float = 10.0) -> st.SearchStrategy[np.ndarray]:
    """Command of every step, V, shape (steps + 1,), held for `every` steps as in Table 3."""
    count = steps // every + 1
    values = st.lists(voltages(high), min_size=count, max_size=count)
    return values.map(lambda chosen: np.repeat(np.array(chosen), every)[: steps + 1])
