"""Valves whose paths are no straight line of the command, or differ: from YAML to runs, replays and fits."""

import math

import numpy as np
import pytest
from bad_input import error_of
from readable_equations import replay_lane
from valve_paths import BASE, CROSSING, CURVE, FOUR, OVERLAP, STRAIGHT, plant

import pneumo
from pneumo.configuration.priors import plant_with
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.configuration.schema_parts import merged
from pneumo.fitting.fit_problem import Problem, replayed_pressures
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import stage_signals
from pneumo.physics.models import FULL, MODELS, lane, lane_array
from pneumo.physics.valve import chamber_flows
from pneumo.simulation.replay import replay, replay_one_by_one

BOTH = CURVE | {"exhaust_C_dm3_per_sbar": [1] * 7}
STEPS = 10 * np.sign(np.sin(np.arange(1201) / 90 + 0.1)) * np.linspace(0.2, 1, 1201)


def C_of(at, u, P, side):
    """Conductances, dm^3/(s bar), of what flows in and out of a chamber at 293.15 K."""
    flows = chamber_flows(u, P, 293.15, at.valve, at.gas, at.conditions, side)
    b, c = at.gas.critical_ratio, at.conditions
    ports = (c.P_s, P), (P, c.P_atm)
    shape = [math.sqrt(1 - max((low / high - b) / (1 - b), 0) ** 2) * high for high, low in ports]
    return [m / (1.185e-8 * full) for m, full in zip(flows, shape, strict=True)]


@pytest.mark.parametrize("curve", [STRAIGHT, {"u_V": [0, 10], "C_dm3_per_sbar": [0, 1.5]}])
def test_a_straight_table_is_the_valve_without_one(curve):
    tabled, usual = plant(curve=curve), plant()
    assert tabled.valve.k_xu == pytest.approx(usual.valve.k_xu)
    runs = [pneumo.simulate(p, 1e-3, command=STEPS, start="vented") for p in (tabled, usual)]
    np.testing.assert_allclose(runs[0].x, runs[1].x, atol=1e-6)
    np.testing.assert_allclose(runs[0].P_A, runs[1].P_A, rtol=1e-4)
    first, second = (pneumo.replay("M8", 1.3, run) for run in runs)
    np.testing.assert_allclose(first.P_A, second.P_A, rtol=1e-4)


def test_a_curve_is_that_of_the_table_through_both_paths_of_both_chambers():
    at = plant(curve=CURVE, exhaust_ratio=1.2)
    for u, C in ((1.5, 0.2025), (4, 0.84), (9, 1.47), (12, 1.5)):
        for side in (0, 1):
            assert C_of(at, u, 3e5, side) == pytest.approx([C, 0])
            assert C_of(at, -u, 3e5, side) == pytest.approx([0, 1.2 * C])
    assert C_of(at, 0, 3e5, 0) == [0, 0]


def test_a_table_below_zero_changes_direction_where_it_is_zero_for_both_chambers():
    at = plant(curve={"u_V": [-10, 0.5, 10], "C_dm3_per_sbar": [1.2, 0, 1.5]})  # shut at 0.5 V
    assert C_of(at, 10, 3e5, 0) == pytest.approx([1.5, 0])  # supply to A
    assert C_of(at, -10, 3e5, 1) == pytest.approx([0, 1.5])  # and B, whose own command is -u, to exhaust
    assert C_of(at, 0.0, 3e5, 0) == pytest.approx([0, 1.2 * 0.5 / 10.5])
    assert C_of(at, -0.0, 3e5, 1) == pytest.approx([1.2 * 0.5 / 10.5, 0])
    at = plant(curve={"u_V": [-10, 0.2, 0.5, 10], "C_dm3_per_sbar": [1.2, 0.4, 0, 1.5]})
    assert C_of(at, 0.2, 3e5, 0) == pytest.approx([0, 0.4])
    assert C_of(at, -0.2, 3e5, 1) == pytest.approx([0.4, 0])


