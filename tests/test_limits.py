"""Limiting cases of section 3 of the paper: where one model is another.

Equalities between models are exact: the same operations run on the same numbers, and the terms left out are
multiplied by zero or raised to the power zero.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_rates import arguments, evaluate, rate

from pneumo import testing as some
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.valve import Gas, exact_gas

EPS = np.finfo(float).eps

# A model, the model that it becomes, and where: argument -> number, or name of the argument that it equals.
LIMITS = [
    ("M2", "M1", {"n": 1.0}),
    ("M2", "M3", {"n": "gamma"}),
    ("M5", "M1", {"n": 1.0}),
    ("M6", "M1", {"n": 1.0, "T_in": "T_0"}),
    ("M7", "M3", {"n": 1.0, "T_amb": "T_0"}),
    *((model, "M3", {"n": 1.0, "T_amb": "T_0", "T_in": "T_0"}) for model in ("M8", "M9", "M10")),
    ("M7", "M5", {"n": "gamma", "k_0": 0.0}),
    *((model, "M6", {"n": "gamma", "k_0": 0.0}) for model in ("M8", "M9", "M10")),
    ("M6", "M5", {"m_in": 0.0}),
    ("M8", "M7", {"m_in": 0.0}),
    ("M6", "M5", {"T_in": "T"}),
    ("M8", "M7", {"T_in": "T"}),
    ("M9", "M8", {"A_q": "A_q0"}),
]


def at(a, where):
    """Arguments with those of `where` set; "T" is the polytropic temperature, eq (6)."""
    a = a | {"T": evaluate("M5", a)[0]}
    return {**a, **{key: a[value] if isinstance(value, str) else value for key, value in where.items()}}


@given(arguments())
def test_a_model_is_another_in_its_limit(a):
    for model, limit, where in LIMITS:
        assert evaluate(model, at(a, where)) == evaluate(limit, at(a, where)), (model, limit, where)


@given(arguments(), st.sampled_from([0.5, 1.0, 2.0]))
def test_M8_M9_and_M10_are_one_at_the_equilibrium_area_and_product_of_P_and_T(a, factor):
    T = a["T_0"] / factor
    a = a | {"P": a["P_0"] * factor, "A_q": a["A_q0"]}  # powers of two: P T = P_0 T_0 exactly
    assert rate("M8", a, T) == rate("M9", a, T) == rate("M10", a, T)


# Equilibrium pressure, Appendix 2

ROOT = 0.807458  # P_0 / P_s of the exact law for air, found independently of this code
SONIC_FROM = 2.344  # P_s / P_atm from which the leak to the atmosphere is sonic


@given(some.gas_constants(), st.floats(SONIC_FROM, 100.0), some.pressures(0.5e5, 2e5))
def test_P_0_is_0_807458_P_s_for_air_wherever_the_exhaust_is_sonic(R, ratio, P_atm):
    P_0 = equilibrium_pressure(ratio * P_atm, P_atm, exact_gas(R, 1.4))
    assert P_0 / (ratio * P_atm) == pytest.approx(ROOT, abs=1e-6)


@pytest.mark.parametrize("P_s", [3e5, 7e5])
def test_P_0_is_the_printed_0_8077_P_s(P_s):
    # 3e-4 covers the rounded 0.0404 of the paper, and an R near 287 that it does not print.
    assert equilibrium_pressure(P_s, 1e5, exact_gas(287.0, 1.4)) / P_s == pytest.approx(0.8077, abs=3e-4)
    printed = Gas(287.0, 1.4, 0.0404, 0.5283)
    assert equilibrium_pressure(P_s, 1e5, printed) / P_s == pytest.approx(0.80760, abs=5e-6)  # five digits
