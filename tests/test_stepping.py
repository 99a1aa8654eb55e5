"""A cylinder that a controller drives step by step: `pneumo.Simulation`."""

import numpy as np
import pytest

import pneumo
from pneumo import Cylinder, InputError, Sensors, Simulation, State
from pneumo.equations.system import step, system

CYLINDER = Cylinder(0.02, 0.1, 3.14e-4, 3.0e-4, 1.6e-6, 1.7e-6, 2.0, 100.0, -0.05, 0.05)
H = 1e-3
COMMAND = 8 * np.sign(np.sin(np.arange(1001) / 40 + 0.1))


@pytest.fixture(scope="module")
def mine():
    return pneumo.plant(CYLINDER, k_xu=1e-7, u_max=10.0, P_s=7e5, k_0=0.5)


@pytest.mark.parametrize("start", ["rest", "vented", State(0.01, 0.1, 3e5, 300.0, 2e5, 280.0)])
def test_a_thousand_steps_are_one_simulation_to_the_last_bit(mine, start):
    run = pneumo.simulate(mine, H, command=COMMAND, start=start)
    sim = Simulation(mine, start=start, h=H)
    states = [sim.state, *(sim.step(u) for u in COMMAND[:-1])]
    assert np.array_equal(states, run.recording.states)
    assert sim.state == states[-1] == sim.measured()
    assert sim.t == pytest.approx(1.0)
    assert run.x.max() == CYLINDER.x_max


def test_a_longer_step_is_divided_and_a_shorter_one_is_a_step(mine):
    by_one, by_five, rest = (Simulation(mine, h=H) for _ in range(3))
    for u in COMMAND[:20]:
        for _ in range(5):
            by_one.step(u)
        by_five.step(u, 5 * H)
        rest.step(u, 2.5 * H)
        rest.step(u, 2.5 * H)
    assert by_five.state == by_one.state
    assert rest.state == pytest.approx(by_one.state, rel=1e-3, abs=1e-6)
    assert rest.t == pytest.approx(by_one.t)


@pytest.mark.parametrize(("model", "n"), [("M6", 1.2), ("M8", 1.3)])
def test_a_reduced_model_moves_the_piston_as_its_equations_do(mine, model, n):
    both, sim, worst = system(model, n, mine, piston=True), Simulation(mine, model=model, n=n, h=H), 0.0
    expected = both.at_rest
    for k in range(50):
        u, force = float(COMMAND[k]), 20.0
        expected = step(both, expected, [u, force], [u, force], H)
        x, v, P_A, _, P_B, _ = sim.step(u, force=force)
        worst = max(worst, abs(P_A - expected[2]), abs(P_B - expected[3]))
        assert x == pytest.approx(expected[0], abs=2e-5)  # m
        assert v == pytest.approx(expected[1], abs=2e-3)  # m/s
    assert worst < 500.0  # Pa: either method is of second order
    assert abs(sim.state.x) > 5e-3


def test_a_reduced_model_is_near_its_replay_and_has_its_own_temperature(mine):
    sim = Simulation(mine, model="M6", n=1.2, h=H)
    states = np.array([sim.state, *(sim.step(u) for u in COMMAND[:-1])])
    u, (x, v) = COMMAND, states[:, :2].T
    replayed = pneumo.replay("M6", 1.2, pneumo.recorded(mine, H, u=u, x=x, v=v, P_A=states[:, 2]))
    assert replayed.mse[0] ** 0.5 < 0.03 * np.ptp(states[:, 2])  # u is interpolated there, held here
    c = mine.conditions
    assert states[:, 3] == pytest.approx(c.T_0 * (states[:, 2] / c.P_0) ** (1 - 1 / 1.2))
    assert states[:, 0].min() >= CYLINDER.x_min and states[:, 0].max() <= CYLINDER.x_max


def test_a_force_holds_the_piston_of_either_order(mine):
    for model, n in (("full", None), ("M1", None)):
        sim = Simulation(mine, model=model, n=n, start="rest")
        for _ in range(500):
            sim.step(0.0, force=-3000.0)
        assert (sim.state.x, sim.state.v) == (CYLINDER.x_min, 0.0)


def test_reset_repeats_the_simulation_with_its_noise(mine):
    sim = Simulation(mine, start="vented", sensors=Sensors(noise={"x": 1e-4, "P_A": 500.0}, seed=3))
    first = [(sim.measured(), *sim.step(u)) for u in COMMAND[:50]]
    start = pneumo.simulate(mine, H, command=COMMAND[:2], start="vented").recording.states[0]
    assert np.array_equal(sim.reset(), start)
    assert sim.t == 0.0
    assert first == [(sim.measured(), *sim.step(u)) for u in COMMAND[:50]]
    other = Simulation(mine, start="vented", sensors=Sensors(noise={"x": 1e-4}, seed=4))
    assert other.measured().x != first[0][0].x


