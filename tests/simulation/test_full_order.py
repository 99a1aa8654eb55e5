"""Full-order runs: against an independent solver, symmetry and end stops."""

from itertools import pairwise

import numpy as np
import pytest
from array_equations import array_rates
from brief import in_brief
from hypothesis import given
from hypothesis import strategies as st
from paper_study import STUDY, lasting
from scipy.integrate import solve_ivp

from pneumo import testing as some
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import DIVERGED, NOT_POSITIVE, RAN, equilibrium, failure, record, run


def scale_of(e):
    """Size of each state: half the stroke, 1 m/s, equilibrium pressure and temperature."""
    c = e.plant.conditions
    return np.array([e.plant.cylinder.stroke / 2, 1.0, *[c.P_0, c.T_0] * 2])


def solved(e, reference, rtol):
    """States at every step by scipy's eighth-order method, started afresh where the reference jumps."""
    jumps = [0, *np.nonzero(np.diff(reference[:-1]))[0] + 1, len(reference) - 1]
    states = [equilibrium(e.plant)[np.newaxis]]
    for start, end in pairwise(jumps):
        t = np.arange(start, end + 1) * e.h
        # A longer first trial may leave the positive pressures.
        options = {"rtol": rtol, "atol": rtol * scale_of(e), "max_step": e.h, "args": (reference[start], e)}
        rate, span = lambda _, y, r, e: array_rates(y, r, e), (t[0], t[-1])
        piece = solve_ivp(rate, span, states[-1][-1], "DOP853", t, **options)
        assert piece.success
        states.append(piece.y.T[1:])
    return np.concatenate(states)


def with_rod_and_hose(e):
    """A rod of half the bore takes a quarter of chamber B's area; the load balances it at equilibrium."""
    c = e.plant.cylinder
    load = -e.plant.conditions.P_0 * 0.25 * c.A_A
    return e._replace(
        plant=e.plant._replace(cylinder=c._replace(A_B=0.75 * c.A_A, V_d_B=2 * c.V_d_A, load=load))
    )


SMOOTH = {name: STUDY.experiments[name] for name in ("E01", "E09", "E07", "E15")}
SMOOTH["single rod, long hose"] = with_rod_and_hose(SMOOTH["E15"])


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("voltage", [0.5, -2.0])
def test_smooth_run_against_dop853(name, voltage):
    # 60 ms of steady command from equilibrium: one chamber fills below the sonic limit and below supply
    # pressure, the other empties far above it, and nothing reaches a stop, the limiter or equal pressures.
    # The fastest motion swings at omega = (2 gamma P_0 A^2 / (V M))^(1/2), below 80 rad/s; a step of order
    # five errs by about (omega h)^6 / 6! = 4e-10 of it, and 60 of them add up to 2e-8 at most.
    e, reference = SMOOTH[name], np.full(61, voltage)
    states = run(equilibrium(e.plant), reference, 0.0, e.drive, e.plant, e.h).states
    c, filling = e.plant.conditions, states[:, 2 if voltage > 0 else 4]
    assert (filling / c.P_s > 0.6).all() and (filling / c.P_s < 0.95).all()
    assert abs((states - solved(e, reference, 1e-12)) / scale_of(e)).max() < 2e-8
    if name == "E09":  # the bound is so narrow that it sees k_0's fifth digit
        other = e.plant._replace(k_0=e.plant.k_0 * (1 + 1e-4))
        change = run(equilibrium(other), reference, 0.0, e.drive, other, e.h).states - states
        assert abs(change / scale_of(e)).max() > 2e-8


@given(st.sampled_from(list(STUDY.experiments)), some.conductances(), st.booleans())
def test_equilibrium_stays_to_the_last_bit(name, k_0, closed):
    # Equal pressures, T_0 = T_amb and u = 0: every term is zero, not merely small.
    e = STUDY.experiments[name]
    plant = e.plant._replace(k_0=k_0)
    drive = e.drive._replace(closed_loop=closed)
    states = run(equilibrium(plant), np.zeros(201), 0.0, drive, plant, e.h).states
    assert (states == equilibrium(plant)).all()


