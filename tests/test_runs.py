"""Use in code: plants, full-order runs and replays by the names that the package gives at the top."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pneumo
from pneumo import Cylinder, Model, recorded, replay, simulate
from pneumo import testing as some
from pneumo.configuration.experiment import MOST_HALVINGS
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.errors import InputError, RunError
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.physics.valve_dynamics import ValveDynamics
from pneumo.runs import State
from pneumo.simulation import full_order as datum
from pneumo.simulation.replay import replay as replay_lanes

# Whole numbers are welcome.
CYLINDER = Cylinder(0.02, 0.1, 3.14e-4, 3.0e-4, 1.6e-6, 1.7e-6, 2, 100, -0.05, 0.05)
H = 1e-3
COMMAND = 0.8 * np.sign(np.sin(np.arange(301) / 30 + 0.1))


@pytest.fixture(scope="module")
def mine():
    return pneumo.plant(CYLINDER, k_xu=1e-7, u_max=10, P_s=7e5, k_0=0.5)


@pytest.fixture(scope="module")
def run(mine):
    return simulate(mine, H, command=COMMAND)


def test_simulate_is_the_full_order_system_and_position_follows_its_reference(mine, run):
    drive = run.recording.drive
    expected = datum.run(datum.equilibrium(mine), COMMAND, 0.0, drive, mine, H, MOST_HALVINGS).states
    assert np.array_equal(run.recording.states, expected)
    assert np.array_equal(run.u, COMMAND)
    assert run.t[-1] == pytest.approx(0.3)
    columns = (run.x, run.v, run.P_A, run.T_A, run.P_B, run.T_B)
    assert all(np.array_equal(column, expected[:, i]) for i, column in enumerate(columns))
    assert np.ptp(run.x) > 1e-3
    run = simulate(mine, H, reference=np.full(1501, 0.01), k_p=50.0)
    assert run.x[-1] == pytest.approx(0.01, abs=1e-3)  # m: P control, without an integral, rests near it
    assert run.u == pytest.approx(50.0 * (0.01 - run.x))


def test_replay_is_the_grids_and_measured_signals_are_interpolated(mine, run):
    row = lane_array([lane(MODELS["M8"], 1.35, 1.4)])
    expected = replay_lanes(run.recording, row, EXACT_SAMPLING)
    replayed = replay("M8", 1.35, run)
    assert np.array_equal(replayed.P_A, expected.pressure[0, 0])
    assert np.array_equal(replayed.P_B, expected.pressure[0, 1])
    assert np.array_equal(replayed.mse, expected.mse[0])
    assert replayed.status == ("ok", "ok")
    assert repr(replayed).startswith("replay of M8 at n = 1.35 over 0.3 s: RMS error A ")
    np.testing.assert_array_equal(replayed.to_xarray()["P"].sel(chamber="B"), replayed.P_B)
    assert replay("full", None, run).mse.max() < 1e-6 < replayed.mse.min()
    assert replayed.mse[0] == pytest.approx(np.mean((run.P_A - replayed.P_A) ** 2), rel=1e-9)
    measured = recorded(mine, H, u=run.u, x=run.x, v=run.v, P_A=run.P_A, P_B=list(run.P_B))
    replayed, exact = replay("M8", 1.35, measured), replay("M8", 1.35, run)
    assert pytest.approx(exact.P_A, rel=0.1) == replayed.P_A  # 1 ms of interpolation moves some per cent
    assert not np.array_equal(replayed.P_A, exact.P_A)
    silent = replay("M8", 1.35, recorded(mine, H, u=run.u, x=run.x, v=run.v))
    np.testing.assert_allclose(silent.P_A, replayed.P_A, rtol=1e-12)  # by the other kernel
    assert np.isnan(silent.mse).all()
    with pytest.raises(InputError, match="x: 300 steps: must be 301, as of u"):
        recorded(mine, H, u=run.u, x=run.x[1:], v=run.v)
    with pytest.raises(InputError, match=r"x = 1e\+06 m at step 300: must be -0\.05\d* to 0\.05\d* m"):
        recorded(mine, H, u=run.u, x=np.where(run.t < 0.2995, run.x, 1e6), v=run.v)


@settings(max_examples=10)
@given(data=st.data())
def test_signals_of_the_strategies_run(mine, data):
    command = data.draw(some.commands(100, every=10, high=3.0))
    reference = CYLINDER.stroke / 20 * data.draw(some.commands(100, every=10, high=9.0))
    assert len(command) == len(reference) == 101
    for run in (simulate(mine, H, command=command), simulate(mine, H, reference=reference, k_p=20.0)):
        assert np.all((CYLINDER.x_min <= run.x) & (run.x <= CYLINDER.x_max))
        assert replay("M10", 1.2, run).status == ("ok", "ok")


def test_a_row_can_stand_for_a_models_name_and_models_without_n_need_none(run):
    M11 = Model("M11", "gamma", "gamma", "gamma", "polytropic", True, "k_0")  # M8 under another name
    assert np.array_equal(replay(M11, 1.35, run).P_A, replay("M8", 1.35, run).P_A)
    assert np.array_equal(replay("M1", None, run).P_A, replay("M2", 1.0, run).P_A)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        *(({}, "exactly one"), ({"command": COMMAND, "reference": COMMAND}, "exactly one")),
        *(({"command": wrong}, "command: shape") for wrong in (2.0, [1.0], np.zeros((3, 3)))),
        *(({"command": wrong}, "must be an array") for wrong in (["a", "b"], [[1], [2, 3]], [1j, 0], {})),
        ({"command": [1.0, np.nan]}, "command = nan at step 1: must be finite"),
        ({"command": COMMAND, "start": (0, 0, 1e5)}, "six numbers"),
        ({"command": [[1.0, 2.0]]}, "u_A"),
        *(({"reference": COMMAND}, "k_p"), ({"reference": COMMAND, "k_p": "a"}, "k_p = 'a'")),
        *(({"h": h, "command": COMMAND}, f"h = {h!r}: must be a finite") for h in (0, np.inf, "a", None)),
    ],
)
def test_bad_signals_are_refused(options, words, mine):
    with pytest.raises(InputError, match=words) as error:
        simulate(mine, **({"h": H} | options))
    assert "\n" not in str(error.value)


def test_a_run_that_fails_is_no_table_of_nan(mine):
    with pytest.raises(RunError, match=r"left the finite numbers at 0\.001 s"):
        simulate(mine, H, command=COMMAND, start=State(0, 0, 1e308, 300, 1e5, 300))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"P_s": 1e5}, "must exceed"),
        ({"k_0": -1.0}, "k_0"),
        ({"u_max": 0.0}, "u_max"),
        ({"T_in": -3.0}, "T_in"),
        ({"P_0": float("inf")}, "P_0"),
        ({"cylinder": CYLINDER._replace(V_d_B=0.0)}, "V_d_B"),
        ({"cylinder": CYLINDER._replace(x_min=0.01, x_max=-0.01)}, "x_min"),
        ({"cylinder": CYLINDER._replace(x_min=-1.0)}, "x_min"),
        ({"cylinder": CYLINDER._replace(k_f=-1.0)}, "k_f"),
    ],
)
def test_bad_plants_are_refused(changes, words):
    options = {"cylinder": CYLINDER, "k_xu": 1e-7, "u_max": 10.0, "P_s": 7e5, "k_0": 0.5} | changes
    with pytest.raises(InputError, match=words):
        pneumo.plant(options.pop("cylinder"), **options)


def test_a_configuration_is_a_plant_and_measured_signals_have_a_full_order(inside, tmp_path):
    inside("init", "my.yaml")
    file = tmp_path / "my.yaml"
    plant = pneumo.load_plant(file)
    run = simulate(str(file), H, command=COMMAND)
    assert np.array_equal(run.x, simulate(plant, H, command=COMMAND).x)
    measured = recorded(file, H, u=run.u, x=run.x, v=run.v, P_A=run.P_A, P_B=run.P_B)
    full = replay("full", None, measured)
    assert full.status == ("ok", "ok") and full.mse.max() ** 0.5 < 0.05 * np.ptp(run.P_A)
    for wrong in (run.to_table(), None, "run.csv"):
        with pytest.raises(InputError, match=r"^run = .*must be a Run[^\n]*$"):
            replay("M8", 1.3, wrong)
    for model, n in (("full", "a"), ("M8", "a"), (["M8"], 1.3), ("M8", np.nan)):
        with pytest.raises(InputError, match=r"^(n = |model \[)[^\n]*$"):
            replay(model, n, run)
    for file in ("missing.yaml", 3):
        with pytest.raises(pneumo.PneumoError, match=r"(missing\.yaml|plant = 3)[^\n]*$"):
            simulate(file, H, command=COMMAND)


def test_a_file_with_valve_dynamics_moves_as_they_say_and_keeps_its_command(inside, tmp_path):
    inside("init", "my.yaml")
    file = tmp_path / "my.yaml"
    section = "valve_dynamics: {dead_band_V: 0.4, lag_s: 0.02}"
    text = file.read_text(encoding="utf-8").replace("    u_max_V", f"    {section}\n    u_max_V")
    file.write_text(text, encoding="utf-8")
    assert np.ptp(simulate(file, H, command=np.full(501, 0.35), start="vented").x) == 0
    command = np.where(np.arange(501) < 300, 1.0, -2.0)
    run = simulate(file, H, command=command, start="vented")
    assert np.array_equal(run.u, command) and np.array_equal(run.to_table()["u_V"], command)
    assert {stroke.switched for stroke in run.strokes} <= {0.0, 0.3}
    assert replay("full", None, run).mse.max() < 10.0**2  # Pa: its opening is that of the run
    at_once = simulate(pneumo.load_plant(file), H, command=command, start="vented")
    assert 0 < np.ptp(run.x) < 0.9 * np.ptp(at_once.x)
    code, out, told = inside("simulate", "my.yaml", "--command", 0.35)
    assert code == 0 and "x: -80 to -80 mm" in out and not told
    code, out, told = inside("simulate", "my.yaml", "--reference", 10)
    assert code == 2 and not out and told.startswith("pneumo: valve_dynamics: ") and told.count("\n") == 1
    assert "in the runs of `study` the valve follows at once" in inside("check", "my.yaml")[1]


def test_a_dead_time_delays_the_command(mine):
    late = simulate(mine, H, command=COMMAND, dynamics=ValveDynamics(dead_time=5 * H))
    delayed = simulate(mine, H, command=np.concatenate([np.zeros(5), COMMAND[:-5]]))
    np.testing.assert_allclose(late.recording.states, delayed.recording.states, rtol=1e-6, atol=1e-9)
    assert np.array_equal(late.u, COMMAND)
