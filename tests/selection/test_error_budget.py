"""Error budget: what is not known, the cylinders drawn from it, their errors, and the answer that follows."""

from dataclasses import replace
from math import log

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_study import STUDY, lasting
from ranked_cells import LEVEL, answered, made
from scipy.stats.qmc import MultivariateNormalQMC

import pneumo
from paper.study.kept_evidence import KEPT
from pneumo.configuration.parameters import Sources, load, study
from pneumo.configuration.priors import SIGMAS, Uncertain, accuracy, plant_with, uncertainties
from pneumo.configuration.valve_conversions import conductance
from pneumo.errors import ConfigurationError
from pneumo.fitting.estimate import prediction
from pneumo.fitting.fit_problem import LIMITS
from pneumo.fitting.least_squares import solve
from pneumo.physics.models import FULL, MODELS
from pneumo.quantities.table import GROUPS
from pneumo.selection.after_record import at_truth, error_after_record, problems_of
from pneumo.selection.answer import ON_MEASURED_AIR, export_command, model_cost
from pneumo.selection.cylinder_ranking import (
    DRAWS,
    PART_DRAWS,
    POINTS,
    REST,
    ROWS,
    drawn_deviations,
    errors_on,
    run_study,
    seeds_of,
    shortened,
    stroke_errors,
)
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.error_budget import FULL_ORDER, NOISE


def known(**changes):
    """How well the template's cylinder is known, with changed keys of its section."""
    content = load(TEMPLATE).model_dump(exclude_unset=True)
    section = content["cylinders"]["mine"]
    section["valve"] |= changes.pop("valve", {})
    for experiment in content["experiments"].values():
        experiment["k_0_W_per_K"] = changes.get("k_0", "catalogue")
    section |= {key: value for key, value in changes.items() if key != "k_0"}
    return uncertainties(Sources(content).validated())["mine"]


def test_limits_are_those_of_the_configuration_else_priors():
    half = {name: known().half_width(name) for name in known().names}
    assert half["C"] == pytest.approx(log(1.1)) and half["b"] == pytest.approx(0.1)
    assert half["V_d_A"] == half["V_d_B"] == pytest.approx(log(2.5))  # left out
    assert half["k_0"] == pytest.approx(log(2.7), rel=0.02)  # the catalogue's
    unknown = known(dead_volume_m3="unknown", valve={"b": "unknown"})
    assert unknown.half_width("b") == pytest.approx(0.15)
    assert unknown.half_width("V_d_A") == pytest.approx(log(2.5))
    given = {"valve": {"C_dm3_per_sbar": "1.5 ± 3 %", "b": "0.3 +- 0.05"}, "dead_volume_m3": "5e-6 ± 2.5e-7"}
    stated = known(k_0="0.3 ± 0 %", **given)
    half = {name: stated.half_width(name) for name in ("C", "b", "V_d_A", "V_d_B")}
    assert half == pytest.approx({"C": log(1.03), "b": 0.05, "V_d_A": log(1.05), "V_d_B": log(1.05)})
    assert "k_0" not in stated.names and "wall heat" not in stated.groups
    assert known(k_0="0.3 ± 100 %").half_width("k_0") == pytest.approx(log(2))
    hoses = known(dead_volume_m3="4e-6 ± 10 %", dead_volume_B_m3="5e-6 ± 40 %")
    assert [hoses.half_width(f"V_d_{side}") for side in "AB"] == pytest.approx([log(1.1), log(1.4)])
    flow = known(valve={"C_dm3_per_sbar": None, "Q_n_l_per_min": "350 ± 5 %"})
    assert flow.half_width("C") > log(1.05) and flow.names.index("b") == 1
    assert set(known().groups) == set(GROUPS)


