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


def test_the_walls_area_is_that_of_both_ends_and_of_the_uncovered_bore():
    bore, stroke = 0.1, 0.5
    x = np.array([0.0, 0.25, 0.5])
    record = ClosedRecord("r", np.arange(3.0), x, np.ones((2, 3)), (1e-2, 1e-2), bore, stroke)
    ends, whole = np.pi / 2 * bore**2, np.pi * bore * stroke
    middle = ends + whole / 2
    np.testing.assert_allclose(
        record.area_ratio[0], [ends / middle, 1.0, (ends + whole) / middle], rtol=1e-12
    )
    np.testing.assert_allclose(record.area_ratio[1], record.area_ratio[0, ::-1], rtol=1e-12)


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


def test_the_records_gas_is_nitrogen_and_conductances_hold_at_10_bar_and_20_degrees():
    R = 8.314462618 / 28.0134e-3  # J/(kg K); five digits of it are written
    assert pytest.approx(R, rel=3e-5) == R_NITROGEN
    assert (GAMMA, P_0, T_WALL) == (7 / 5, 10e5, 20 + 273.15)


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


def test_a_law_without_wall_heat_is_replayed_as_a_polytrope_from_the_first_pressures():
    record = ClosedRecord(
        "r", T[:300], X[:300], np.repeat(FIRST[:, None], 300, 1), (0.0127, 0.0115), 0.127, 2.0
    )
    names = laws.fitted_names(laws.LAWS["free n"], leaks=False)
    problem = laws.ClosedProblem(record, laws.LAWS["free n"], names, 180)
    theta = np.array([2.0, 5.0, 1.1, 0.9, 1.25])  # over the scales
    assert problem.values(theta) == dict(zip(names, (0.02, 0.05, 1.1, 0.9, 1.25), strict=True))
    constant = problem.replay(theta, 300) * problem.volumes(problem.values(theta)) ** 1.25
    # Fourth-order steps of 0.02 s, as above.
    expected = (FIRST * [1.1, 0.9] * VOLUMES[:, 0] ** 1.25)[:, None]
    np.testing.assert_allclose(constant, expected * np.ones(300), rtol=1e-6)


LAW_OF_WALL = {
    "wall heat, constant": (0.0, 0.0),
    "wall heat, root of PT": (0.0, 0.5),
    "wall heat, area and root of PT": (1.0, 0.5),
}
SHORT = ClosedRecord("r", T[:40], X[:40], np.repeat(FIRST[:, None], 40, 1), (0.0127, 0.0115), 0.127, 2.0)


def problem_of(law, leaks=True, **changes):
    names = laws.fitted_names(laws.LAWS[law], leaks)
    return laws.ClosedProblem(SHORT, laws.LAWS[law], names, 30)._replace(**changes)


@pytest.mark.parametrize(("law", "n"), [("isothermal", 1.0), ("adiabatic", GAMMA)])
def test_each_law_without_wall_heat_has_its_index(law, n):
    constant = problem_of(law).replay(np.array([2.0, 5.0, 1.0, 1.0, 0.0]), 40) * VOLUMES[:, :40] ** n
    np.testing.assert_allclose(constant, constant[:, :1] * np.ones(40), rtol=1e-6)  # as above


@pytest.mark.parametrize("law", LAW_OF_WALL)
def test_each_law_of_the_wall_has_its_exponents(law):
    problem, k, start = problem_of(law), np.array([3000.0, 2000.0]), np.array([1.1, 0.9])
    theta = np.array([2.0, 5.0, *start, *k / 10.0, 2.0])
    values = problem.values(theta)
    assert values == pytest.approx(
        dict(zip(problem.names, (0.02, 0.05, *start, *k, 2e-9), strict=True)), rel=1e-12
    )
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    motion = SHORT.P, (True, True), problem.volumes(values), SHORT.area_ratio
    expected = laws.closed_chambers(FIRST, *motion, SHORT.h, start, GAMMA, k, *LAW_OF_WALL[law], 2e-9, *gas)
    np.testing.assert_allclose(problem.replay(theta, 40), expected, rtol=1e-12)


def test_one_chamber_is_closed_alike_whichever_it_is():
    """It takes heat from the wall, and leaks into an open one at the lowest pressure."""
    open_P = np.full(40, 0.9 * SHORT.P[0, :40].min())
    gas = (R_NITROGEN, GAMMA, T_WALL, P_0 * T_WALL)
    found = []
    for order in (1, -1):
        measured, closed = np.array([SHORT.P[0, :40], open_P])[::order], (True, False)[::order]
        V, ratio = (np.array([each[0, :40]] * 2) for each in (VOLUMES, SHORT.area_ratio))
        k, start = np.array([0.03, 0.02])[::order], np.array([1.1, 0.9])[::order]
        motion = measured, closed, V, ratio
        P = laws.closed_chambers(measured[:, 0], *motion, H, start, GAMMA, k, 1.0, 0.5, 2e-9, *gas)
        found.append(P[::order])
    np.testing.assert_array_equal(*found)
    assert np.ptp(found[0][0]) > 1e3


