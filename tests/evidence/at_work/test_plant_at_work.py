"""Models at work: observers that converge, controllers that track, sensors, and what the errors tell."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_study import STUDY

from pneumo import linearise
from pneumo.evidence.at_work import at_work_statistics as statistics
from pneumo.evidence.at_work import observers, plant_at_work, position_control, sampled_plant
from pneumo.evidence.at_work.at_work_statistics import correlations
from pneumo.evidence.at_work.observers import filter_noise, reduced
from pneumo.evidence.at_work.plant_at_work import CARRIED, Carried, control_run
from pneumo.evidence.at_work.position_control import P_CONTROL, PARTS, Controller, Task, minimum_jerk
from pneumo.evidence.at_work.sampled_plant import PRESSURE_NOISE, PRESSURE_STEP, X_STEP, readings
from pneumo.physics.cylinder import acceleration, chamber_of, volume
from pneumo.physics.models import MODELS, Lane, lane
from pneumo.simulation import kalman_filter
from pneumo.simulation.compiled import kernel
from pneumo.simulation.full_order import equilibrium
from pneumo.simulation.kalman_filter import SIZE, FilterModel, first_estimate

pytestmark = pytest.mark.xdist_group("at work")  # the same kernels, compiled once
CLOSED = STUDY.experiments["E10"]
PLANT, H, N = CLOSED.plant, CLOSED.h, 1.35
P_0 = PLANT.conditions.P_0
QUIET = filter_noise(0.1, 1e3)
LANE = lane(MODELS["M8"], N, PLANT.gas.gamma)
MODEL = reduced(LANE)
predicted, corrected = kernel(kalman_filter.predict), kernel(kalman_filter.correct_all)
commanded, jerk_of = kernel(position_control.linearising_command), kernel(position_control.third_derivative)
drawn_air = kernel(sampled_plant.air_from_supply)
pressures = st.floats(1.2e5, 6.5e5)
positions, speeds, commands = st.floats(-0.04, 0.04), st.floats(-0.5, 0.5), st.floats(-10.0, 10.0)


def start(x: float, v: float, P_A: float, P_B: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First state, its covariance, and work space of a filter."""
    y, C = first_estimate(x, np.array([P_A, P_B]), PLANT, QUIET)
    y[1] = v
    return y, C, np.empty((4, SIZE, SIZE))


def model_run(u: np.ndarray, y_0: np.ndarray) -> np.ndarray:
    """States of the model itself at every sample: what a filter with the true model should find."""
    (y, C, W), states = start(*y_0), [y_0.copy()]
    for command in u[:-1]:
        predicted(y, C, command, PLANT, MODEL, QUIET, H, W)
        states.append(y[:4].copy())
    return np.array(states)


@pytest.mark.parametrize("measured", [0, 1, 2])
def test_a_filter_with_the_true_model_and_no_noise_converges(measured):
    t = np.arange(3001) * H
    u = 3.0 * np.sin(2 * np.pi * 2.0 * t)
    states = model_run(u, np.array([0.0, 0.0, P_0, P_0]))
    first = np.array([P_0 + 3e4, P_0 - 3e4])
    known = np.where(np.arange(2) < measured, states[:, 2:], np.nan)
    estimates, variances = kalman_filter.estimated(states[:, 0], known, u, first, MODEL, PLANT, QUIET, H)
    errors = abs(estimates[:, :4] - states)[:, 2:].max(axis=1)
    assert errors[0] > 1e3 or measured == 2  # a pressure that is measured is known at once, within its noise
    # Within 1 % of the first error, whichever pressures are measured, and within what the filter expects.
    assert errors[-1000:].max() < 300.0
    assert errors[-1] < 3 * np.sqrt(variances[-1, 2:4].max())


