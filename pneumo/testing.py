"""Hypothesis strategies for cylinders, gases and signals, to test models with; needs Hypothesis.

They give finite floats in SI units, without subnormals, in the ranges of industrial servo-pneumatics with a
wide margin. Quantities that may be zero give zero or a realistic size.
"""

import math

import numpy as np

try:
    from hypothesis import strategies as st
except ImportError:
    raise ImportError("pneumo.testing needs Hypothesis: install pneumo[testing]") from None

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Cylinder
from pneumo.physics.valve import Conditions, Gas, Valve, exact_gas


def _between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_infinity=False, allow_subnormal=False)


def _zero_or_between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.just(0.0) | _between(low, high)


PRESSURE, TEMPERATURE = _between(0.5e5, 15e5), _between(200.0, 400.0)  # absolute, Pa; K


def gases() -> st.SearchStrategy[Gas]:
    """Gases whose sonic coefficient and critical ratio follow from R and gamma, heavy vapours to helium."""
    return st.builds(exact_gas, _between(80.0, 2100.0), _between(1.05, 5 / 3))


def conditions() -> st.SearchStrategy[Conditions]:
    """Supply above atmosphere, with any inlet, wall and equilibrium state."""

    def build(P_atm: float, ratio: float, T_in: float, T_amb: float, P_0: float, T_0: float) -> Conditions:
        return Conditions(ratio * P_atm, P_atm, T_in, T_amb, P_0, T_0)

    T = TEMPERATURE
    return st.builds(build, _between(0.5e5, 2e5), _between(1.1, 15.0), T, T, PRESSURE, T)


def cylinders() -> st.SearchStrategy[Cylinder]:
    """Cylinders of industrial size without a rod, with end stops at the ends of the stroke."""

    def build(bore: float, stroke: float, dead_A: float, dead_B: float, M: float, k_f: float) -> Cylinder:
        area = math.pi * bore**2 / 4
        half, end = area * stroke / 2, stroke / 2
        dead = dead_A * half, dead_B * half
        return Cylinder(bore, stroke, area, area, *dead, M=M, k_f=k_f, x_min=-end, x_max=end)

    bore, stroke, dead, M = _between(5e-3, 0.2), _between(10e-3, 2.0), _between(0.01, 0.5), _between(0.1, 100)
    return st.builds(build, bore, stroke, dead, dead, M, _zero_or_between(1.0, 1e4))


def plants() -> st.SearchStrategy[Plant]:
    """Plants with T_0 = T_amb, as at equilibrium."""

    def build(gas: Gas, valve: Valve, conditions: Conditions, cylinder: Cylinder, k_0: float) -> Plant:
        return Plant(gas, valve, conditions._replace(T_0=conditions.T_amb), cylinder, k_0)

    # `builds` would also draw the fields that have defaults.
    valves = st.tuples(_between(1e-9, 1e-5), _between(1.0, 20.0)).map(lambda values: Valve(*values))
    return st.builds(build, gases(), valves, conditions(), cylinders(), _zero_or_between(1e-3, 10.0))


def commands(steps: int, every: int = 50, high: float = 10.0) -> st.SearchStrategy[np.ndarray]:
    """Command of every step, V, shape (steps + 1,), held for `every` steps as in Table 3."""
    count = steps // every + 1
    level = _zero_or_between(1e-6, high) | _between(-high, -1e-6)
    values = st.lists(level, min_size=count, max_size=count)
    return values.map(lambda chosen: np.repeat(np.array(chosen), every)[: steps + 1])