def test_sensors_have_their_noise_resolution_and_sample_time(mine):
    sensors = Sensors({"x": 1e-4, "P_A": 500.0}, {"x": 5e-5}, sample_time=2 * H, seed=1)
    sim = Simulation(mine, sensors=sensors)
    readings, states = [sim.measured()], [sim.state]
    for u in COMMAND[:-1]:
        states.append(sim.step(u))
        readings.append(sim.measured())
    assert readings[1::2] == readings[:-1:2]  # held for two steps
    error = np.array(readings[::2]) - np.array(states[::2])
    steps = np.array(readings)[:, 0] / 5e-5
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    # Standard deviations of 501 readings: within 15 % in all but one of 10^5 seeds.
    assert np.std(error[:, 0]) == pytest.approx((1e-4**2 + 5e-5**2 / 12) ** 0.5, rel=0.15)
    assert (
        abs(np.mean(error[:, 0])) < 1.8e-5
    )  # four standard deviations of the mean; rounding down has 2.5e-5
    assert np.std(error[:, 2]) == pytest.approx(500.0, rel=0.15)
    assert not error[:, [1, 3, 4, 5]].any()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"model": "M11"}, "model 'M11': no such model; there are M1, .*, M10, full"),
        ({"model": ["M6"]}, r"model \['M6'\]: no such model"),
        ({"model": "M6"}, "n: M6 needs a polytropic index"),
        ({"n": 1.2}, "n = 1.2: the full order has no n"),
        ({"model": "M6", "n": "1.2"}, "n = '1.2': must be a finite number, greater than 0, at most 3"),
        ({"h": 0.0}, "h = 0: must be a finite number, greater than 0"),
        ({"start": "middle"}, "start = 'middle': must be one of vented"),
        ({"sensors": {"x": 1e-4}}, "sensors = .*: must be pneumo.Sensors"),
        ({"sensors": Sensors(1e-4)}, "sensors: noise = 0.0001: must be numbers by signal"),
        ({"sensors": Sensors({"y": 1e-4})}, "noise of 'y': no such signal; there are x, v"),
        ({"sensors": Sensors({"x": -1e-4})}, "noise of x = -0.0001: must be a finite number, at least 0"),
        ({"sensors": Sensors(resolution={"x": np.nan})}, "resolution of x = nan: must be a finite number"),
        ({"sensors": Sensors(sample_time=-1.0)}, "sample_time = -1: must be"),
        ({"sensors": Sensors(seed=1.5)}, "seed = 1.5: must be a whole number"),
        ({"sensors": Sensors(seed=-3)}, "seed = -3: must be a whole number, 0 to"),
    ],
)
def test_wrong_arguments_are_one_line(mine, arguments, words):
    with pytest.raises(InputError, match=words) as error:
        Simulation(mine, **arguments)
    assert "\n" not in str(error.value)


def test_a_supply_that_sags_is_refused(mine):
    with pytest.raises(InputError, match=r"supply\.sag = 0\.1: .* constant supply"):
        Simulation(mine._replace(sag=0.1))


@pytest.mark.parametrize(("model", "n"), [("full", None), ("M6", 1.2)])
def test_python_control_makes_the_steps_of_the_simulation(mine, model, n):
    control = pytest.importorskip("control")
    sim = Simulation(mine, model=model, n=n, start="vented", h=H)
    system, force = sim.to_nlsys(), 20.0
    inputs = np.array([COMMAND[:200], np.full(200, force)])
    response = control.input_output_response(system, H * np.arange(200), inputs, X0=sim.state)
    states = [sim.state, *(sim.step(u, force=force) for u in COMMAND[:199])]
    assert np.array_equal(response.states.T, states)
    assert (system.dt, system.input_labels) == (H, ["u", "force"])
    with pytest.raises(pneumo.RunError, match="check start"):
        system.dynamics(0.0, sim.state, [1.0, np.nan])


def test_a_wrong_step_changes_nothing(mine):
    sim = Simulation(mine)
    before = sim.step(1.0)
    for u in (np.nan, np.inf, "2", None, [1.0, 2.0]):
        with pytest.raises(InputError, match=r"u = .*: must be a finite number"):
            sim.step(u)
    with pytest.raises(InputError, match=r"dt = -0\.001: must be a finite number, greater than 0"):
        sim.step(1.0, -1e-3)
    with pytest.raises(InputError, match="force = nan: must be a finite number"):
        sim.step(1.0, force=np.nan)
    with pytest.raises(pneumo.RunError, match=r"at 0\.001 s: check start, plant and step"):
        sim.step(1.0, force=1e308)
    assert sim.state == before
    assert sim.t == H