@settings(max_examples=30)
@given(positions, speeds, pressures, pressures, commands, st.integers(0, 2), st.floats(1e2, 1e6))
def test_the_covariance_stays_symmetric_and_positive(x, v, P_A, P_B, u, measured, noise):
    y, C, W = start(x, v, P_A, P_B)
    for _ in range(20):
        predicted(y, C, u, PLANT, MODEL, filter_noise(0.1, noise), H, W)
        known = np.where(np.arange(2) < measured, y[2:4] - 1e3, np.nan)
        corrected(y, C, y[0] + X_STEP, known, PLANT, MODEL, QUIET)
        np.testing.assert_array_equal(C, C.T)
        # Scaled to a unit diagonal; the rounding of 20 steps is far below 1e-6 of it.
        scale = np.sqrt(np.diag(C)[:4])
        assert (scale > 0).all()
        assert np.linalg.eigvalsh(C[:4, :4] / np.outer(scale, scale)).min() > -1e-6
    assert np.isfinite(y).all()


@settings(max_examples=30)
@given(positions, speeds, st.floats(3.8e5, 6.5e5), st.floats(3.8e5, 6.5e5), st.floats(0.5, 10.0))
def test_the_covariance_moves_by_the_linear_model(x, v, P_A, P_B, u):
    A = np.asarray(linearise("M8", N, PLANT, u=u, P_A=P_A, P_B=P_B, x=x, v=v, states="actuator").A)
    F = np.eye(4) + H * A + H**2 / 2 * A @ A
    y, C, W = start(x, v, P_A, P_B)
    expected = F @ C[:4, :4] @ F.T
    expected[1, 1] += H * (QUIET.force / PLANT.cylinder.M) ** 2
    expected[[2, 3], [2, 3]] += H * QUIET.pressure**2
    predicted(y, C, u, PLANT, MODEL, QUIET, H, W)
    C, scale = C[:4, :4], np.sqrt(np.diag(expected))
    # Differences over 1e-3 of P_0 and 1e-4 of the stroke leave less than a hundredth of a step's change.
    np.testing.assert_allclose(C / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-2)


def test_more_sensors_see_more_and_all_sets_are_observable():
    by_sensors = [observers.observability("M8", N, PLANT, measured) for measured in range(3)]
    assert [each.rank for each in by_sensors] == [4, 4, 4]
    position, with_P_A, with_both = (sensors.deviation for sensors in by_sensors)
    assert (position > with_P_A).all() and (with_P_A > with_both).all()
    assert (by_sensors[2].deviation < PRESSURE_NOISE).all()  # of many samples


@settings(max_examples=30)
@given(positions, speeds, pressures, pressures, st.floats(-0.3, 0.3))
def test_the_command_gives_the_third_derivative_that_was_asked_for(x, v, P_A, P_B, share):
    y, _, _ = start(x, v, P_A, P_B)
    a = acceleration(v, P_A, P_B, 0.0, PLANT.cylinder)
    towards = np.copysign(PLANT.valve.u_max, share)
    closed, full = (jerk_of(y, a, u, PLANT, MODEL) for u in (0.0, towards))
    asked = closed + abs(share) * (full - closed)
    w = 50.0
    # The reference whose third derivative makes the law ask for just that.
    wanted = np.array([x, v, a, asked])
    command = commanded(y, wanted, 0.0, w, PLANT, MODEL)
    if abs(full - closed) > 1e-6 * abs(closed):
        assert jerk_of(y, a, command, PLANT, MODEL) == pytest.approx(asked, rel=1e-6, abs=1e-6)


@settings(max_examples=30)
@given(
    st.floats(-1e-4, 1e-4),
    st.floats(-1e-3, 1e-3),
    st.floats(-0.02, 0.02),
    st.floats(-1e-6, 1e-6),
    st.floats(10.0, 80.0),
)
def test_an_error_is_answered_by_four_equal_poles(e, de, dde, integral, w):
    y = np.array([0.01, 0.1, 3.9e5, 4.1e5])
    a = acceleration(*y[1:], 0.0, PLANT.cylinder)
    _, c_2, c_1, c_0, c_i = np.poly([-w] * 4)  # s^4 + 4 w s^3 + 6 w^2 s^2 + 4 w^3 s + w^4, of the integral
    jerk = c_2 * dde + c_1 * de + c_0 * e + c_i * integral
    command = commanded(y, np.array([y[0] + e, y[1] + de, a + dde, 0.0]), integral, w, PLANT, MODEL)
    asked = commanded(y, np.array([y[0], y[1], a, jerk]), 0.0, w, PLANT, MODEL)
    assert command == pytest.approx(asked, rel=1e-9, abs=1e-9)


