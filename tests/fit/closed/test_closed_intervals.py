"""Intervals of closed chambers: by standard error where narrow, by profile where wide, open where blind."""

from types import SimpleNamespace

import numpy as np
import pytest

from pneumo.fit.closed import closed_fit
from pneumo.fit.closed.closed_fit import Solved
from pneumo.fit.parameter_intervals import HALF_WIDTH
from pneumo.fit.residuals import Residual

rng = np.random.default_rng(5)
SAMPLES = 4000
NOISE = rng.normal(0.0, 1e-3, 2 * SAMPLES)  # over 1 MPa
COLUMNS = rng.normal(size=(2 * SAMPLES, 2))
SCALES = {"k_A": 0.5, "leak": 1e-10}


def intervals(k_A=1.0, leak=0.3, steep=(1.0, 1.0), far=False, chambers=(0, 1)):
    """Intervals of a linear problem of k_A and leak, over their scales; `steep` scales the derivatives."""
    rows = len(chambers) * SAMPLES
    J, residual = COLUMNS[:rows] * np.array(steep), NOISE[:rows]
    optimum = SimpleNamespace(x=np.array([k_A, leak]), jac=J, fun=residual, cost=residual @ residual / 2)
    problem = SimpleNamespace(chambers=chambers, names=("k_A", "leak"), scales=SCALES)
    split = {"A": Residual(1e3, 2e3 if far else 0.0, 1e3)}
    return closed_fit._intervals(Solved(problem, optimum, np.zeros((2, SAMPLES)), split))


@pytest.fixture
def no_profile(monkeypatch):
    monkeypatch.setattr(closed_fit, "_end", None)


def half_of(rows=2 * SAMPLES):
    """Half-width for white noise and derivatives that are not correlated."""
    return HALF_WIDTH * 1e-3 / rows**0.5


@pytest.mark.usefixtures("no_profile")
@pytest.mark.parametrize("chambers", [(0, 1), (1,)])
def test_a_narrow_interval_is_that_of_the_standard_error(chambers):
    low, high = intervals(chambers=chambers)
    rows = len(chambers) * SAMPLES
    # The larger of two covariances, which 4,000 samples and their correlation know to some ten per cent.
    half = np.log(high["k_A"] / low["k_A"]) / 2
    assert half == pytest.approx(half_of(rows), rel=0.1)
    assert low["k_A"] * high["k_A"] == pytest.approx(SCALES["k_A"] ** 2, rel=1e-9)  # symmetric in ln k
    assert (high["leak"] - low["leak"]) / 2 == pytest.approx(SCALES["leak"] * half_of(rows), rel=0.1)
    assert (high["leak"] + low["leak"]) / 2 == pytest.approx(0.3 * SCALES["leak"], rel=1e-9)


@pytest.mark.usefixtures("no_profile")
def test_a_leak_is_not_below_zero_and_may_be_any_above():
    low, high = intervals(leak=0.0)
    assert low["leak"] == 0.0 and high["leak"] == pytest.approx(SCALES["leak"] * half_of(), rel=0.1)


def test_a_wide_interval_has_the_ends_of_the_profile(monkeypatch):
    told = []

    def end(_problem, _optimum, name, best, sign, allowed):
        told.append((name, best, sign, allowed))
        return best * np.exp(0.5 * sign)

    monkeypatch.setattr(closed_fit, "_end", end)
    flat = half_of() / 0.6  # a half-width of 0.6 is wide
    low, high = intervals(steep=(flat, 1.0))
    assert (low["k_A"], high["k_A"]) == pytest.approx((0.5 * np.exp(-0.5), 0.5 * np.exp(0.5)), rel=1e-12)
    assert [(name, best, sign) for name, best, sign, _ in told] == [("k_A", 1.0, -1.0), ("k_A", 1.0, 1.0)]
    # The sum of squares rises by so many variances of the noise, known to twice that of a half-width.
    assert told[0][-1] == pytest.approx(HALF_WIDTH**2 * 1e-6, rel=0.2)
    told.clear()
    intervals(steep=(half_of() / 0.15, 1.0))
    assert told == []


@pytest.mark.usefixtures("no_profile")
def test_where_the_law_is_wrong_no_profile_is_tried_and_an_end_below_zero_is_open():
    low, high = intervals(far=True, steep=(1e-9, 1.0))
    assert np.isnan(low["k_A"]) and high["k_A"] > SCALES["k_A"]
    # Model error makes intervals wider: every value counts whose added sum of squares is below that sum.
    usual, wrong = intervals(), intervals(far=True)
    width = [np.log(high["k_A"] / low["k_A"]) for low, high in (usual, wrong)]
    # sqrt(sum of squares / curvature) beside the standard error: the root of the number of samples.
    assert width[1] == pytest.approx(2 * 1e-3, rel=0.1) and width[1] > 10 * width[0]


