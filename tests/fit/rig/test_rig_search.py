"""A rig's least squares: residuals, bounds, intervals of two parameters, and which points are held out."""

from types import SimpleNamespace

import numpy as np
import pytest

from pneumo.fit.rig import rig_fit
from pneumo.fit.rig.rig_file import rig
from pneumo.fit.rig.rig_fit import (
    POSSIBLE_HOSE,
    Judged,
    RigEstimate,
    RigProblem,
    correlation_time,
    fit_rig,
    fitted_names,
    fitted_runs,
    judged,
    judged_models,
    rig_warnings,
)
from pneumo.fit.rig.rig_record import Points, vessel_run

TANK = {"volume_L": [5, 15], "orifice_mm": 2, "C_d": [0.5, 1], "P_start_bar": 8, "n": 1.2}
KNOWN = {"volume_L": 10, "orifice_mm": 2, "C_d": 0.8, "P_start_bar": 8}
VALVE = {"valve_C_in_dm3_per_sbar": 1, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 6}


def run_of(count, T=False):
    t = np.linspace(0.2, 60, count)
    return vessel_run(Points(t, np.zeros(count)), Points(t, np.zeros(count)) if T else None)


def test_residuals_are_in_kPa_and_K_and_large_where_there_is_no_replay(monkeypatch):
    errors = np.array([2e3, -5e2, np.nan]), np.array([3.0, np.inf])
    monkeypatch.setattr(rig_fit, "run_errors", lambda *_: errors)
    problem = RigProblem(rig(TANK, "test"), "full order", [run_of(3)] * 2, ("C_d",))
    alone, both = (problem._replace(temperature=T).residual(np.zeros(1)) for T in (False, True))
    assert alone.tolist() == [2.0, -0.5, 1000.0] * 2  # as of 1 MPa
    assert both.tolist() == [2.0, -0.5, 1000.0, 3.0, 1000.0] * 2


def test_a_search_is_between_the_users_ends(monkeypatch):
    monkeypatch.setattr(rig_fit, "least_squares", lambda _residual, start, **options: (start, options))
    problem = RigProblem(rig(TANK, "test"), "full order", [], ("volume", "C_d"))
    start, options = problem._solved(np.array([0.3, 0.4]))
    assert start.tolist() == [0.3, 0.4] and options["bounds"] == (0.0, 1.0)
    assert options["x_scale"] == "jac" and 0 < options["ftol"] == options["xtol"] < 1e-6
    low, high = (problem.values(np.full(2, end)) for end in (0.0, 1.0))
    assert (low["C_d"], high["C_d"], low["P_start"]) == (0.5, 1.0, 8e5)


def test_a_search_between_ends_of_either_sign_begins_on_a_line():
    content = {"bore_mm": 25, "dead_volume_mL": 5} | VALVE
    delayed = rig(content | {"valve_opening_delay_ms": [-2, 6], "valve_closing_delay_ms": [-4, -1]}, "test")
    problem = RigProblem(delayed, "full order", [], ("valve_opening_delay", "valve_closing_delay"))
    assert problem.start(0.25) == pytest.approx([0.25, 0.25], rel=1e-12)


@pytest.mark.parametrize(("model", "wall"), [("full order, adiabatic", False), ("full order, eq (7)", True)])
def test_a_wall_is_fitted_but_of_the_adiabatic_full_order(model, wall):
    names = fitted_names(rig(TANK | {"k_0_W_per_K": [0, 5]}, "test"), model)
    assert ("k_0" in names) == wall and {"C_d", "volume"} <= set(names)


@pytest.mark.parametrize("model", ["M1", "M8"])
def test_a_model_has_the_quantities_of_the_rig_but_the_thermometers_lag(model):
    names = fitted_names(rig(TANK | {"T_lag_s": [0, 5]}, "test"), model)
    assert {"C_d", "volume"} <= set(names) and "T_lag" not in names


