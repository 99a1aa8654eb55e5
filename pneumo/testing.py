"""Hypothesis strategies for cylinders, gases and signals, to test models with; needs Hypothesis.

Named by what they stand for. Plain floats in SI, finite, without subnormals.
Ranges are those of industrial servo-pneumatics with a wide margin. Quantities that may vanish give exactly
zero or a number of physical size.
"""

import math

import numpy as np

try:
    from hypothesis import strategies as st
except ImportError:
    raise ImportError("pneumo.testing needs Hypothesis: install pneumo[testing]") from None

from pneumo.configuration.experiment import Plant
from pneumo.physics.cylinder import Cylinder
from pneumo.physics.valve import Conditions, Valve, exact_gas


def _between(low, high):
    return st.floats(low, high, allow_nan=False, allow_infinity=False, allow_subnormal=False)


def _zero_or_between(low, high):
    return st.just(0.0) | _between(low, high)


def _zero_or_either_sign(low, high):
    return st.just(0.0) | _between(low, high) | _between(-high, -low)


def pressures(low=0.5e5, high=15e5):
    """Absolute pressure of a chamber or a supply, Pa."""
    return _between(low, high)


def temperatures(low=200.0, high=400.0):
    """Temperature of air, wall or surroundings, K."""
    return _between(low, high)


def pressure_ratios():
    """Downstream over upstream pressure at a throat, from vacuum to equal pressures."""
    return _zero_or_between(1e-6, 1.0)


def bores():
    """Diameter of the piston, m."""
    return _between(5e-3, 0.2)


def strokes():
    """Full stroke, m."""
    return _between(10e-3, 2.0)


def dead_volume_fractions():
    """Dead volume over half the stroke's volume."""
    return _between(0.01, 0.5)


def positions(fraction=0.96):
    """Position of the piston from mid-stroke as a fraction of half the stroke, from -fraction to fraction."""
    return _zero_or_either_sign(min(1e-6, fraction), fraction)


def velocities(high=3.0):
    """Velocity of the piston, m/s."""
    return _zero_or_either_sign(1e-6, high)


def volumes():
    """Volume of a chamber, m3."""
    return _between(1e-6, 1e-2)


def volume_rates():
    """Rate of change of a chamber's volume, m3/s."""
    return _zero_or_either_sign(1e-9, 1e-2)


def wall_areas():
    """Heat transfer area of a chamber, m2."""
    return _between(1e-4, 1.0)


def polytropic_indices(low=1.0, high=1.4):
    """Polytropic index n, from isothermal to adiabatic air."""
    return _between(low, high)


def grids():
    """Indices n of a study: some, increasing."""
    return st.lists(polytropic_indices(), min_size=1, max_size=20, unique=True).map(sorted)


def gammas():
    """Ratio of specific heats, from large molecules to a monatomic gas."""
    return _between(1.05, 5 / 3)


def gas_constants():
    """Specific gas constant, J/(kg K), from heavy vapours to helium."""
    return _between(80.0, 2100.0)


def conductances():
    """Thermal conductance k_0 at equilibrium, W/K."""
    return _zero_or_between(1e-3, 10.0)


def voltages(high=10.0):
    """Command of the servo-valve, V."""
    return _zero_or_either_sign(1e-6, high)


def throat_areas():
    """Area of one restriction of the valve, m2."""
    return _zero_or_between(1e-10, 1e-4)


def flows():
    """Mass flow in one direction, kg/s."""
    return _zero_or_between(1e-9, 0.05)


def masses():
    """Moving mass, kg."""
    return _between(0.1, 100.0)


def model_arguments():
    """Everything a reduced model reads, by name: the arguments of `paper_equations.M1` ... `M10`."""
    return st.fixed_dictionaries(
        {
            "P": pressures(),
            "V": volumes(),
            "dV_dt": volume_rates(),
            "m_in": flows(),
            "m_out": flows(),
            "T_amb": temperatures(),
            "T_in": temperatures(),
            "P_0": pressures(),
            "T_0": temperatures(),
            "n": polytropic_indices(),
            "gamma": gammas(),
            "R": gas_constants(),
            "k_0": conductances(),
            "A_q": wall_areas(),
            "A_q0": wall_areas(),
        }
    )


def area_ratios():
    """Heat transfer area over that at mid-stroke, or one leak's area over the other's."""
    return _between(0.05, 20.0)


def gases():
    """Gases whose sonic coefficient and critical ratio follow from R and gamma."""
    return st.builds(exact_gas, gas_constants(), gammas())


def conditions():
    """Supply above atmosphere, with any inlet, wall and equilibrium state."""
    return st.builds(
        lambda P_atm, ratio, T_in, T_amb, P_0, T_0: Conditions(ratio * P_atm, P_atm, T_in, T_amb, P_0, T_0),
        _between(0.5e5, 2e5),
        _between(1.1, 15.0),
        temperatures(),
        temperatures(),
        pressures(),
        temperatures(),
    )


def cylinders():
    """Cylinders of industrial size without a rod, with end stops at the ends of the stroke."""

    def build(bore, stroke, fraction, M, k_f):
        area = math.pi * bore**2 / 4
        dead_volume = fraction * area * stroke / 2
        return Cylinder(bore, stroke, area, area, dead_volume, M, k_f, -stroke / 2, stroke / 2)

    friction = _zero_or_between(1.0, 1e4)
    return st.builds(build, bores(), strokes(), dead_volume_fractions(), masses(), friction)


def plants():
    """Everything physical about an experiment, with T_0 = T_amb as at equilibrium."""

    def build(gas, valve, conditions, cylinder, k_0):
        return Plant(gas, valve, conditions._replace(T_0=conditions.T_amb), cylinder, k_0)

    valves = st.builds(lambda k_xu, u_max: Valve(k_xu, u_max), _between(1e-9, 1e-5), _between(1.0, 20.0))
    return st.builds(build, gases(), valves, conditions(), cylinders(), conductances())


def commands(steps, every=50, high=10.0):
    """Command of every step, V, shape (steps + 1,), held for `every` steps as in Table 3."""
    return _held(voltages(high), steps, every)


def references(steps, cylinder, every=50, fraction=0.9):
    """Position reference of every step, m, shape (steps + 1,), within a fraction of half the stroke."""
    return _held(positions(fraction), steps, every).map(lambda series: series * cylinder.stroke / 2)


def _held(levels, steps, every):
    count = steps // every + 1
    return st.lists(levels, min_size=count, max_size=count).map(
        lambda values: np.repeat(np.array(values), every)[: steps + 1]
    )
