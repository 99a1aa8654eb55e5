"""Identification: the noise model, a synthetic cylinder found again, and what counts as fitted."""

import io

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from paper_study import STUDY
from rich.console import Console
from scipy.optimize import OptimizeResult

from pneumo.errors import ResultError
from pneumo.evidence.identification import deviance as deviances
from pneumo.evidence.identification import identify as identification
from pneumo.evidence.identification import mechanics, settling_stops
from pneumo.evidence.identification.deviance import THRESHOLD, deviance_interval, log_noise
from pneumo.evidence.identification.identify import IDENTIFICATION_LONG_NAMES, identify
from pneumo.papers.paper_2006.printed_tables import PAPER_FOLDER, table5
from pneumo.publish.figures.identification_figure import identification_figure
from pneumo.publish.style import paper_style
from pneumo.publish.text.formatting import significant
from pneumo.publish.text.terminal_tables import identification_tables
from pneumo.simulation.settling import NOT_SETTLED, QUANTITIES, settle
from pneumo.statistics.averages import rms_of
from pneumo.storage.files import read
from pneumo.verdict.claims import read_claims

pytestmark = pytest.mark.xdist_group("identification")  # its fixtures take seconds

TRUE = np.log([1.8, 120.0, 0.3])
NAMES = ("E13", "E14")


def synthetic() -> mechanics.SettlingCells:
    """Cylinder D with other parameters, its own settling times rounded to the millisecond."""
    table = table5().copy()
    for name in NAMES:
        experiment = mechanics.with_mechanics(STUDY.experiments[name], TRUE)
        table.loc[{"experiment": name}] = settle(experiment, longest=20.0).times
    return mechanics.settling_cells(STUDY.experiments, NAMES, table)


def stay(f, start, size=0.0):
    """A search that stays where it starts."""
    return OptimizeResult(x=start, fun=f(start), nfev=1)


def test_noise_adds_rounding_and_discrepancy_and_deviances_shrink_where_the_fit_is_bad():
    sigma = log_noise(np.array([0.1, 100.0]), np.array([5e-4, 5e-4]), 0.01)
    assert sigma[0] == pytest.approx(np.sqrt((5e-4 / np.sqrt(3) / 0.1) ** 2 + 0.01**2), rel=1e-15)
    assert sigma[1] == pytest.approx(0.01, rel=1e-6)
    # The rounding part is the spread of rounded numbers.
    x = np.linspace(0.1, 0.2, 100_001)
    spread = np.std(np.round(x, 3) - x)
    assert float(log_noise(np.array(1.0), np.array(5e-4), 0.0)) == pytest.approx(spread, rel=1e-3)
    assert deviances.widening(2.0, 8, 3) == 1.0
    assert deviances.widening(20.0, 8, 3) == 4.0


@given(st.floats(-5, 5), st.floats(0.01, 3))
def test_interval_of_a_parabola(centre, sigma):
    x = centre + sigma * np.linspace(-4, 4, 401)
    low, high = deviance_interval(x, ((x - centre) / sigma) ** 2)
    assert low == pytest.approx(centre - 1.95996 * sigma, abs=1e-3 * sigma)
    assert high == pytest.approx(centre + 1.95996 * sigma, abs=1e-3 * sigma)
    assert abs(THRESHOLD - 1.95996**2) < 1e-4
    # Chi squared of two degrees of freedom: an exponential.
    assert pytest.approx(-2 * np.log(0.05)) == deviances.REGION_THRESHOLD