@pytest.fixture
def solved(monkeypatch):
    """Function that makes `fit_rig` end at given parameters, residuals and derivatives."""

    def ends(x, fun, jac):
        optimum = SimpleNamespace(x=np.array(x), fun=fun, jac=jac)
        monkeypatch.setattr(RigProblem, "solve", lambda self, near, alone: optimum)
        monkeypatch.setattr(rig_fit, "run_errors", lambda *_: (1e3 * fun, np.empty(0)))
        return fit_rig(rig(TANK, "test"), "full order", [run_of(3)])

    return ends


NOISE = np.random.default_rng(6).normal(size=300)
COLUMNS = np.random.default_rng(7).normal(size=(300, 2)) @ np.array([[3.0, 0.5], [0.0, 0.2]])


def halves(estimate):
    """Half-widths between 0 and 1."""
    ends = {"volume": (5e-3, 15e-3), "C_d": (0.5, 1.0)}
    return [
        (estimate.high[name] - estimate.low[name]) / 2 / (high - low) for name, (low, high) in ends.items()
    ]


def freedom(residual, fitted):
    return len(residual) / correlation_time(residual) - fitted


def test_intervals_of_two_parameters_are_those_of_their_covariance(solved):
    found = solved([0.3, 0.6], NOISE, COLUMNS)
    assert (found.values["volume"], found.values["C_d"]) == pytest.approx((8e-3, 0.8), rel=1e-12)
    covariance = np.linalg.inv(COLUMNS.T @ COLUMNS) * (NOISE @ NOISE) / freedom(NOISE, 2)
    assert halves(found) == pytest.approx(1.96 * np.sqrt(np.diag(covariance)), rel=1e-9)
    assert found.rms == pytest.approx(1e3 * np.sqrt(np.mean(NOISE**2)), rel=1e-12)


@pytest.mark.parametrize("bound", [0.0005, 0.9995])
def test_a_parameter_on_a_bound_has_no_interval_and_is_taken_as_known_for_the_other(bound, solved):
    half, on_bound = halves(solved([0.3, bound], NOISE, COLUMNS))
    variance = (NOISE @ NOISE) / freedom(NOISE, 1) / (COLUMNS[:, 0] @ COLUMNS[:, 0])
    assert np.isnan(on_bound) and half == pytest.approx(1.96 * np.sqrt(variance), rel=1e-9)
    assert np.isfinite(halves(solved([0.3, 0.002], NOISE, COLUMNS))).all()
    assert np.isfinite(halves(solved([0.3, 0.998], NOISE, COLUMNS))).all()


@pytest.mark.parametrize(("bound", "other"), [(0.0005, 0.3), (0.9995, 0.3)])
def test_a_parameter_that_changes_nothing_is_not_determined_on_a_bound_either(bound, other, solved):
    deviation = np.sqrt((NOISE @ NOISE) / freedom(NOISE, 1))
    for half, end in ((0.99, np.nan), (1.01, np.inf)):
        flat = COLUMNS[:, 1] / np.linalg.norm(COLUMNS[:, 1]) * 1.96 * deviation / half
        first, second = halves(solved([other, bound], NOISE, np.column_stack([COLUMNS[:, 0], flat])))
        assert np.isfinite(first) and second == pytest.approx(end, nan_ok=True)


def test_what_changes_nothing_or_the_same_as_another_is_not_determined(solved):
    assert halves(solved([0.3, 0.6], NOISE, COLUMNS[:, [0, 0]])) == [np.inf, np.inf]
    seen, unseen = halves(solved([0.3, 0.6], NOISE, COLUMNS * [1.0, 0.0]))
    variance = (NOISE @ NOISE) / freedom(NOISE, 2) / (COLUMNS[:, 0] @ COLUMNS[:, 0])
    assert seen == pytest.approx(1.96 * np.sqrt(variance), rel=1e-9) and unseen == np.inf