def test_a_controller_with_the_perfect_model_and_state_tracks():
    t = np.arange(1501) * H
    reference = minimum_jerk(t - 0.1, 0.02, 0.5)
    (y, C, W), errors = start(0.0, 0.0, P_0, P_0), []
    integral = 0.0
    for wanted in reference:
        integral += H * (wanted[0] - y[0])
        u = np.clip(commanded(y, wanted, integral, 60.0, PLANT, MODEL), -10.0, 10.0)
        predicted(y, C, u, PLANT, MODEL, QUIET, H, W)
        errors.append(wanted[0] - y[0])
    # The command is held for 1 ms, which at 0.075 m/s is 0.075 mm of the way.
    assert np.abs(errors).max() < 0.1e-3
    assert np.abs(errors[-200:]).max() < 1e-5


def held_for_2_s(x: float, force: float, controller: Controller, model: FilterModel):
    """Run of a controller that holds the piston at x against a force, without noise."""
    samples = round(2.0 / H) + 1
    task = Task(np.tile([x, 0.0, 0.0, 0.0], (samples, 1)), np.full(samples, force))
    noise, first = np.zeros((samples, 2)), np.full(2, P_0)
    return position_control.controlled(task, noise, first, controller, model, PLANT, PLANT, PLANT, H, 6)


def test_p_control_without_a_model_is_stable_and_a_model_is_not_read():
    gain = PLANT.valve.u_max / PLANT.cylinder.stroke
    done = held_for_2_s(
        0.02, 0.0, Controller(0, P_CONTROL, gain, QUIET), reduced(Lane(*[np.nan] * len(LANE)))
    )
    assert np.abs(done.x[-200:] - 0.02).max() < 2e-4  # 1 % of the step
    assert 0 < done.air < 0.01


def test_the_controller_leaves_no_offset_under_a_force():
    done = held_for_2_s(0.0, 20.0, Controller(2, 50.0, 0.0, filter_noise(1.0, 1e4)), MODEL)
    assert np.abs(done.x[:500]).max() > 1e-4  # it was pushed away
    assert np.abs(done.x[-200:]).max() < 3 * X_STEP


@settings(max_examples=30)
@given(st.floats(-0.1, 0.1), st.floats(0.2, 1.0))
def test_a_minimum_jerk_motion_has_the_derivatives_it_says(travel, duration):
    t = np.linspace(-0.1, duration + 0.1, 4001)
    motion = minimum_jerk(t, travel, duration)
    assert motion[0, 0] == 0 and motion[-1, 0] == pytest.approx(travel)
    for k in range(2):  # the third jumps at both ends
        scale = abs(travel) / duration ** (k + 1)
        np.testing.assert_allclose(np.gradient(motion[:, k], t), motion[:, k + 1], atol=0.05 * scale + 1e-12)
    inside = (t > 0.01) & (t < duration - 0.01)
    third = np.gradient(motion[:, 2], t)[inside]
    np.testing.assert_allclose(third, motion[inside, 3], atol=0.5 * abs(travel) / duration**3 + 1e-12)


def test_tasks_differ_by_seed_and_stay_between_the_stops():
    tasks = [position_control.drawn_task(np.random.default_rng(seed), PLANT, H) for seed in range(20)]
    stroke = PLANT.cylinder.stroke
    for task in tasks:
        assert np.abs(task.reference[:, 0]).max() <= 0.3 * stroke
        assert np.abs(task.force).max() == pytest.approx(0.1 * 7e5 * PLANT.cylinder.A_A)
        assert np.count_nonzero(task.force) == pytest.approx(1000, abs=1)
        ends = [round(end / H) - 1 for _, end in PARTS.values()]
        np.testing.assert_allclose(task.reference[ends, 0], 0.0, atol=2e-3 * stroke)
    assert len({task.reference[0, 0] for task in tasks}) == len(tasks)