def test_each_path_has_its_own_conductance_and_critical_ratio():
    at = plant(valve_B=FOUR, exhaust_ratio=0.8, exhaust_b=0.4)

    def flow(C, b, P_u, P_d):
        return 1.185e-8 * C * P_u * math.sqrt(1 - max((P_d / P_u - b) / (1 - b), 0) ** 2)

    for side, C, b, C_out, b_out in ((0, 1.5, 0.3, 1.2, 0.4), (1, 1.1, 0.25, 1.65, 0.5)):
        for P in (1.5e5, 6e5):
            rest = P, 293.15, at.valve, at.gas, at.conditions, side
            assert chamber_flows(10, *rest) == pytest.approx((flow(C, b, 7e5, P), 0))
            assert chamber_flows(-10, *rest) == pytest.approx((0, flow(C_out, b_out, P, 101325)))


def test_runs_and_replays_of_the_core_are_those_of_the_readable_equations():
    rows = lane_array([lane(MODELS[name], 1.3, 1.4) for name in ("M2", "M8")])
    for at in (*(plant(curve=curve) for curve in (CURVE, OVERLAP, CROSSING)), plant(exhaust_b=0.45)):
        run = pneumo.simulate(at, 1e-3, command=STEPS[:301] / 3).recording
        side_by_side, one_by_one = (
            how(run, rows, EXACT_SAMPLING).pressure for how in (replay, replay_one_by_one)
        )
        np.testing.assert_allclose(side_by_side, one_by_one, rtol=1e-6)
        for side in pneumo.physics.cylinder.Side:
            again = replay_lane(run, lane(MODELS["M8"], 1.3, 1.4), side)
            # The core's steps are implicit near the pressure of an open port; the readable ones are not.
            np.testing.assert_allclose(side_by_side[1, side], again, rtol=1e-5)
    rest = pneumo.simulate(plant(curve=OVERLAP), 1e-3, command=np.zeros(3001), start="rest")
    # Between supply and atmosphere, as a half-bridge.
    assert rest.P_A[-1] == pytest.approx(rest.P_B[-1], rel=0.01)
    assert 3e5 < rest.P_A[-1] < 6.9e5


def test_another_exhaust_ratio_acts_on_a_table_as_on_a_valve_without_one():
    plants = plant(), plant(curve=STRAIGHT)
    moved = [plant_with(p, ("exhaust",), np.array([math.log(0.8)])) for p in plants]
    assert C_of(moved[0], -10, 3e5, 0) == pytest.approx([0, 1.2])
    assert C_of(moved[1], -10, 3e5, 0) == pytest.approx([0, 1.2])
    run, fits = pneumo.simulate(moved[0], 1e-3, command=STEPS / 5), []
    measured = Measurement("m", 1e-3, run.u, run.x, np.array([run.P_A, run.P_B]))
    for p in plants:
        problem = Problem(FULL, p, stage_signals(measured, p), {}, ("exhaust",))
        values = problem.values(problem.guess()) | {"exhaust": 0.8, "k_0": p.k_0}
        fits.append(replayed_pressures(problem, problem.inner(values)[None])[0])
    np.testing.assert_allclose(*fits, rtol=1e-3)  # 0.3 per mille where a port is near
    assert np.std(fits[1] - measured.P) < 2e3  # at a reversal, a record's signals are off between samples


def test_each_chamber_has_a_command_where_each_has_a_valve():
    at = plant(valve_B={"C_dm3_per_sbar": 1.5, "b": 0.3})
    u = np.linspace(-10, 10, 301)
    shared = pneumo.simulate(at, 1e-3, command=u)
    alike = pneumo.simulate(at, 1e-3, command=np.stack([u, -u], axis=1))
    np.testing.assert_array_equal(shared.recording.states, alike.recording.states)
    both = pneumo.simulate(at, 1e-3, command=np.full((2001, 2), 10.0), start="vented")
    assert both.P_A[-1] == pytest.approx(7e5, rel=2e-3) and both.P_B[-1] == pytest.approx(7e5, rel=2e-3)
    replayed = pneumo.replay("M1", None, both)  # its own command reaches the replay of B too
    assert replayed.P_B[-1] == pytest.approx(7e5, rel=2e-3)
    assert "u_B" in both.to_xarray() and {"u_A_V", "u_B_V"} < {*both.to_table()}