@pytest.mark.parametrize(("half", "known"), [(0.99, True), (1.01, False)])
def test_an_interval_wider_than_between_the_ends_on_either_side_is_without_end(half, known, solved):
    column = COLUMNS[:, :1] / np.linalg.norm(COLUMNS[:, 0])
    other = np.linalg.qr(np.column_stack([column, COLUMNS[:, 1]]))[0][:, 1:]
    size = 1.96 * np.sqrt((NOISE @ NOISE) / freedom(NOISE, 2)) / half
    found = solved([0.3, 0.6], NOISE, np.column_stack([size * column, 20 * size * other]))
    first, second = halves(found)
    assert first == (pytest.approx(half, rel=1e-9) if known else np.inf)
    assert second == pytest.approx(half / 20, rel=1e-9) and found.low["volume"] < 0 < found.high["volume"]


def test_of_few_points_at_least_one_degree_of_freedom_is_left(solved):
    few = np.array([1.0, -1.0])
    half = halves(solved([0.3, 0.6], few, 10 * np.eye(2)))
    assert half == pytest.approx([1.96 * np.sqrt(few @ few) / 10] * 2, rel=1e-9)
    # One point shows one sum of two parameters, the shortest such pair is taken for their deviations.
    half = halves(solved([0.3, 0.6], few[:1], np.array([[10.0, 20.0]])))
    assert half == pytest.approx([1.96 * 0.05, 1.96 * 0.025], rel=1e-9)


def test_a_rig_that_is_known_is_replayed_and_nothing_is_fitted():
    known = rig(KNOWN, "test")
    run = run_of(20)
    found = fit_rig(known, "full order", [run])
    assert (found.fitted, found.low, found.high) == ((), {}, {}) and found.values["C_d"] == 0.8
    assert found.rms == pytest.approx(np.sqrt(np.mean(RigProblem(known, "full order", [run], ()).residual(
        np.empty(0)) ** 2)) * 1e3, rel=1e-9)  # fmt: skip


def test_a_correlation_time_is_the_sum_of_correlations_up_to_the_first_negative_one():
    for residual in (np.cumsum(NOISE[:51]), NOISE[:50] + 0.1 * np.cumsum(NOISE[:50]), np.arange(40.0)):
        e = residual - residual.mean()
        c = np.array([e[: len(e) - lag] @ e[lag:] for lag in range(len(e))]) / (e @ e)
        expected = 1 + 2 * c[1 : int(np.argmax(c < 0))].sum()
        assert 1.1 < expected == pytest.approx(correlation_time(residual), rel=1e-9)


def test_of_two_long_runs_the_first_is_fitted_whole_and_of_one_three_fifths():
    run = run_of(300)
    (first,) = fitted_runs([run, run])
    assert len(first.P.t) == 300
    (part,) = fitted_runs([run])
    assert len(part.P.t) == 180 and part.P.t[-1] <= 0.2 + 0.6 * 59.8


@pytest.mark.parametrize("given", [{}, {"temperature": True}])
def test_temperatures_are_fitted_on_demand_alone(given, monkeypatch):
    seen = []

    def solve(self, near, alone):
        seen.append(self.temperature)
        return SimpleNamespace(x=np.array([0.5, 0.5]), fun=NOISE, jac=COLUMNS)

    monkeypatch.setattr(RigProblem, "solve", solve)
    monkeypatch.setattr(rig_fit, "run_errors", lambda *_: (NOISE, np.ones(2)))
    fit_rig(rig(TANK, "test"), "full order", [run_of(3)], **given)
    judged(rig(TANK, "test"), "full order", [run_of(3)] * 2, **given)
    judged_models(rig(TANK, "test"), [run_of(3)] * 2, ["M1"], **given)
    assert seen == [bool(given)] * 3