def test_interval_without_an_end_and_correlation_of_a_known_normal():
    x, nan = np.arange(5.0), np.nan
    low, high = deviance_interval(x, np.array([9.0, 0.0, 1.0, 2.0, 2.0]))
    assert (low, high) == (pytest.approx(1 - THRESHOLD / 9), np.inf)
    assert deviance_interval(x, np.array([nan, 1.0, 0.0, 9.0, nan]))[0] == -np.inf
    # Of several crossings, the outermost count.
    assert deviance_interval(np.arange(6.0), np.array([8.0, 0.0, 8.0, 0.0, 8.0, 9.0]), 4.0) == (0.5, 3.5)
    x, ratio = np.linspace(-4, 4, 41), np.linspace(-5, 5, 51)
    ln_M, ln_ratio = np.meshgrid(x, ratio, indexing="ij")
    ln_k_f, r = ln_M + ln_ratio, 0.6
    deviance = (ln_M**2 - 2 * r * ln_M * ln_k_f + ln_k_f**2) / (1 - r**2)
    assert mechanics.correlation(x, ratio, deviance) == pytest.approx(r, abs=0.01)


def test_changed_is_the_configured_plant_and_the_profile_is_lowest_at_the_truth(monkeypatch):
    e = STUDY.experiments["E13"]
    again = mechanics.with_mechanics(e, np.log([1.5, 100.0, 0.3]), force=2.0)
    cylinder = again.plant.cylinder
    assert (cylinder.M, cylinder.k_f) == pytest.approx((e.plant.cylinder.M, e.plant.cylinder.k_f))
    assert again.push.x_stop == pytest.approx(e.push.x_stop)
    assert again.push.force == 2 * e.push.force
    monkeypatch.setattr(mechanics, "PROFILE_STEPS", np.array([0.05, 0.4]))
    monkeypatch.setattr(mechanics, "OFFSETS", np.array([-0.4, -0.05, 0.0, 0.05, 0.4]))
    monkeypatch.setattr(mechanics, "nearby", stay)
    best, data = OptimizeResult(x=TRUE, fun=0.0), synthetic()
    curves, lowest, evaluations = mechanics.mechanics_profiles(data, best, 1.0, map)
    assert lowest is best
    assert curves.shape == (3, 5)
    assert (curves[:, 2] == 0).all()
    assert (curves[:2, [1, 3]] > THRESHOLD).all()  # others held: far above what a profile would be
    for parameter, shift in enumerate(0.05 * np.eye(3)):
        assert curves[parameter, 3] == mechanics.deviance(TRUE + shift, data)
    assert evaluations >= 6


@pytest.mark.slow
def test_a_synthetic_cylinder_is_found_again_without_a_hint(monkeypatch):
    # Narrower than the real search, which takes a minute or two, and with a small population.
    monkeypatch.setattr(mechanics, "SEARCH_BOUNDS", np.array([(0.5, 8.0), (20.0, 400.0), (0.2, 0.8)]))
    bounds = mechanics.search_bounds(synthetic(), seed=1, mapper=map, population=4, generations=4)
    # Printed milliseconds leave a valley in which both change by some 1.5 % together.
    np.testing.assert_allclose(np.exp(bounds.x[:2]), np.exp(TRUE[:2]), rtol=0.02)
    assert abs(bounds.x[2] - TRUE[2]) < 0.2  # two experiments hardly determine the stop
    assert bounds.fun < 1.0  # eight cells; what is left is rounding


def test_what_does_not_settle_is_a_large_finite_residual_and_runs_can_be_capped():
    data = synthetic()
    silly = mechanics.log_ratios(data, np.log([0.1, 1000.0, 0.9]))
    assert np.isfinite(silly).all()
    assert np.isfinite(mechanics.deviance(np.log([20.0, 1.0, 0.1]), data))
    stuck = tuple(e._replace(push=e.push._replace(near=-1.0)) for e in data.experiments)
    stuck = data._replace(experiments=stuck)
    assert (mechanics.log_ratios(stuck, TRUE)[0] == mechanics.UNSETTLED_LOG).all()  # E13 is never back
    e = STUDY.experiments["E14"]
    assert settle(e._replace(push=e.push._replace(stop=0.5))).status == NOT_SETTLED  # T_A swings longer


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("E17", "not in this study; there are E01, "),
        ("E04", "not all four settling times in Table 5 are legible"),  # its row is blanked
        ("E13", "not all four settling times in Table 5 are legible"),  # its row is taken out
    ],
)
def test_experiments_that_cannot_be_used(name, message):
    with pytest.raises(ResultError, match=rf"^{name}: {message}"):
        table = table5().drop_sel(experiment="E13")
        table = table.where(table["experiment"] != "E04")
        mechanics.settling_cells(STUDY.experiments, [name], table)