def test_a_nominal_flow_fixes_the_flow_and_not_C():
    one = known(valve={"C_dm3_per_sbar": None, "Q_n_l_per_min": 350.0, "b": "unknown"})
    C, b = one.names.index("C"), one.names.index("b")
    covariance = np.array(one.covariance)
    slope = covariance[C, b] / covariance[b, b]
    higher, lower = (conductance("Q_n_l_per_min", 350.0, 0.3 + step) for step in (0.01, -0.01))
    assert slope == pytest.approx(log(higher / lower) / 0.02, rel=0.01) and slope < 0
    assert one.half_width("C") > known().half_width("C")


def test_a_fit_replaces_the_limits_of_what_it_estimated():
    fitted = {
        "quantities": ["k_0", "C"],
        "covariance": [[0.01, 0.001], [0.001, 0.0004]],
        "error_kPa": {"M6": 2.2, "full order": 1.0},
    }
    one = known(fitted=fitted)
    k_0, C = one.names.index("k_0"), one.names.index("C")
    covariance = np.array(one.covariance)
    assert covariance[k_0, k_0] == 0.01 and covariance[k_0, C] == covariance[C, k_0] == 0.001
    assert one.half_width("V_d_A") == known().half_width("V_d_A")
    assert one.measured == {"M6": 2200.0, "full order": 1000.0}

    nothing = {"quantities": [], "covariance": []}  # what a fit writes that determined no quantity
    assert known(fitted=nothing) == known()


@pytest.mark.parametrize(
    "rows", [*([[1.0]], [[1.0, 0.5], [0.4, 1.0]], [[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.0]]), [[1e308] * 2] * 2]
)
def test_a_covariance_that_is_none_is_refused(rows):
    with pytest.raises(ConfigurationError, match=r"covariance.*(symmetric|at most 10000)"):
        known(fitted={"quantities": ["k_0", "C"], "covariance": rows})


@settings(max_examples=30)
@given(st.lists(st.floats(-0.4, 0.4), min_size=len(known().names), max_size=len(known().names)))
def test_a_drawn_plant_deviates_in_each_quantity_and_zero_changes_nothing(deviations):
    plant = study(load(TEMPLATE)).experiments["open"].plant
    names = known().names
    moved = plant_with(plant, names, np.array(deviations))
    d = dict(zip(names, deviations, strict=True))
    assert moved.k_0 / plant.k_0 == pytest.approx(np.exp(d["k_0"]))
    assert moved.valve.k_xu / plant.valve.k_xu == pytest.approx(np.exp(d["C"]))
    assert moved.cylinder.V_d_B / plant.cylinder.V_d_B == pytest.approx(np.exp(d["V_d_B"]))
    assert moved.conditions.T_in - plant.conditions.T_in == pytest.approx(d["T_in"])
    assert 0 < moved.gas.critical_ratio < 1 and moved.conditions.P_s > plant.conditions.P_atm
    if d["linearity"]:
        small, half, full = (
            moved.valve.paths.openings(part * plant.valve.u_max, 0) for part in (0.02, 0.5, 1)
        )
        assert half == pytest.approx(((0.5 + max(d["linearity"], -0.25)) * full[0], 0.0)) and small[0] >= 0
    assert plant_with(plant, names, np.zeros(len(names))) == plant


def test_points_are_those_of_scipy():
    points = MultivariateNormalQMC(np.zeros(9), rng=2006).random(DRAWS)
    np.testing.assert_allclose(np.loadtxt(POINTS, delimiter=","), points, rtol=1e-12)


def test_draws_have_the_covariance_and_knowing_a_group_moves_what_depends_on_it():
    one = Uncertain(("C", "b", "k_0"), ((0.04, 0.018, 0.0), (0.018, 0.01, 0.0), (0.0, 0.0, 0.09)))
    draws = drawn_deviations(one, DRAWS)
    np.testing.assert_allclose(np.cov(draws.T), one.covariance, atol=0.006)
    alone = one.alone("valve", draws)
    np.testing.assert_allclose(alone, draws * [1, 1, 0], atol=1e-9)
    related = Uncertain(("C", "V_d_A"), ((0.04, 0.018), (0.018, 0.01)))
    draws = drawn_deviations(related, DRAWS)
    left = draws - related.alone("valve", draws)
    expected = 0.01 - 0.018**2 / 0.04  # conditional variance of a joint normal distribution
    assert np.var(left[:, 1]) == pytest.approx(expected, rel=0.1)
    assert related.half_width("C") == pytest.approx(SIGMAS * 0.2)


