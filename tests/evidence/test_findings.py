"""Statements about models over seed sets: judged as the verdict does, with intervals, and shown."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console
from scipy import stats

from pneumo.configuration.parameters import load, study
from pneumo.evidence import findings as f
from pneumo.evidence.ensemble import complete_sets, ensemble_statistics, scores_by_criterion
from pneumo.papers.paper_2006.computations import COMPUTATIONS
from pneumo.papers.paper_2006.paper import PAPER_2006
from pneumo.physics.models import MODELS
from pneumo.publish.figures.ensemble_figure import ensemble_figure
from pneumo.publish.style import save
from pneumo.publish.text.markdown_tables import findings_table
from pneumo.publish.text.terminal_tables import probability_table, ratio_table
from pneumo.verdict.claims import read_claims
from pneumo.verdict.judging import Judge
from pneumo.verdict.sources import Finding, StudyResults

ROOT = Path(__file__).parents[2]
STUDY = study(load(ROOT / "config/paper.yaml"))
CLAIMS = read_claims()


@pytest.fixture(scope="module")
def ensemble():
    """Random errors in the form of an ensemble of three seed sets; M1 is M2 at n = 1."""
    rng = np.random.default_rng(31)
    experiments = STUDY.experiments
    shape = (3, 2, len(experiments), len(MODELS), len(STUDY.n), 2)
    mse = 1e6 * np.exp(rng.normal(0, 0.3, shape))
    mse[..., 0, :, :] = mse[..., 1, :1, :]
    dims = ("seeds", "transport", "experiment", "model", "n", "chamber")
    labels = {
        "cylinder": [e.cylinder for e in experiments.values()],
        "loop": ["closed" if e.drive.closed_loop else "open" for e in experiments.values()],
        "k_0": [e.plant.k_0 for e in experiments.values()],
    }
    return xr.Dataset(
        {
            "mse": (dims, mse),
            "mean_error": (dims, 0.1 * np.sqrt(mse)),
            "failure_time": (dims, np.full(shape, np.nan)),
        },
        coords={
            "seeds": [0, 1, 2],
            "transport": ["published", "exact"],
            "experiment": list(experiments),
            "model": list(MODELS),
            "n": list(STUDY.n),
            "chamber": ["A", "B"],
            **{name: ("experiment", values) for name, values in labels.items()},
        },
    )


@pytest.fixture(scope="module")
def found(ensemble):
    return f.findings(STUDY, ensemble, CLAIMS, ROOT / "results")


@pytest.fixture
def invented():
    """A computation whose sources are its findings."""
    name = "of_the_test"
    COMPUTATIONS.pop(name, None)

    def of_the_test(source):
        return source

    COMPUTATIONS[name] = of_the_test
    yield CLAIMS.items["S4.alike.overall"].model_copy(update={"compute": name, "arguments": {}})
    del COMPUTATIONS[name]


def test_a_source_of_one_seed_set_has_the_studys_own_tables(ensemble):
    cells = ensemble.sel(seeds=0, transport="exact").drop_attrs()
    source = f.SeedSet(STUDY, cells, "exact")
    level = source.statistics["mse"].sel(level="overall")
    by_hand = cells["mse"].mean("chamber").min("n").mean("experiment")
    np.testing.assert_allclose(level, by_hand)
    assert source.study is STUDY


def test_decades_become_quotients_with_students_interval(invented):
    decades = [0.05, 0.08, 0.2, 0.09]
    judged = f.over_seed_sets(invented, CLAIMS, [Finding(value) for value in decades])
    low, high = stats.ttest_1samp(decades, 0).confidence_interval(0.95)
    assert (judged.value, judged.low, judged.high) == pytest.approx((10**0.105, 10**low, 10**high))
    assert (judged.holds, judged.sets) == (3, 4)  # at most 0.1 decades
    # Clopper and Pearson's by their definition through the beta distribution.
    assert judged.share_low == pytest.approx(stats.beta.ppf(0.025, 3, 2))
    assert judged.share_high == pytest.approx(stats.beta.ppf(0.975, 4, 1))


def test_what_is_only_true_or_false_has_no_number(invented):
    judged = f.over_seed_sets(invented, CLAIMS, [Finding(holds=True), Finding(holds=False)])
    assert judged.value is judged.low is judged.high is None
    assert judged.holds == 1


@settings(deadline=None)
@given(st.integers(1, 200), st.data())
def test_it_stands_where_95_of_100_say_so(sets, data):
    holds = data.draw(st.integers(0, sets))
    judged = f.StatementOverSets(None, None, None, holds, sets, 0.0, 1.0)
    assert judged.stands is (True if 20 * holds >= 19 * sets else False if 20 * holds <= sets else None)


def test_answers():
    def judged(holds):
        return f.StatementOverSets(None, None, None, holds, 100, 0.0, 1.0)

    yes, some, no = judged(100), judged(50), judged(0)
    assert f._answer(yes, yes) == ("yes", "")
    assert f._answer(yes, no) == ("no", "made by the published transport")
    assert f._answer(no, yes) == ("yes", "hidden by the published transport")
    assert f._answer(no, no) == ("no", "with neither transport")
    assert f._answer(yes, some) == ("in part", "depends on the seeds")
    assert f._answer(some, yes)[0] == "yes" and "seeds" in f._answer(some, yes)[1]
    assert f._answer(some, no)[0] == "no" and "seeds" in f._answer(some, no)[1]


def test_every_statement_about_models_is_there_and_no_cell_of_a_table(found):
    expected = [c.id for c in CLAIMS.items.values() if c.models and c.table is None]
    assert [row["id"] for row in found["claims"]] == expected
    assert found["seed_sets"] == 3
    headlines = [row["id"] for row in found["claims"] if row["headline"]]
    assert {"S4.alike.overall", "S4.best_choice", "S4.no_gain"} <= set(headlines) < set(expected)


def test_what_is_made_to_hold_stands_and_what_is_not_does_not(found):
    rows = {row["id"]: row for row in found["claims"]}
    (same, *others) = [rows[name] for name in rows if CLAIMS.items[name].compute == "same_cells"]
    assert (same["stands"], same["exact"], same["published"]) == ("yes", "3 of 3", "3 of 3")
    for row in others:
        assert (row["stands"], row["exact"], row["why"]) == ("no", "0 of 3", "with neither transport")


def test_texts():
    def text(name):
        return f.claim_in_words(CLAIMS.items[name], CLAIMS.classes)

    assert text("S4.M6_85") == "M6's error over M5's is about 85 %"
    assert text("S4.M7_n").endswith("level: 1.35")
    assert text("S4.best_choice").endswith("level: M7")
    assert text("S4.alike.overall").endswith("(quotient of MSE at most 1.26)")
    assert text("S4.M4_worst").endswith("(quotient of MSE at least 1.26)")
    assert f.number_with_unit(0.0391, CLAIMS.items["S4.M7_10"]) == "3.9 %"
    assert f.number_with_unit(0.391, CLAIMS.items["S4.M7_10"]) == "39 %"
    assert f.number_with_unit(-104.6, CLAIMS.items["S4.M7_mu"]) == "-105 Pa"


def test_a_study_of_two_experiments_says_what_it_lacks(ensemble):
    only = STUDY._replace(experiments={name: STUDY.experiments[name] for name in ("E01", "E02")})
    few = f.findings(only, ensemble.sel(experiment=["E01", "E02"]), CLAIMS, ROOT / "results")
    rows = {row["id"]: row for row in few["claims"]}
    assert rows["S4.alike.typical"]["stands"] == "not run"
    assert rows["S4.alike.typical"]["why"] == "no number for typical, M1"
    assert rows["S4.no_single_best"]["stands"] != "not run"


def test_a_seed_set_that_lacks_something_is_left_out_and_counted(ensemble):
    lacking = ensemble.copy(deep=True)
    lacking["mse"].loc[{"seeds": 1, "transport": "exact", "experiment": "E04", "model": "M10"}] = np.nan
    without = ensemble.sel(seeds=[0, 2])
    some, fewer = (f.findings(STUDY, e, CLAIMS, ROOT / "results") for e in (lacking, without))
    assert (some["seed_sets"], some["drawn"], fewer["drawn"]) == (2, 3, 2)
    assert some["claims"] == fewer["claims"]
    assert "1 more are left out" in some["note"] and "left out" not in fewer["note"]
    found, expected = (ensemble_statistics(e, STUDY.experiments_by_level) for e in (lacking, without))
    assert found["complete"].values.tolist() == [1, 0, 1]
    assert found["failed_sets"].sel(experiment="E04") == 1 == found["failed_sets"].sum()
    names = ["table_mse", "probability", "ratio_value", "experiment_ratio_high"]
    xr.testing.assert_identical(found[names], expected[names])


def test_an_n_that_fails_somewhere_is_no_constant_n(ensemble):
    lacking = ensemble.copy(deep=True)
    best = {"seeds": 0, "transport": "exact", "experiment": "E05", "model": "M8", "n": 1.2}
    lacking["mse"].loc[{**best, "experiment": slice(None)}] = 1.0  # by far the lowest everywhere, but
    lacking["mse"].loc[best] = np.nan
    assert complete_sets(lacking, STUDY.experiments_by_level).all()
    mse = lacking["mse"].mean("chamber", skipna=False).sel(seeds=0, transport="exact")
    of_M8 = scores_by_criterion(mse, STUDY.experiments_by_level).sel(model="M8", criterion="mean")
    assert of_M8.sel(level="typical") > 1.0 and of_M8.sel(level="isothermal") == 1.0


def test_as_table_figure_and_on_the_terminal(found, ensemble, tmp_path):
    text = findings_table(found)
    assert text.count("\n| ") == 1 + sum(row["headline"] for row in found["claims"]) - 1
    assert findings_table(found, headlines=False).count("\n| ") == len(found["claims"])
    everything = ensemble_statistics(ensemble, STUDY.experiments_by_level)
    console = Console(width=200, record=True)
    console.print(ratio_table(everything), probability_table(everything, "exact", "overall"))
    shown = console.export_text()
    value = everything["ratio_value"].sel(
        ratio="M8/M7", level="adiabatic", averaged="mean", transport="exact"
    )
    assert f"{value.item():.3f} [" in shown and "Of 3 seed sets" in shown
    for file in save(ensemble_figure(everything), tmp_path / "ensemble"):
        assert file.stat().st_size > 10_000


@pytest.mark.results
def test_own_seeds_give_what_the_verdict_says():
    """Set 0 of the ensemble has the study's seeds: judged alike, with both transports."""
    results = ROOT / "results"
    block = results / "ensemble" / "000.nc"
    if not block.exists():
        pytest.skip("no ensemble: snakemake -j2 ensemble")
    from pneumo.storage.files import read

    first = read(block, "mean_error", "mse", "failure_time").sel(seeds=0)
    judge = Judge(results, PAPER_2006)
    for name, transport in (("published", "published"), ("exact", "exact")):
        own = f.SeedSet(STUDY, first.sel(transport=transport).drop_attrs(), transport)
        of_study = StudyResults(results, name)
        for claim in judge.claims.items.values():
            if claim.models and claim.table is None:
                compute = COMPUTATIONS[claim.compute]
                a, b = compute(own, **claim.arguments), compute(of_study, **claim.arguments)
                assert (a.holds, a.shown) == (b.holds, b.shown), claim.id
                assert a.value == (b.value if b.value is None else pytest.approx(b.value, rel=1e-9)), claim.id


@pytest.mark.results
def test_readme_shows_what_was_found():
    file = ROOT / "results" / "findings.json"
    if not file.exists():
        pytest.skip("no findings: snakemake -j2 ensemble")
    from pneumo.storage.files import read_json

    shown = (ROOT / "README.md").read_text(encoding="utf-8")
    between = shown.partition("<!-- findings:")[2].partition("-->")[2].partition("<!-- /findings -->")[0]
    assert between.strip() == findings_table(json.loads(read_json(file))).strip()