@pytest.mark.parametrize("name", ["E01", "E06", "E11", "E16"])
def test_mirrored_reference_gives_the_mirrored_run(name):
    # The two chambers are alike and IEEE arithmetic is symmetric in sign: equality, not closeness.
    e = lasting(name, 5.0)
    reference = reference_series(e.drive, e.excitation, e.steps)
    states = run(equilibrium(e.plant), reference, 0.0, e.drive, e.plant, e.h).states
    mirrored = run(equilibrium(e.plant), -reference, 0.0, e.drive, e.plant, e.h).states
    assert np.array_equal(mirrored[:, :2], -states[:, :2])
    assert np.array_equal(mirrored[:, 2:], states[:, [4, 5, 2, 3]])
    assert np.ptp(states[:, 0]) > 0.1 * e.plant.cylinder.stroke


@pytest.mark.parametrize("name", ["E01", "E11"])
def test_piston_driven_against_its_stops(name):
    # Full command, changing sign every second, and no forced sign: each stroke ends at a stop.
    e = STUDY.experiments[name]
    stop = e.plant.cylinder.x_max
    reference = np.repeat([10.0, -10.0, 10.0, -10.0], 1000)
    drive = e.drive._replace(x_reverse=np.inf)
    states = run(equilibrium(e.plant), np.append(reference, 0.0), 0.0, drive, e.plant, e.h).states
    x, v = states[:, 0], states[:, 1]
    assert (abs(x) <= stop).all()
    at_stop = abs(x) == stop
    assert (v[at_stop] * np.sign(x[at_stop]) <= 0).all()
    impacts = np.nonzero(~at_stop[:-1] & at_stop[1:])[0] + 1
    assert {np.sign(x[k]) for k in impacts} == {-1.0, 1.0}
    assert (v[impacts] == 0).all() and (abs(v[impacts - 1]) > 0.01).all()
    for sign in (1, -1):  # of the steps to the first stop, that alone is halved which ends far beyond it
        short = sign * reference[: impacts[0] + 1]
        halvings = run(equilibrium(e.plant), short, 0.0, drive, e.plant, e.h, 6).halvings
        assert halvings[-1] > 3 and not halvings[:-1].any()
    # The driving pressure still rises after the impact, so the piston rests until the sign changes.
    for k in (1000, 2000, 3000, 4000):
        assert at_stop[k - 500 : k].all() and (v[k - 500 : k] == 0).all()
    assert np.isfinite(states).all() and (states[:, 2:] > 0).all()


@pytest.mark.parametrize("side", [-1, 1])
def test_a_resting_piston_stays_under_force_and_leaves_without(side):
    e = STUDY.experiments["E14"]
    cylinder = e.plant.cylinder._replace(x_min=-0.015, x_max=0.015)
    plant = e.plant._replace(cylinder=cylinder)
    drive = e.drive._replace(closed_loop=False)
    start = equilibrium(plant)
    start[0] = side * 0.015
    c = plant.conditions
    start[2:] = [(1 - 0.2 * side) * c.P_0, c.T_0, (1 + 0.2 * side) * c.P_0, c.T_0]
    push_back = 0.4 * c.P_0 * cylinder.A_A  # of the air, towards the centre
    held = run(start, np.zeros(501), side * 1.01 * push_back, drive, plant, e.h).states
    assert (held[:, 0] == side * 0.015).all() and (held[:, 1] == 0).all()
    left = run(start, np.zeros(21), side * 0.99 * push_back, drive, plant, e.h).states
    assert (left[1:, 0] * side < 0.015).all() and (left[1:, 1] * side < 0).all()


OPEN_LOOP = [name for name, e in STUDY.experiments.items() if not e.drive.closed_loop]


@pytest.mark.parametrize("name", in_brief(OPEN_LOOP, set(OPEN_LOOP) - {"E03"}))  # half an hour
def test_open_loop_piston_is_turned_before_the_ends(name):
    # At full length: forcing the sign at 96 % leaves 4 % of the half-stroke to come to a halt.
    e = STUDY.experiments[name]
    recording = record(e)
    x = recording.states[:, 0]
    assert abs(x).max() < e.plant.cylinder.x_max
    beyond = abs(x) >= e.drive.x_reverse
    on_time = record(e._replace(drive=e.drive._replace(late=0.0))).u if e.drive.late else recording.u
    assert (on_time[beyond] * x[beyond] < 0).all()
    assert beyond.any()