def test_sensors_are_noisy_and_quantised():
    recording = sampled_plant.sampled_recording(CLOSED, 1, 4000)
    x, P = readings(recording.states, np.random.default_rng(0))
    true = recording.states
    np.testing.assert_allclose(x / X_STEP, np.round(x / X_STEP), atol=1e-6)
    assert np.abs(x - true[:, 0]).max() <= X_STEP / 2 * 1.001
    np.testing.assert_allclose(P / PRESSURE_STEP, np.round(P / PRESSURE_STEP), atol=1e-6)
    assert np.std(P - true[:, [2, 4]]) == pytest.approx(PRESSURE_NOISE, rel=0.05)  # 8000 samples: 0.8 %


def test_air_from_the_supply_is_what_the_chamber_gains():
    y, u, R = equilibrium(PLANT), 2.0, PLANT.gas.R

    def mass(y: np.ndarray) -> float:
        return y[2] * volume(y[0], chamber_of(PLANT.cylinder, 0), PLANT.cylinder) / (R * y[3])

    steps, air, start = 50, 0.0, mass(y)
    for _ in range(steps):
        air += H * drawn_air(u, y, PLANT)
        y, _ = sampled_plant.held_step(y, u, 0.0, PLANT, H, 6)
    assert air == pytest.approx(mass(y) - start, rel=0.05)  # flow is read at each sample's start
    assert drawn_air(0.0, y, PLANT) == 0


def test_a_carried_k_0_is_a_share_of_the_plants():
    half_wall = Carried("M8", 0.5).lane(N, 1.4)
    assert half_wall == LANE._replace(wall_scale=0.5) and Carried("M8", 0.5).name == "M8, 0.5 k_0"
    assert len(CARRIED) == 4 + 3 * len(plant_at_work.K_0_FACTORS)


def test_runs_of_a_controller_repeat_themselves():
    controller, seed = Controller(2, 50.0, 0.0, filter_noise(0.5, 1e4)), np.random.SeedSequence([1])
    first, again = (control_run(CLOSED, seed, controller, reduced(LANE)) for _ in range(2))
    assert first.tracking == again.tracking and first.air == again.air
    lengths = [end - start for start, end in PARTS.values()]
    # The whole has one sample more than its parts.
    assert first.tracking == pytest.approx(np.average(first.by_part, weights=lengths), rel=1e-3)


def test_rank_correlation_knows_order_and_its_interval_noise():
    rng, order = np.random.default_rng(0), np.arange(1.0, 8.0)
    assert statistics.spearman(order, order**3) == 1 and statistics.spearman(order, -order) == -1
    # By hand: ranks 1 2 3 against 2 1 3 differ by squares of 2; 1 - 6 * 2 / (3 * 8).
    assert statistics.spearman(np.array([1.0, 2.0, 3.0]), np.array([5.0, 4.0, 6.0])) == pytest.approx(0.5)
    seeds = np.exp(0.01 * rng.standard_normal((7, 30)))
    far = correlations(order[:, None] * seeds, (order**2)[:, None] * seeds, True, rng)
    assert len(far) == statistics.RESAMPLINGS + 1 and (far == 1).all()
    noise = correlations(order[:, None] * seeds, rng.lognormal(size=(7, 30)), False, rng)
    near = statistics.with_bounds(noise)
    assert near[1] <= near[0] <= near[2] and near[2] - near[1] > 0.3
    assert [statistics.predicts(low) for low in (0.7, 0.2, 0.0)] == ["predicts use", "in part", "does not"]


def test_losses_are_ratios_to_the_best_with_intervals():
    rng = np.random.default_rng(1)
    common = rng.lognormal(size=30)  # runs differ by much, models in a run by a stated ratio
    used = np.array([1.3, 1.0, 1.05])[:, None] * common * np.exp(0.01 * rng.standard_normal((3, 30)))
    losses = statistics.losses(used)
    np.testing.assert_array_equal(losses[1], 1.0)
    assert losses[0, 1] < 1.3 < losses[0, 2] and losses[2, 2] < 1.1 < losses[0, 1]


