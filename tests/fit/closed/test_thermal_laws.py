"""Closed chambers on a moving piston: balances, what a fit finds, records that travel with the source."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

from pneumo.fit.closed import thermal_laws as laws
from pneumo.fit.closed.thermal_laws import GAMMA, P_0, R_NITROGEN, T_WALL, ClosedRecord, fit_law
from pneumo.fit.fit_result import Estimate

DATA = Path(__file__).parents[3] / "data" / "mbari"
H = 0.02  # s, as in the records
T = H * np.arange(1500)
X = 0.9 - 0.4 * np.cos(2 * T) + 0.3 * np.sin(0.7 * T)  # m
VOLUMES = np.array([0.02 + 0.0127 * X, 0.05 + 0.0115 * (2.0 - X)])
FIRST = np.array([8e5, 1.1e6])


def run(k=(0.0, 0.0), n=GAMMA, leak=0.0, volumes=VOLUMES):
    one = np.ones(2)
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    ratio = np.ones_like(volumes)
    motion = volumes, (True, True), volumes, ratio
    return laws.closed_chambers(FIRST, *motion, H, one, n, np.array(k), 0.0, 0.0, leak, *gas)


@pytest.mark.parametrize("n", [1.0, 1.2, GAMMA])
def test_without_wall_heat_and_leakage_the_polytrope_is_followed(n):
    constant = run(n=n) * VOLUMES**n
    # Fourth-order steps of 0.02 s, while the volume changes in a second: (0.02)^4.
    np.testing.assert_allclose(constant, constant[:, :1] * np.ones_like(T), rtol=1e-6)


def test_much_wall_heat_is_isothermal_and_little_is_adiabatic():
    isothermal, adiabatic = run(n=1.0), run()
    much, little = run(k=(1.5e4, 4.4e4)), run(k=(1e-3, 1e-3))
    apart = np.abs(isothermal - adiabatic).max()
    # Time constants of 15 ms beside motion at 2 rad/s: temperatures lag by 0.03 of what they would change.
    assert np.abs(much - isothermal).max() < 0.05 * apart
    assert np.abs(little - adiabatic).max() < 0.001 * apart


def test_leakage_moves_gas_from_the_higher_pressure_and_loses_none():
    still = np.repeat(VOLUMES[:, :1], 1500, axis=1)
    P = run(k=(1e3, 1e3), leak=2e-7, volumes=still)
    gas = (P * still).sum(axis=0) / (R_NITROGEN * T_WALL)
    assert P[1, -1] < P[1, 0] and P[0, -1] > P[0, 0]
    assert P[0, -1] == pytest.approx(P[1, -1], rel=1e-3)
    assert gas[-1] == pytest.approx(gas[0], rel=1e-6)  # all at the wall's temperature again


@pytest.mark.parametrize("order", [1, -1])
def test_gas_leaks_from_an_open_chamber_at_its_pressure_between_samples(order):
    """Chamber A keeps volume and temperature; B is open, and its pressure rises on a line; or A and B."""
    leak, count = 2e-8, 200
    V, T_wall = VOLUMES[::order, :1], T_WALL
    still = np.repeat(V, count, axis=1)
    t = H * np.arange(count)
    measured = np.array([np.full(count, 8e5), 8e5 + 1e5 * t / t[1]])[::order]  # 1 bar in each sample
    gas = (R_NITROGEN, GAMMA, T_wall, P_0 * T_wall)
    motion = measured, (True, False)[::order], still, np.ones_like(still)
    P = laws.closed_chambers(measured[:, 0], *motion, H, np.ones(2), 1.0, np.zeros(2), 0.0, 0.0, leak, *gas)
    P, measured, V = P[::order], measured[::order], V[::order]
    np.testing.assert_array_equal(P[1], measured[1])
    # V / (R T) dP_A/dt = leak (P_B - P_A): behind a ramp by its slope times the time constant, less a decay.
    tau = V[0, 0] / (R_NITROGEN * T_wall * leak)
    expected = measured[1] - 1e5 / H * tau * (1 - np.exp(-t / tau))
    # Steps of fourth order, a thousandth of the time constant or less.
    assert H / tau < 2e-3
    np.testing.assert_allclose(P[0], expected, rtol=1e-8)


def test_a_fit_finds_what_made_the_record():
    volumes = np.array([0.024 + 0.0127 * X, 0.051 + 0.0115 * (2.0 - X)])
    P = run(k=(25.0, 60.0), volumes=volumes)
    record = laws.ClosedRecord("made", T, X, P, (0.0127, 0.0115), 0.127, 2.0)
    law_fit = fit_law(record, laws.LAWS["wall heat, constant"], leaks=False)
    truth = {"V_d_A": 0.024, "V_d_B": 0.051, "k_A": 25.0, "k_B": 60.0, "start_A": 1.0, "start_B": 1.0}
    # The same steps made the record, without noise: what is left is where least squares ends.
    assert {name: law_fit.values[name] for name in truth} == pytest.approx(truth, rel=1e-3)
    assert law_fit.held_out.max() < 1e-4 * P_0
    wrong = fit_law(record, laws.LAWS["free n"], leaks=False)
    assert wrong.held_out.min() > 10 * law_fit.held_out.max()


def test_records_travel_with_units_licence_and_provenance():
    files = sorted(DATA.glob("*.nc"))
    assert len(files) == 4
    assert sum(file.stat().st_size for file in files) <= 3_000_000
    assert "Apache License" in (DATA / "LICENSE").read_text()
    for file in files:
        with xr.open_dataset(file, decode_times=False) as data:
            assert [data[name].attrs["units"] for name in ("t", "x", "P_A", "P_B")] == ["s", "m", "Pa", "Pa"]
            assert "Apache-2.0" in data.attrs["license"] and "osrf/mbari_wec_gz" in data.attrs["source"]
    still = [laws.is_still(laws.read_closed_record(file)) for file in files]
    assert still == ["vented" in file.stem for file in files]


def test_a_record_is_read_with_the_pistons_areas():
    file = DATA / "friction.nc"
    record = laws.read_closed_record(file)
    with xr.open_dataset(file, decode_times=False) as data:
        bore, rod = data.attrs["bore_m"], data.attrs["rod_m"]
        assert (record.name, record.bore, record.stroke) == ("friction", bore, data.attrs["stroke_m"])
        np.testing.assert_array_equal(record.P, [data["P_A"].values, data["P_B"].values])
        np.testing.assert_array_equal(record.x, data["x"].values)
    assert record.areas == pytest.approx((np.pi / 4 * bore**2, np.pi / 4 * (bore**2 - rod**2)), rel=1e-12)
    assert record.h == pytest.approx(0.02, rel=1e-9)


def test_laws_are_judged_without_and_with_leakage_on_the_part_held_out(monkeypatch):
    t = H * np.arange(10_000)
    record = ClosedRecord("r", t, 0 * t, np.ones((2, len(t))), (1e-2, 1e-2), 0.1, 0.5)

    def fitted(_record, law, leaks):
        error = (2.0 if leaks else 1.0) * (np.arange(len(t)) >= 6000)
        values = {"leak": 3.0 if leaks else 0.0, "start_A": law.e_A}
        rms = np.array([4.0, 5.0])
        return Estimate(values, {}, {}, rms, 2 * rms, record.P + error)

    monkeypatch.setattr(laws, "fit_law", fitted)
    found = laws.judged(record)
    assert found["value"].sel(parameter="leak").values.tolist() == [[0.0, 3.0]] * len(laws.LAWS)
    assert found["value"].sel(parameter="start_A").values[-1].tolist() == [1.0, 1.0]
    assert np.isnan(found["value"].sel(parameter="n")).all()
    assert found["fitted_rms"].values[0].tolist() == [[4.0, 5.0]] * 2
    assert found["held_out_rms"].values[0].tolist() == [[8.0, 10.0]] * 2
    # Without leakage, from the first sample held out on, for 60 s.
    assert (found["error"].values == 1.0).all()
    np.testing.assert_allclose(found["t"], 0.1 * np.arange(600), atol=1e-9)


@pytest.mark.parametrize("start", [(1.2, 1.0), (1.0, 1.2)])
@pytest.mark.parametrize("pressures", [(8e5, 3e5), (3e5, 8e5)])
def test_gas_that_leaks_takes_its_own_enthalpy_along(start, pressures):
    """Without wall heat and motion, the energy P V / (gamma - 1) of both chambers together is constant."""
    still = np.repeat(VOLUMES[:, :1], 200, axis=1)
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    motion = still, (True, True), still, np.ones_like(still)
    law = GAMMA, np.zeros(2), 0.0, 0.0, 2e-7
    P = laws.closed_chambers(np.array(pressures), *motion, H, np.array(start), *law, *gas)
    assert np.abs(P[:, -1] - P[:, 0]).min() > 1e4
    energy = (P * still).sum(axis=0)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)


def test_balances_are_those_of_an_independent_solver():
    """Volumes and wall areas on lines, walls by area and root of P T, a leak from the higher pressure."""
    count, k, leak, h = 101, np.array([60.0, 40.0]), 2e-8, 0.01
    t = h * np.arange(count)
    V_0, V_1 = np.array([0.02, 0.05]), np.array([0.01, -0.012])  # m^3 and m^3/s
    A_0, A_1 = np.array([1.1, 0.9]), np.array([0.3, -0.2])
    start, first = np.array([1.05, 0.95]), np.array([11e5, 8e5])

    def rates(at, y):
        P, m = y[:2] * 1e5, y[2:]
        V, area = V_0 + V_1 * at, A_0 + A_1 * at
        T = P * V / (m * R_NITROGEN)
        flow = leak * (P[0] - P[1])
        gain = flow * np.array([-1.0, 1.0])
        heat = k * area * np.sqrt(P * T / (P_0 * T_WALL)) * (T_WALL - T)
        enthalpy = GAMMA * R_NITROGEN * T[0 if flow > 0 else 1] * gain
        return np.concatenate([(enthalpy + (GAMMA - 1) * heat - GAMMA * P * V_1) / V / 1e5, gain])

    m = first * V_0 / (R_NITROGEN * T_WALL * start)
    y_0 = np.concatenate([first / 1e5, m])
    expected = 1e5 * solve_ivp(rates, (0, t[-1]), y_0, "DOP853", t, rtol=1e-11, atol=1e-12).y[:2]
    V, area = (a[:, None] + b[:, None] * t for a, b in ((V_0, V_1), (A_0, A_1)))
    law = GAMMA, k, 1.0, 0.5, leak
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    P = laws.closed_chambers(first, V, (True, True), V, area, h, start, *law, *gas)
    # Steps of fourth order, a twentieth of the fastest time constant: (m c_v / k = 0.2 to 1 s).
    np.testing.assert_allclose(P, expected, rtol=1e-7)


LAW_OF_WALL = {
    "wall heat, constant": (0.0, 0.0),
    "wall heat, root of PT": (0.0, 0.5),
    "wall heat, area and root of PT": (1.0, 0.5),
}
SHORT = ClosedRecord("r", T[:40], X[:40], np.repeat(FIRST[:, None], 40, 1), (0.0127, 0.0115), 0.127, 2.0)


def problem_of(law, leaks=True, **changes):
    names = laws.fitted_names(laws.LAWS[law], leaks)
    return laws.ClosedProblem(SHORT, laws.LAWS[law], names, 30)._replace(**changes)