@pytest.mark.parametrize(
    ("state", "value", "status"),
    [
        *((state, value, DIVERGED) for state in range(6) for value in (np.inf, -np.inf, np.nan)),
        *((state, value, NOT_POSITIVE) for state in range(2, 6) for value in (0.0, -0.5)),
        *((state, 0.5, RAN) for state in range(2, 6)),
        *((state, -0.5, RAN) for state in range(2)),
    ],
)
def test_a_run_has_failed_where_a_state_is_no_number_or_a_pressure_or_temperature_not_positive(
    state, value, status
):
    states = np.tile([0.01, -0.2, 5e5, 293.0, 4e5, 280.0], (6, 1))
    states[4, state] = value
    assert failure(states) == (status, -1 if status == RAN else 4)
    other = (state + 1) % 6
    states[:, other] = np.nan  # not measured
    assert failure(states) == (status, -1 if status == RAN else 4)


def test_coulomb_friction_brakes_as_a_constant_force_and_holds_what_is_below_it():
    # Shut valve, equal pressures, a huge dead volume: only friction acts, v falls by coulomb / M per second.
    e = lasting("E14", 0.2)
    cylinder = e.plant.cylinder._replace(coulomb=6.0, k_f=0.0, M=2.0, V_d_A=1e3, V_d_B=1e3)
    plant = e.plant._replace(cylinder=cylinder, k_0=0.0)
    y_0, drive = equilibrium(plant), e.drive._replace(closed_loop=False)
    y_0[1] = 0.15
    v = run(y_0, np.zeros(e.steps + 1), 0.0, drive, plant, e.h).states[:, 1]
    expected = np.maximum(0.15 - 6.0 / 2.0 * e.h * np.arange(e.steps + 1), 0)
    # The air's spring, 2 gamma P_0 A^2 / V_d = 1.6e-4 N/m, over 4 mm and 50 ms; a whole step where it stops.
    np.testing.assert_allclose(v[:49], expected[:49], atol=2e-8)
    np.testing.assert_allclose(v[49:], 0, atol=6.0 / 2.0 * e.h)
    assert v[-1] == 0
    e = lasting("E14", 0.1)
    drive, zeros = e.drive._replace(closed_loop=False), np.zeros(e.steps + 1)
    for weight, moves in ((9.9, False), (10.1, True)):
        plant = e.plant._replace(cylinder=e.plant.cylinder._replace(load=-weight, coulomb=10.0))
        x = run(equilibrium(plant), zeros, 0.0, drive, plant, e.h).states[:, 0]
        assert (x[-1] < 0) == moves
        assert np.any(x) == moves


@pytest.mark.parametrize("name", ["E09", "E11"])
def test_order_five_on_the_full_order_system(name):
    # Smooth: 0.2 of the limiter's voltage from equilibrium, A fills below the sonic limit and below supply
    # pressure, B empties far above it, and the piston swings at its 40 to 80 rad/s, away from the stops.
    e = STUDY.experiments[name]
    conditions = e.plant.conditions
    t_end = 0.064
    steps = np.array([8, 16, 32, 64])  # 8 ms to the study's 1 ms: omega h from 0.6 down to 0.04

    def final(n):
        states = run(equilibrium(e.plant), np.full(n + 1, 2.0), 0.0, e.drive, e.plant, t_end / n).states
        assert (np.abs(states[:, 0]) < 0.9 * e.plant.cylinder.x_max).all()
        ratio_in, ratio_out = states[:, 2] / conditions.P_s, conditions.P_atm / states[:, 4]
        assert (ratio_in > 0.6).all() and (ratio_in < 0.95).all() and (ratio_out < 0.45).all()
        return states[-1]

    exact = final(1024)
    ends = np.array([final(n) for n in steps])
    scale = np.array([0.1, 1, *[conditions.P_0, conditions.T_0] * 2])
    errors = np.sqrt((((ends - exact) / scale) ** 2).mean(axis=1))
    assert 4.7 < -np.polyfit(np.log(steps), np.log(errors), 1)[0] < 5.4