@pytest.mark.slow
def test_the_command_line_simulates_studies_and_fits_with_a_curve(inside, tmp_path):
    inside("init", "my.yaml")
    section = "cylinders: {mine: {valve: {C_dm3_per_sbar: null, curve: {u_V: %s, C_dm3_per_sbar: %s}}}}"
    (tmp_path / "curve.yaml").write_text(section % tuple(CURVE.values()))
    files = "my.yaml", "curve.yaml"
    assert inside("simulate", *files, "--command", 5)[1].count("stroke of") == 1
    code, out, _ = inside("study", *files, "--seeds", 1, "--experiment", "open", "-o", "look")
    assert code in (0, 2) and "full" in out
    rng = np.random.default_rng(14)
    t = np.arange(3001) * 1e-3
    moves = 0.02 * np.sin(2 * np.pi * 2 * t) + 0.015 * np.sin(2 * np.pi * 4.3 * t)
    record = pneumo.simulate(plant(curve=CURVE), 1e-3, reference=moves, k_p=150.0).to_table()
    record = record.drop(columns=["T_A_K", "T_B_K"])
    record[["P_A_Pa", "P_B_Pa"]] += 500 * rng.standard_normal((len(record), 2))
    record.to_csv(tmp_path / "record.csv", index=False)
    configured = "--config", "my.yaml", "--config", "curve.yaml", "--command", "linear"
    code, _, err = inside("fit", "record.csv", *configured, "--model", "full", "-o", "fit")
    assert code == 0, err
    held_out = float(err.split("full: rms ")[1].split()[0])
    _, _, err = inside("fit", "record.csv", *configured[:2], *configured[4:], "--model", "full", "-o", "line")
    assert held_out < 1.5 < 5 < float(err.split("full: rms ")[1].split()[0])  # kPa
    assert "reduced model" not in (tmp_path / "fit" / "fitted.yaml").read_text(encoding="utf-8")
    fitted = pneumo.load(tmp_path / "fit" / "fitted.yaml").cylinders["mine"].valve.curve
    # The fit's own interval is 0.957 to 1.005 of the truth: bore, zero and the like are not known exactly.
    assert max(fitted.C_dm3_per_sbar) == pytest.approx(1.5, rel=0.03) and len(fitted.u_V) == 7


@pytest.mark.parametrize(
    ("valve", "words"),
    [
        ({"curve": CURVE, "C_dm3_per_sbar": 1.5}, "conflicts with curve"),
        ({"curve": CURVE | {"u_V": [0, 1]}}, "must have 2 numbers"),
        ({"curve": {"u_V": [0, 2, 1], "C_dm3_per_sbar": [0, 1, 2]}}, "must increase"),
        ({"curve": {"u_V": [0, 1], "C_dm3_per_sbar": [0.1, 2]}}, "must begin with 0"),
        ({"curve": {"u_V": [-1, 1], "C_dm3_per_sbar": [0.1, 2]}}, "must be 0 at one command"),
        ({"curve": {"u_V": [0, 1], "C_dm3_per_sbar": [0, -1]}}, "at least 0"),
        ({"curve": {"u_V": [0, 1], "C_dm3_per_sbar": [0, 1e-320]}}, "must be at least 1e-09 somewhere"),
        ({"curve": BOTH, "exhaust_ratio": 2}, "conflicts with curve.exhaust"),
    ],
)
def test_tables_that_are_none_are_refused(valve, words):
    mine = {"cylinders": {"mine": BASE["cylinders"]["mine"] | {"valve": {"b": 0.3} | valve}}}
    assert words in error_of(merged(BASE | {"cylinders": {}}, mine))
