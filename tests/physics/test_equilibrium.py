"""Equilibrium pressure of Appendix 2: the half-bridge of two leaking restrictions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from pneumo import testing as some
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.valve import exact_gas, mass_flow

AIR = exact_gas(287.0, 1.4)


def surplus(P, P_s, P_atm, gas):
    """Leak in less leak out, clamped to where both flow forwards."""
    P = min(max(P, P_atm), P_s)
    return mass_flow(1.0, P_s, P, 1.0, gas) - mass_flow(1.0, P, P_atm, 1.0, gas)


@given(some.gases(), some.conditions(), st.booleans())
def test_root_is_that_of_scipy(gas, conditions, elliptic):
    P_s, P_atm, gas = conditions.P_s, conditions.P_atm, gas._replace(elliptic=elliptic)
    root = brentq(surplus, P_atm, P_s, (P_s, P_atm, gas), xtol=1e-12 * P_atm, rtol=1e-15)
    assert equilibrium_pressure(P_s, P_atm, gas) == pytest.approx(root, rel=1e-12)


@pytest.mark.parametrize(
    ("P_s", "P_atm"), [(1e5, 1e5), (0.9e5, 1e5), (7e5, 0.0), (7e5, -1.0), (float("nan"), 1e5)]
)
def test_supply_must_exceed_atmosphere(P_s, P_atm):
    with pytest.raises(ValueError) as error:
        equilibrium_pressure(P_s, P_atm, AIR)
    assert str(error.value) == f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)"