def test_the_full_order_has_no_error_on_its_own_plant_and_that_of_a_wrong_valve_else():
    e = lasting("E02", 1.0)
    rows = [(name, 1.3) for name in MODELS]
    right = errors_on(e, e.plant, rows)
    assert right.shape == (len(ROWS), 2) and right[-1].max() < 1e-6 < right[:-1].min()
    wide = plant_with(e.plant, ("C",), np.array([0.1]))
    wrong = errors_on(e, wide, rows)
    assert wrong[-1].min() > 1e4


def test_a_study_of_drawn_cylinders_does_not_depend_on_threads_and_counts_its_time():
    e = lasting("E02", 0.4)
    cut = STUDY._replace(experiments={"E02": e}, n=(1.2, 1.3), seeds=2)
    unknown = {e.cylinder: Uncertain(("C", "k_0"), ((0.0025, 0.0), (0.0, 0.2)))}
    simulated = []
    one = run_study(cut, 1, simulated.append, unknown)
    two = run_study(cut, 2, uncertain=unknown)
    assert one.identical(two)
    runs = 2 + DRAWS + (2 * 2 + 1) * PART_DRAWS
    assert len(simulated) == runs and sum(simulated) == pytest.approx(
        2 * 0.4 + (runs - 2) * shortened(e).duration
    )
    finite = np.isfinite(one["mse_others"]).all(("experiment", "part_draw", "row", "chamber"))
    assert {str(name) for name in one["group"].values[finite]} == {"valve", "wall heat"}
    draw = 5
    deviations = drawn_deviations(unknown[e.cylinder], DRAWS)[draw]
    own = shortened(e).with_seed(seeds_of(e, DRAWS)[draw])
    best = answered(one.assign_coords(cylinder=("experiment", ["mine"]))).ranking
    rows = [(name, float(np.nan_to_num(best.table["best_n"][name], nan=1.2))) for name in MODELS]
    again = errors_on(own, plant_with(own.plant, ("C", "k_0"), deviations), rows)
    np.testing.assert_array_equal(one["mse_drawn"].values[0, draw], again)


def test_parts_are_what_the_error_loses_if_a_group_is_known():
    answer = answered(made(unknown={"valve": 50.0, "supply": 2.0}, noise=1e-9))
    assert answer.budget.groups == ("valve", "supply")
    row = answer.budget.row("M8")
    assert row.rms == pytest.approx((55e6) ** 0.5) and row.own == pytest.approx((3e6) ** 0.5)
    assert row.part("valve") == pytest.approx((50e6) ** 0.5) and row.part("supply") == pytest.approx(
        (2e6) ** 0.5
    )
    assert row.low == pytest.approx(row.rms) == row.high
    assert answer.reason.startswith("Expected error 7.2 kPa")


def test_the_cheapest_within_a_tenth_of_the_lowest_is_chosen():
    alone = answered(made())
    assert alone.chosen == FULL_ORDER and alone.as_good == ()
    answer = answered(made(unknown={"valve": 50.0}))  # M7, 56, and more are within 10 % of 50.5
    expected = [name for name, value in LEVEL.items() if value + 50 <= 1.1 * 50.5] + [FULL_ORDER]
    assert {answer.chosen, *answer.as_good} == {*expected}
    assert answer.chosen == min(expected, key=model_cost)
    costs = [model_cost(name) for name in (*MODELS, FULL_ORDER)]
    assert len({*costs}) == len(costs) and model_cost("M4") < model_cost(FULL_ORDER) < model_cost("M5")