def test_a_part_of_the_study_may_lack_what_is_fitted_and_scored_cells_have_no_role_in_the_fit():
    part = STUDY._replace(experiments={name: STUDY.experiments[name] for name in ("E06", "E12")})
    with pytest.raises(ResultError, match=r"^E09: not in this study"):
        identify(part, ["D"], 0, 1, print)
    scored = set(QUANTITIES) - set(mechanics.FITTED_QUANTITIES)
    assert len(mechanics.FITTED_QUANTITIES) == len(scored) == 2
    assert mechanics.IS_FITTED.sum() == 2
    data = synthetic()
    printed = np.where(mechanics.IS_FITTED, data.printed, 1e3)
    assert mechanics.deviance(TRUE, data._replace(printed=printed)) == mechanics.deviance(TRUE, data)


def test_claims_mark_what_is_fitted():
    items = read_claims(PAPER_FOLDER).items.values()
    of_percentiles = {claim.basis for claim in items if claim.column in ("p10", "p90")}
    assert of_percentiles == {"fitted"}
    assert {claim.basis for claim in items if claim.table in (5, 6, 7, 8, 9)} == {"fitted"}


@pytest.mark.parametrize("name", ["E08", "E10", "E12", "E14", "E16"])
def test_the_configured_end_of_a_settling_run_is_the_identified_one(name):
    e = STUDY.experiments[name]
    stop = settling_stops.identified_stop(e, table5().sel(experiment=name).values)
    assert stop.low - e.h < e.push.stop < stop.high + e.h
    assert stop.misfit < 0.03


def test_an_end_is_found_again():
    e = STUDY.experiments["E14"]
    times = settle(e._replace(push=e.push._replace(stop=1.6))).times
    stop = settling_stops.identified_stop(e, np.where([True, True, True, False], times, np.nan))
    assert stop.low <= 1.6 <= stop.high and stop.misfit < 1e-3


# All of it, with hardly any effort: searches stay where they start, runs last 60 steps


QUICK = {"D": ("E13", "E14"), "E": ("E15", "E16")}