def test_the_best_model_has_the_lowest_mean_and_not_the_lowest_single_error():
    used = np.exp([[0.0, 0.1, -0.1, 0.0], [-3.0, 4.0, 4.0, 4.0]])
    lost = statistics.losses(used)
    np.testing.assert_array_equal(lost[0], 1.0)
    assert lost[1, 0] == pytest.approx(np.exp(9 / 4))


def invented_cells(order: dict[str, float]) -> xr.Dataset:
    """Cells of two plants in which each model has a stated error, of replay and of use alike."""
    rng = np.random.default_rng(2)
    error = np.array([order[c.model] * (1.0 if c.k_0_factor == 1 else 2.0) for c in CARRIED])
    noisy = error[:, None] * np.exp(0.01 * rng.standard_normal((2, 1, len(CARRIED), 30)))
    values = {"replay_error": (("plant", "loop", "carried", "seed"), np.repeat(noisy, 2, axis=1))}
    several = np.broadcast_to(noisy[:, :, None], (2, 2, 3, len(CARRIED), 30))
    values["estimation_error"] = (("plant", "loop", "sensors", "carried", "seed"), several)
    for name in ("tracking_error", "following_error"):
        flat = np.full((2, 2, len(CARRIED), 30), 1.0) * np.exp(1e-3 * rng.standard_normal((13, 30)))
        values[name] = (("plant", "control_sensors", "carried", "seed"), flat)
    coords = {
        "plant": ["one", "two"],
        "loop": ["open", "closed"],
        "sensors": ["none", "one", "both"],
        "control_sensors": ["none", "both"],
        "carried": [c.name for c in CARRIED],
        "model": ("carried", [c.model for c in CARRIED]),
        "k_0_factor": ("carried", [c.k_0_factor for c in CARRIED]),
    }
    return xr.Dataset(values, coords)


def test_answers_of_invented_cells_are_those_put_in():
    order = {"M1": 9.0, "M2": 7.0, "M5": 3.0, "M6": 2.0, "M7": 1.6, "M8": 1.04, "M10": 1.0}
    statistics_of_uses = statistics.at_work_statistics(invented_cells(order))
    assert list(statistics_of_uses["use"].values) == list(statistics.USES)
    observer, controller = "observer, open loop, none", "controller, tracking, both"
    right = statistics_of_uses.sel(factor=1.0)
    assert (right["correlation"].sel(use=observer, bound="low") == 1).all()
    assert right["mean_correlation"].sel(use=observer, bound="estimate") == 1
    assert right["mean_correlation"].sel(use=controller, bound="low") < 0.5
    assert set(right["cheapest"].sel(use=observer).values) == {"M8"}
    assert set(right["cheapest"].sel(use=controller).values) == {"M1"}
    hardly_matters = right["hardly_matters"]
    assert hardly_matters.sel(use=controller).all() and not hardly_matters.sel(use=observer).any()
    # At a wrong k_0 the models with wall heat are twice as far off: M10 is as good as M6.
    wrong = statistics_of_uses.sel(factor=2.0, use=observer)
    assert set(wrong["cheapest"].values) == {"M6"}
    np.testing.assert_allclose(wrong["loss"].sel(compared="M7", bound="estimate"), 1.6, rtol=0.02)
    assert statistics.carried_at(invented_cells(order), 0.5).sizes["model"] == 7


@pytest.mark.slow
def test_a_plant_at_work_has_every_cell(monkeypatch):
    for name, value in {"SEEDS": 2, "TUNING_SEEDS": 1, "RUN": 2.0, "BANDWIDTHS": (33.0, 75.0)}.items():
        monkeypatch.setattr(plant_at_work, name, value)
    said: list[str] = []
    errors = plant_at_work.plant_at_work(STUDY.experiments["E09"], CLOSED, (1.2, 1.4), 0, said.append)
    assert len(said) == 3
    assert all(np.isfinite(errors[name]).all() for name in errors.data_vars)
    assert errors.sizes["carried"] == len(CARRIED) and errors.sizes["seed"] == 2
    assert all("units" in errors[name].attrs for name in errors.data_vars)
    error = errors["estimation_error"].sel(loop="closed").mean("seed")
    assert (error.sel(sensors="both") < error.sel(sensors="none")).all()
    assert (errors["bandwidth"].isin([33.0, 75.0])).all()