def test_a_measurement_decides_before_the_simulation():
    simulated = answered(made())
    answer = answered(made(measured={"M6": 1000.0, "M8": 2000.0, FULL_ORDER: 3000.0}))
    for row, error in ((answer.budget.row(name), error) for name, error in answer.budget.measured.items()):
        before = simulated.budget.row(row.model)
        assert (row.low, row.high) == (min(before.low, error), max(before.high, error))
    assert answer.chosen == "M6" and answer.reason.startswith("Measured on the part of the record held out")


@pytest.mark.parametrize(("after", "said"), [(400.0, True), (7.2e3, False), (np.nan, False)])
def test_the_error_after_a_record_is_given_if_sensors_would_notice_the_gain(after, said):
    cells = made(unknown={"valve": 50.0}).assign(after_record=("experiment", [after]))
    advice = " ".join(answered(cells).advice)
    words = "After a 10 s record and a fit: 0.4 kPa if the full order were exact"
    assert (words in advice) == (f"it was {ON_MEASURED_AIR} kPa" in advice) == ("After a" in advice) == said


@pytest.mark.parametrize(
    ("cause", "word"), [("valve", "(Cv: 0.4 ± 3 %)"), ("dead volumes", "dead_volume_m3")]
)
def test_the_largest_cause_comes_with_the_key_that_makes_it_smaller(cause, word):
    advice = answered(made(unknown={cause: 50.0, "supply": 1.0})).advice
    assert f"The {cause} matter" in advice[0] and word in advice[0]