@pytest.mark.parametrize("side", [0, 1])
def test_a_chamber_that_is_left_out_keeps_its_measured_pressure(side):
    P = problem_of("adiabatic", chambers=(side,)).replay(np.array([2.0, 5.0, 1.0, 1.0, 0.0]), 40)
    np.testing.assert_array_equal(P[1 - side], SHORT.P[1 - side])
    assert np.ptp(P[side]) > 1e3


def test_a_search_is_between_bounds_that_leave_room_about_what_is_likely(monkeypatch):
    monkeypatch.setattr(laws, "least_squares", lambda residual, start, **options: (start, options))
    problem = problem_of("adiabatic", names=laws.PARAMETERS)
    start, options = problem.solve(most=7)
    low, high = (dict(zip(laws.PARAMETERS, ends, strict=True)) for ends in options["bounds"])
    for side in "AB":
        # A first temperature or pressure up to twice or half the measured one; at least 0.1 L of dead volume.
        assert (low[f"start_{side}"], high[f"start_{side}"]) == (0.5, 2.0)
        assert low[f"V_d_{side}"] * laws.SCALES[f"V_d_{side}"] == pytest.approx(1e-4, rel=1e-12)
        assert low[f"k_{side}"] == 0.0
    assert (low["n"], high["n"], low["leak"]) == (0.8, 2.0, 0.0)  # noise may lead beyond 1 to gamma
    assert {name for name in high if high[name] == np.inf} == {"V_d_A", "V_d_B", "k_A", "k_B", "leak"}
    assert all(low[name] < at < high[name] for name, at in zip(laws.PARAMETERS, start, strict=True))
    assert start[-1] < 0.1  # a piston's seal is nearly tight
    assert (options["x_scale"], options["max_nfev"]) == ("jac", 7)


def test_what_is_fixed_is_not_searched_and_has_its_value(monkeypatch):
    seen = []

    def search(residual, start, bounds, **_options):
        residual(start + 0.5)
        return start, bounds

    monkeypatch.setattr(laws, "least_squares", search)
    monkeypatch.setattr(laws.ClosedProblem, "residual", lambda _self, theta: seen.append(theta.tolist()))
    problem = problem_of("free n", leaks=False)
    start, bounds = problem.solve(np.array([1.0, 2.0, 1.1, 0.9, 1.3]), V_d_B=7.0)
    assert start.tolist() == [1.0, 1.1, 0.9, 1.3] and seen == [[1.5, 7.0, 1.6, 1.4, 1.8]]
    assert [len(ends) for ends in bounds] == [4, 4]


def test_a_replay_that_fails_is_as_bad_as_one_that_is_off_by_1_MPa(monkeypatch):
    off = np.zeros((2, 40))
    off[0, [1, 3, 5, 7]], off[1, [1, 3, 5]] = (5e5, np.nan, np.inf, -2e9), (-3e5, 0.9e9, -np.inf)
    monkeypatch.setattr(laws.ClosedProblem, "replay", lambda self, _theta, n: (SHORT.P + off)[:, :n])
    expected = np.zeros((2, 30))
    expected[0, [1, 3, 5, 7]], expected[1, [1, 3, 5]] = (0.5, 1.0, 1.0, 1.0), (-0.3, 900.0, 1.0)
    residual = problem_of("adiabatic", every=1).residual(np.zeros(5))
    np.testing.assert_allclose(residual, expected.ravel(), atol=1e-9)
    # Every second sample of B alone:
    residual = problem_of("adiabatic", every=2, chambers=(1,)).residual(np.zeros(5))
    np.testing.assert_allclose(residual, expected[1, ::2], atol=1e-9)
    assert len(problem_of("adiabatic").residual(np.zeros(5))) == 2 * 6  # 0.1 s apart, of 0.6 s


def test_errors_are_those_of_the_part_fitted_and_of_the_rest():
    off = np.where(np.arange(40) < 30, [[3.0], [-4.0]], [[50.0], [60.0]])
    fitted, held_out = problem_of("adiabatic").errors(SHORT.P + off)
    np.testing.assert_allclose((fitted, held_out), ((3.0, 4.0), (50.0, 60.0)), rtol=1e-6)


@pytest.mark.parametrize(("change", "still"), [((0.0, 0.045), True), ((0.0, 0.055), False)])
@pytest.mark.parametrize("order", [1, -1])
def test_pressures_that_change_by_less_than_5_percent_are_still(change, still, order):
    part = np.linspace(-0.5, 0.5, 40)
    P = np.array([4e5 * (1 + each * part) for each in change[::order]])
    assert laws.is_still(SHORT._replace(P=P)) == still