@pytest.fixture(scope="module")
def hasty() -> xr.Dataset:
    start = np.log([1.5, 100.0, 0.3])

    def at_once(f, bounds, **_):
        return OptimizeResult(fun=f(np.mean(bounds)), nfev=1)

    def anywhere(data, *_):
        return OptimizeResult(x=start, fun=mechanics.deviance(start, data), nfev=7)

    small = {
        **{"PROFILE_STEPS": np.array([0.05, 0.3]), "OFFSETS": np.array([-0.3, -0.05, 0.0, 0.05, 0.3])},
        **{"REGION": 3, "RATIO_OFFSETS": np.linspace(-0.007, 0.007, 3), "FORCES": np.array([0.5, 1.0, 2.0])},
        **{"nearby": stay, "minimize_scalar": at_once, "search_bounds": anywhere},
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, value in small.items():
            patch.setattr(mechanics, name, value)
        for name, experiments in QUICK.items():
            patch.setitem(mechanics.FITTED_EXPERIMENTS, name, experiments)
        patch.setattr(settling_stops, "CANDIDATES", 10)
        brief = {name: e._replace(steps=60) for name, e in STUDY.experiments.items()}
        said = []
        identified = identify(STUDY._replace(experiments=brief), ["D", "E"], 0, 2, said.append)
    assert [text[:3] for text in said] == ["D: "] * 4 + ["E: "] * 4
    return identified


@pytest.mark.slow
def test_every_variable_is_described_and_comes_back(hasty, tmp_path):
    units = {name for name, (_, unit) in IDENTIFICATION_LONG_NAMES.items() if unit}
    assert units <= set(hasty.variables)
    assert all(hasty[name].attrs["long_name"] for name in IDENTIFICATION_LONG_NAMES)
    for name in ("a.nc", "b.nc"):
        identification.save_identification(hasty, STUDY, 5, tmp_path / name)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    back = read(tmp_path / "a.nc")
    assert (back.attrs["seed"], back.attrs["config_sha256"]) == (5, STUDY.config_sha256)
    np.testing.assert_array_equal(back["region_deviance"], hasty["region_deviance"])


@pytest.mark.slow
def test_both_cylinders_have_their_mechanics_and_the_lowest_deviance_is_zero(hasty):
    assert hasty["estimate"].sel(parameter="M").values == pytest.approx([1.5, 1.5])
    forces = [STUDY.experiments[names[0]].push.force for names in QUICK.values()]
    assert hasty["push_force"].values.tolist() == forces
    assert hasty["experiment"].values.tolist() == [*QUICK["D"], *QUICK["E"]]
    centre = hasty["profile_deviance"].isel(offset=2, parameter=0).values
    assert hasty["force_deviance"].sel(force_ratio=1.0).values == pytest.approx(centre)
    deviance = hasty["profile_deviance"].sel(cylinder="D")
    assert deviance.min() == 0 and (deviance.isel(offset=[0, 4]).dropna("parameter") > 0).all()
    of_cylinder = hasty["settling_log_ratio"].sel(experiment=list(QUICK["D"]))
    for key, fitted in (("fitted_rms", 1), ("scored_rms", 0)):
        chosen = of_cylinder.sel(quantity=(hasty["fitted"] == fitted).values)
        assert hasty[key].sel(cylinder="D").item() == pytest.approx(rms_of(chosen.values))


@pytest.mark.slow
def test_figure_and_tables_show_what_was_found(hasty, tmp_path):
    figure = identification_figure(hasty)
    with paper_style():
        figure.canvas.draw()
    axes = figure.findobj(Axes)
    titles = [ax.get_title(loc="left") for ax in axes]
    assert [title[:3] for title in sorted(titles)] == [f"({letter})" for letter in "abcdefghij"]
    assert any(title.startswith("(a) 1.500, ") for title in titles)
    (line,) = (line for line in axes[4].lines if len(line.get_xdata()) == 3)
    force = -STUDY.experiments["E13"].push.force
    np.testing.assert_allclose(line.get_xdata(), [force / 2, force, 2 * force])

    console = Console(width=200, file=io.StringIO())
    for table in identification_tables(hasty):
        console.print(table)
    text = console.file.getvalue()
    heads = ("M (kg)", "stop (of the half-stroke)", "0.1 to 20", "Table 5, closed loop")
    for words in heads:
        assert words in text
    first = next(iter(identification_tables(hasty)))
    assert list(first.columns[2].cells) == [significant(v) for v in hasty["estimate"].values.ravel()]
    assert len(list(identification_tables(hasty.sel(cylinder=["D"])))) == 3


@pytest.fixture(scope="module")
def found(evidence_file) -> xr.Dataset:
    return xr.load_dataset(evidence_file("identification.nc"))


def test_constants_lie_in_their_intervals_the_scored_half_agrees(found):
    configured = {"D": (1.5, 100.0, 0.3), "E": (5.0, 100.0, 38.0 / 137.5)}
    for cylinder, values in configured.items():
        of_cylinder = found.sel(cylinder=cylinder)
        assert bool((of_cylinder["low"] <= values).all() and (values <= of_cylinder["high"]).all()), cylinder
        assert bool(
            (of_cylinder["low"] < of_cylinder["estimate"]).all()
            and (of_cylinder["estimate"] < of_cylinder["high"]).all()
        )
    assert float(found["fitted_rms"].max()) <= 0.03
    assert float(found["scored_rms"].max()) <= 0.05