@pytest.mark.parametrize(
    ("given", "flow"),
    [
        ("C_dm3_per_sbar: 1.5", "C_dm3_per_sbar: 1.5 ± 3 %"),
        ("Cv: 0.4", "Cv: 0.4 ± 3 %"),
        ("C_dm3_per_sbar: 1.5 ± 2 %", ""),
        ("curve: {u_V: [0, 10], C_dm3_per_sbar: [0, 1.5]}", ""),
    ],
)
def test_a_flow_without_accuracy_is_shown_with_one(given, flow, tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text(TEMPLATE.read_text().replace("C_dm3_per_sbar: 1.5", given, 1))
    assert uncertainties(load(file))["mine"].flow == flow


def test_the_error_on_measured_air_is_that_of_the_evidence():
    held_out = xr.load_dataset(KEPT / "measured_air.nc")["held_out"]
    errors = held_out.sel(case=["pulses", "discharge", "filling"], model=FULL_ORDER) / 1e3
    assert f"{errors.min().item():.1f} to {errors.max().item():.1f}" == ON_MEASURED_AIR


@pytest.fixture(scope="module")
def brief():
    """Runs with a step of 4 ms, so that a record has few samples."""
    e = study(load(TEMPLATE)).experiments["closed"]
    return e._replace(h=4e-3, excitation=e.excitation._replace(every=max(1, e.excitation.every // 4)))


EXACT = dict.fromkeys(accuracy(), 1e-9)
GAINS = ("P_gain_A", "P_gain_B")


def test_after_a_record_gains_offsets_and_noise_are_left_and_what_cannot_be_fitted_has_no_error(brief):
    cases = {}, dict.fromkeys(GAINS, 0.01), {"offset_A": 1e-9, "offset_B": 1e-9}
    least = error_after_record(brief, EXACT)
    usual, poor, centred = (error_after_record(brief, accuracy() | case) for case in cases)
    assert 0 < least < 0.5 * NOISE and least < centred < 0.7 * usual and usual < poor
    P = brief.plant.conditions.P_s
    assert 0.001 * P < poor < 0.01 * P  # within the error of the gain itself
    leaking = brief.plant._replace(valve=brief.plant.valve._replace(leak=1e-9))
    weightless = brief.plant._replace(cylinder=brief.plant.cylinder._replace(M=1e-9))
    for plant in (leaking, weightless):
        e = brief._replace(plant=plant, most_halvings=0)
        assert np.isnan(error_after_record(e, accuracy()))


@pytest.mark.slow
def test_the_error_after_a_record_is_that_of_a_fit_to_pressures_of_a_wrong_gain(brief):
    known = EXACT | dict.fromkeys(GAINS, 0.002)
    fitted, rest = problems_of(brief, known)

    def predicted(gain):
        """Pressures of the new run, Pa, from a fit to a record whose pressures have these gains."""
        signals = fitted.signals._replace(P=fitted.signals.P * np.reshape(gain, (2, 1)))
        found = solve(off := replace(fitted, signals=signals), at_truth(off))
        return prediction(
            FULL, brief.plant, rest.signals, off.values(found.theta) | {"offset_A": 0.0, "offset_B": 0.0}
        )[0]

    right = predicted([1.0, 1.0])  # with the error of sampled signals
    moved = [predicted(gain) - right for gain in ([1.002, 1.0], [1.0, 1.002])]
    expected = [float(np.sqrt(np.mean(np.square(moved)) * 2)) / LIMITS, error_after_record(brief, EXACT)]
    assert error_after_record(brief, known) == pytest.approx(np.hypot(*expected), rel=0.1)


def test_failures_leave_no_answer_or_are_last():
    cells = made()
    cells["run_status"][:] = 1
    assert answered(cells).chosen == "" and "no full-order run" in answered(cells).reason
    cells = made()
    cells["mse_drawn"].loc[{"row": "M8"}] = np.nan
    answer = answered(cells)
    assert answer.rows[-1].model == "M8" and answer.rows[-1].rms == np.inf
    cells["mse_drawn"][:] = np.nan
    assert answered(cells).reason == "every model failed in a run"


def test_short_runs_narrow_grids_and_rest_are_named():
    cells = made(best=1.2, unknown={"valve": 50.0}, full=500.0)
    cells["time_constant"][:] = 3.0
    advice = " ".join(answered(cells).advice)
    assert "Longer runs: X" in advice and "A wider grid" in advice
    level = LEVEL | {"M9": 0.1, "M10": 0.2}
    assert "M9 drifts to P_0 in a closed chamber" in " ".join(answered(made(level)).advice)


def test_full_strokes_are_those_of_simulate_and_change_the_answer_if_a_model_drifts_there():
    e = study(load(TEMPLATE)).experiments["open"]
    opened = round((1 + 3 * e.plant.cylinder.stroke / e.plant.speed) / e.h)
    command = np.where(np.arange(1 + opened + round(REST / e.h)) < opened, 10.0, 0.0)
    run = pneumo.simulate(e.plant, e.h, command=command, start="vented")
    assert len(run.strokes) == 1
    found = stroke_errors(e, e.plant, [("M6", 1.3), ("M7", 1.3)])
    expected = [pneumo.replay(name, n, run).mse for name, n in (("M6", 1.3), ("M7", 1.3), ("full", None))]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    cells = made(LEVEL | {"M9": 0.1, "M10": 0.2})
    assert "strokes" not in " ".join(answered(cells).advice)
    strokes = cells["mse_alone"].isel(group=-1, drop=True) * 0 + 25e6
    strokes.loc[{"row": "M9"}] = 4e10
    answer = answered(cells.assign(mse_stroke=strokes))
    assert answer.chosen == "M9" and "200 kPa over strokes into rest" in answer.reason
    words = "Over full strokes into rest M9 has 200 kPa: for both take the full order, 0.71 kPa and 5 kPa."
    assert words in answer.advice


def test_the_next_command_exports_the_model():
    mine = STUDY._replace(experiments={"X": STUDY.experiments["E06"]._replace(cylinder="mine")})
    command = export_command(answered(made()), mine, ["my file.yaml"])
    assert command == "pneumo export full --to c --config 'my file.yaml' -o full.c"
    command = export_command(answered(made(full=1e3)), mine)
    assert command == "pneumo export M9 --n 1.3 --to c --config CONFIGURATION.yaml --cylinder mine -o m9.c"
