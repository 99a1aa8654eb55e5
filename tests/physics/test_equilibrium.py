"""Equilibrium pressure of Appendix 2: the half-bridge of two leaking restrictions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from pneumo import testing as some
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.valve import exact_gas, mass_flow

AIR = exact_gas(287.0, 1.4)
ROOT, SONIC_FROM = 0.807458, 2.344  # as in tests/test_limits.py


def surplus(P, P_s, P_atm, gas, area_ratio):
    """Leak in less leak out, clamped to where both flow forwards."""
    P = min(max(P, P_atm), P_s)
    return mass_flow(area_ratio, P_s, P, 1.0, gas) - mass_flow(1.0, P, P_atm, 1.0, gas)


@given(some.gases(), some.conditions(), some.area_ratios())
def test_leaks_balance_for_any_supply_and_any_leak_area(gas, conditions, area_ratio):
    P_s, P_atm = conditions.P_s, conditions.P_atm
    P_0 = equilibrium_pressure(P_s, P_atm, gas, area_ratio)
    assert P_atm <= P_0 <= P_s
    # The solver stops at 1e-9 P_atm; the surplus changes sign within twice that. Residuals themselves say
    # little: near equal pressures the flow law is infinitely steep.
    margin = 2e-9 * P_atm
    assert surplus(P_0 - margin, P_s, P_atm, gas, area_ratio) >= 0
    assert surplus(P_0 + margin, P_s, P_atm, gas, area_ratio) <= 0


@given(some.gases(), some.conditions(), some.area_ratios(), st.booleans())
def test_root_is_that_of_scipy(gas, conditions, area_ratio, elliptic):
    # The same steps in the same order; 1e-12, many roundings, where its compiler fuses products and sums.
    P_s, P_atm, gas = conditions.P_s, conditions.P_atm, gas._replace(elliptic=elliptic)
    root = brentq(surplus, P_atm, P_s, (P_s, P_atm, gas, area_ratio), xtol=1e-9 * P_atm, rtol=1e-14)
    assert equilibrium_pressure(P_s, P_atm, gas, area_ratio) == pytest.approx(root, rel=1e-12)


@given(some.gas_constants(), some.gas_constants(), some.gammas(), some.conditions(), some.area_ratios())
def test_root_does_not_depend_on_R(R_1, R_2, gamma, conditions, area_ratio):
    one, other = (
        equilibrium_pressure(conditions.P_s, conditions.P_atm, exact_gas(R, gamma), area_ratio)
        for R in (R_1, R_2)
    )
    # Each is good to 1e-9 P_atm, the solver's tolerance.
    assert one == pytest.approx(other, abs=2e-9 * conditions.P_atm)


def test_root_leaves_its_constant_value_at_the_stated_limit():
    exact_limit = 1 / (ROOT * AIR.critical_ratio)  # P_atm / P_0 is critical there
    assert exact_limit == pytest.approx(SONIC_FROM, abs=5e-4)  # its digits
    below, above = (
        equilibrium_pressure(ratio * 1e5, 1e5, AIR) / (ratio * 1e5) - ROOT
        for ratio in (exact_limit - 0.1, exact_limit + 0.1)
    )
    assert abs(above) < 1e-6 < 100 * 1e-6 < abs(below)


@given(some.conditions(), some.area_ratios(), some.area_ratios())
def test_more_leak_from_the_supply_more_pressure(conditions, one, other):
    low, high = (
        equilibrium_pressure(conditions.P_s, conditions.P_atm, AIR, ratio) for ratio in sorted((one, other))
    )
    assert low <= high + 2e-9 * conditions.P_atm  # the solver's tolerance, twice


@pytest.mark.parametrize(
    ("P_s", "P_atm"), [(1e5, 1e5), (0.9e5, 1e5), (7e5, 0.0), (7e5, -1.0), (float("nan"), 1e5)]
)
def test_supply_must_exceed_atmosphere(P_s, P_atm):
    with pytest.raises(ValueError) as error:
        equilibrium_pressure(P_s, P_atm, AIR)
    assert str(error.value) == f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)"