def test_of_few_points_each_is_held_out_once_by_a_fit_to_the_others(monkeypatch):
    fits, replays = [], []
    estimate = RigEstimate({"C_d": 0.8}, ("C_d",), {}, {}, 1.0)

    def fitted(_rig, _model, runs, _temperature, near, alone=False):
        fits.append((runs[0].P.t.tolist(), near, alone))
        return estimate

    def errors(_rig, _model, _values, run):
        replays.append(run.P.t.tolist())
        return np.full(len(run.P.t), 3.0 if len(replays) == 1 else 4.0), np.array([2.0])

    monkeypatch.setattr(rig_fit, "fit_rig", fitted)
    monkeypatch.setattr(rig_fit, "run_errors", errors)
    run = run_of(7)
    result = judged(rig(TANK, "test"), "full order", [run])
    t = run.P.t.tolist()
    assert fits == [(t, None, False), *((half, estimate.values, True) for half in (t[::2], t[1::2]))]
    assert replays == [t[1::2], t[::2], t]
    assert result == Judged(estimate, pytest.approx(np.sqrt((3 * 9 + 4 * 16) / 7), rel=1e-12), 2.0)


def test_a_table_of_models_is_in_the_units_of_its_keys_and_begins_from_the_best_model(monkeypatch):
    begun, lines = [], []
    rms = {"M1": 4e3, "M3": 2e3, "full order": 3e3}

    def one(_rig, model, _runs, _temperature, near):
        begun.append(near)
        values = {"volume": 7e-3, "C_d": rms[model] / 5e3}
        fitted = ("volume",) if model == "M3" else ("volume", "C_d")
        low, high = ({name: f * value for name, value in values.items()} for f in (0.9, 1.1))
        return Judged(RigEstimate(values, fitted, low, high, rms[model]), 2 * rms[model], 5.0)

    monkeypatch.setattr(rig_fit, "judged", one)
    found = judged_models(rig(TANK, "test"), [], list(rms), progress=lines.append)
    of = {model: {"volume": 7e-3, "C_d": rms[model] / 5e3} for model in rms}
    assert begun == [None, of["M1"], of["M3"]]
    assert lines[0] == "M1: 4.00 kPa fitted, 8.00 held out"
    assert found["parameter"].values.tolist() == ["volume_L", "C_d"]
    expected = [[7.0, 0.8], [7.0, np.nan], [7.0, 0.6]]
    for name, part in (("estimate", 1.0), ("low", 0.9), ("high", 1.1)):
        np.testing.assert_allclose(found[name], part * np.array(expected), rtol=1e-12)
    assert found["held_out"].values.tolist() == [8e3, 4e3, 6e3] and (found["T_error"] == 5.0).all()


def test_a_hose_that_a_rig_may_lack_is_of_16_mm_to_8_m(monkeypatch):
    tried = []

    def fitted(possible, *_):
        tried.append(possible.ends)
        return RigEstimate({}, (), {}, {}, 1e3)

    monkeypatch.setattr(rig_fit, "fit_rig", fitted)
    chamber = rig({"bore_mm": 25, "dead_volume_mL": 5} | VALVE, "test")
    assert rig_warnings(chamber, [], 1e3) == []
    (ends,) = tried
    area = np.pi / 4 * 4e-3**2
    assert ends["hose_volume"] == pytest.approx((0.016 * area, 8.0 * area), rel=0.01)
    low, high = ends["hose_C"]  # narrower than any hose, and wider than any valve of such a cylinder
    assert (1e8 * low, 1e8 * high) == pytest.approx((0.05, 10.0)) and set(POSSIBLE_HOSE) <= set(ends)


def test_a_hose_of_a_vessel_is_more_than_a_thousandth_of_its_volume(monkeypatch):
    tried = []

    def fitted(possible, *_):
        tried.append(possible.ends["hose_volume"])
        return RigEstimate({}, (), {}, {}, 1e3)

    monkeypatch.setattr(rig_fit, "fit_rig", fitted)
    for litres in (0.1, [5, 500], 99):
        assert rig_warnings(rig({"volume_L": litres} | VALVE, "test"), [], 1e3) == []
    assert [low for low, _ in tried] == pytest.approx([0.2e-6, 5e-6, 99e-6], rel=1e-12)
    # Beside the gas of a larger vessel that of any hose is nothing.
    assert rig_warnings(rig({"volume_L": 101} | VALVE, "test"), [], 1e3) == [] and len(tried) == 3