@pytest.mark.usefixtures("no_profile")
@pytest.mark.parametrize("best", [0.5, 2.0])
def test_a_narrow_interval_is_relative_to_its_best(best):
    (low, high), (low_1, high_1) = intervals(k_A=best), intervals()
    assert low["k_A"] * high["k_A"] == pytest.approx((best * SCALES["k_A"]) ** 2, rel=1e-9)
    usual = np.log(high_1["k_A"] / low_1["k_A"])
    assert np.log(high["k_A"] / low["k_A"]) == pytest.approx(usual / best, rel=1e-9)


@pytest.mark.usefixtures("no_profile")
@pytest.mark.parametrize(("half", "open_below"), [(0.7, False), (1.5, True)])
def test_where_the_law_is_wrong_a_wide_interval_is_symmetric_and_open_below_zero(half, open_below):
    """So far that the sum of squares rises by itself; the leak has the same half-width, times ten."""
    far = NOISE @ NOISE
    steep = np.sqrt(far / np.sum(COLUMNS**2, axis=0)) / half
    low, high = intervals(far=True, steep=steep * [1.0, 0.1])
    # The two columns are nearly not correlated; noise itself adds little.
    assert high["k_A"] == pytest.approx(SCALES["k_A"] * (1 + half), rel=0.01)
    assert np.isnan(low["k_A"]) == open_below
    if not open_below:
        assert low["k_A"] == pytest.approx(SCALES["k_A"] * (1 - half), rel=0.03)
    assert low["leak"] == 0.0
    assert high["leak"] == pytest.approx(SCALES["leak"] * (0.3 + 10 * half), rel=0.01)


@pytest.mark.usefixtures("no_profile")
def test_each_parameter_has_the_larger_of_its_own_two_standard_errors():
    low, high = intervals(steep=(1.0, 0.01))
    assert (high["leak"] - low["leak"]) / 2 == pytest.approx(100 * SCALES["leak"] * half_of(), rel=0.1)
    assert np.log(high["k_A"] / low["k_A"]) / 2 == pytest.approx(half_of(), rel=0.1)


def parabola(best, half):
    """Problem whose deviance is 1 at a logarithmic distance `half` from the best, with 0.5 allowed."""

    def solve(_start, most, k_A):
        return SimpleNamespace(cost=0.25 * (np.log(k_A / best) / half) ** 2)

    return SimpleNamespace(solve=solve)


@pytest.mark.parametrize(("best", "sign"), [(5e-4, 1.0), (2e-3, -1.0), (2e-3, 1.0)])
def test_a_parameter_that_is_zero_has_no_lower_end(best, sign):
    optimum, least = SimpleNamespace(x=None, cost=0.0), max(best, 1e-3)  # over its scale; below it is zero
    end = closed_fit._end(parabola(least, 0.2), optimum, "k_A", best, sign, 0.5)
    # Near the best a parabola's root is met at once.
    assert end == pytest.approx(least * np.exp(sign * 0.2), rel=1e-12)
    assert np.isnan(closed_fit._end(parabola(1e-3, 0.2), optimum, "k_A", 5e-4, -1.0, 0.5))


@pytest.mark.parametrize("half", [0.35, 0.5, 0.8, 1.5])
def test_a_far_end_is_found_within_2_percent_of_its_distance(half):
    optimum = SimpleNamespace(x=None, cost=0.0)
    end = closed_fit._end(parabola(1.0, half), optimum, "k_A", 1.0, 1.0, 0.5)
    # It is told with two or three digits; between two bounds it is looked for as if on an exponential.
    assert np.log(end) == pytest.approx(half, rel=0.02)


def test_an_end_is_open_where_nothing_changes_or_no_replay_is_stable():
    class Flat:
        def solve(self, _start, most, k_A):
            return SimpleNamespace(cost=0.0)

    class Unstable:
        def solve(self, _start, most, k_A):
            return SimpleNamespace(cost=1e9)

    optimum = SimpleNamespace(x=None, cost=0.0)
    for problem in (Flat(), Unstable()):
        assert np.isnan(closed_fit._end(problem, optimum, "k_A", 1.0, 1.0, 0.5))
