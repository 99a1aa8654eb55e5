"""Refinements under other assumptions and physics: what is run, how it is scored, how it is shown."""

import numpy as np
import pytest
import xarray as xr
import yaml
from checkout import ROOT
from figure_checks import saved_whole

from pneumo.evidence.sensitivity import alternatives
from pneumo.evidence.sensitivity import refinement_variants as v
from pneumo.physics.models import MODELS, lane, lane_array
from pneumo.physics.valve import chamber_flows
from pneumo.publish.figures.alternatives_figures import LEVEL_MARKS, alternative_name, variants_figure
from pneumo.publish.text.markdown_tables import variants_table
from pneumo.simulation.full_order import record
from pneumo.simulation.replay import replay_one_by_one
from pneumo.simulation.signals import study_sampling
from pneumo.statistics.model_pairs import REFINED_MODELS, REFINEMENT_PAIRS
from pneumo.storage.files import read
from pneumo.verdict.assumptions import AS_TAKEN

CONFIG = yaml.safe_load((ROOT / "config/paper.yaml").read_text(encoding="utf-8"))
TINY = CONFIG | {"run": {"experiments": ["E06", "E12"], "duration_limit_s": 0.5}}
LEVEL = {"adiabatic": ["E06"], "typical": ["E06", "E12"], "isothermal": []}


@pytest.fixture(scope="module")
def by_alternative():
    return alternatives.grid_alternatives(TINY)


@pytest.fixture(scope="module")
def dataset(by_alternative):
    chosen = (AS_TAKEN, "mass_E.mass_E_4", "step.step_0_5_ms", "friction_law.coulomb", "valve.leak")
    chosen += ("supply.10_bar", "inlet.colder")
    made = v.study_variants({name: by_alternative[name] for name in chosen}, 2)
    return made[["mse"]].merge(v.refinement_ratios(made["mse"], LEVEL))  # one level without experiments


def test_what_does_not_reach_the_grid_is_left_out_and_physics_is_what_it_says(by_alternative):
    ledger = alternatives.ledger_alternatives(TINY)
    left_out = {name.partition(".")[0] for name in set(ledger) - set(by_alternative)}
    same = {"settling_E", "hold", "settling_change", "valve_leak", "settling_stop", "error_sign"}
    same |= {"transport", "transport_D_closed", "transport_E_closed", "transport_open", "lag", "step_halving"}
    # In closed loop an amplitude and the reversal of the sign mean nothing.
    open_loop = {"amplitude_D", "amplitude_E", "sign_reversal", "sign_reversal_tested", "reversal_late"}
    assert left_out == same | open_loop | {"variance_of_means", "percentiles"}
    assert next(iter(by_alternative)) == AS_TAKEN
    assert set(alternatives.OTHER_PHYSICS) < set(by_alternative)

    def plant(name):
        return by_alternative[name].study.experiments["E06"].plant

    taken = plant(AS_TAKEN)
    P_s, P_0 = (getattr(plant("supply.10_bar").conditions, name) for name in ("P_s", "P_0"))
    assert (P_s, P_0) == (1e6, pytest.approx(0.8077e6))
    assert plant("inlet.colder").conditions.T_in == 273 == taken.conditions.T_in - 20
    assert plant("inlet.warmer").conditions.T_in == 313
    assert plant("inlet.warmer").conditions.T_amb == plant("inlet.warmer").conditions.T_0 == 293
    assert plant("friction_law.coulomb").cylinder.coulomb == pytest.approx(11.0, rel=1e-3)  # N; 220 N push D
    assert plant("valve.leak").valve.leak == pytest.approx(1e-8)  # m^2; 1e-6 fully open
    other = plant("valve.elliptic")
    at_rest = other.conditions.P_0, 293.0, other.valve, other.gas, other.conditions
    (into, _), (_, out) = (chamber_flows(u, *at_rest) for u in (1, -1))
    assert into == pytest.approx(out, rel=1e-9)
    assert other.gas.elliptic and not taken.gas.elliptic


@pytest.mark.parametrize("transport", v.BOTH_SAMPLINGS)
def test_errors_are_those_of_plain_replays(by_alternative, dataset, transport):
    study = by_alternative[AS_TAKEN].study
    e = study.experiments["E12"]
    lanes = lane_array([lane(MODELS["M8"], 1.35, 1.4), lane(MODELS["M5"], 1.2, 1.4)])
    reading = study_sampling(transport, e)
    plain = replay_one_by_one(record(e), lanes, reading).mse.mean(axis=1)
    cells = dataset["mse"].sel(experiment="E12", alternative=AS_TAKEN, transport=transport)
    found_here = [cells.sel(model="M8", n=1.35).item(), cells.sel(model="M5", n=1.2).item()]
    np.testing.assert_allclose(found_here, plain, rtol=1e-9)  # two kernels, as in test_lanes


def test_an_alternative_changes_what_it_is_about_and_the_table_tells_it(dataset):
    mse = dataset["mse"]
    taken = mse.sel(alternative=AS_TAKEN)
    for name in mse["alternative"].values[1:]:
        differs = (mse.sel(alternative=name) != taken).any(("transport", "model", "n"))
        assert differs.sel(experiment="E12")
        assert differs.sel(experiment="E06") == (name != "mass_E.mass_E_4")
    lines = variants_table(dataset).splitlines()
    ratios = dataset.sel(transport="exact", criterion="mean", pair="M8/M7", level="typical")
    pays = int((ratios["ratio"] < 1).sum() - (ratios["ratio"].sel(alternative=AS_TAKEN) < 1))
    (row,) = [line for line in lines if line.startswith("| exact signals | mean | M8/M7 |")]
    assert row.split(" | ")[5] == f"{pays} of 6"
    assert row.endswith("| 0 of 0 |")  # isothermal: no experiment
    (row,) = [line for line in lines if line.startswith("| supply.10_bar |")]
    assert f"{ratios['ratio'].sel(alternative='supply.10_bar').item():.2f}" in row
    assert row.endswith("| - |")


def by_hand():
    # Two experiments, two n: constant n of the level is that of the lowest mean, overall each has its own.
    values = {"M5": [[4.0, 9.0], [100.0, 25.0]], "M6": [[1.0, 4.0], [25.0, 16.0]]}
    models = {model: values.get(model, [[1.0, 1.0], [1.0, 1.0]]) for model in REFINED_MODELS}
    mse = xr.DataArray(
        np.array(list(models.values())).transpose(1, 0, 2),
        {"experiment": ["E06", "E12"], "model": list(models), "n": [1.0, 1.4]},
        ("experiment", "model", "n"),
    )
    return xr.concat([mse, 4 * mse, np.nan * mse], xr.Variable("alternative", [AS_TAKEN, "b.b", "c.c"]))


@pytest.mark.parametrize(
    ("model", "level", "criterion", "expected"),
    [
        ("M5", "typical", "mean", 17),  # (9 + 25)/2, n = 1.4
        ("M6", "typical", "mean", 10),
        ("M5", "typical", "geometric mean", 15),
        ("M6", "typical", "geometric mean", 5),  # now n = 1
        ("M5", "overall", "mean", 14.5),
        ("M5", "overall", "geometric mean", 10),
        ("M5", "adiabatic", "mean", 4),
        ("M5", "isothermal", "mean", np.nan),
    ],
)
def test_scores_by_hand(model, level, criterion, expected):
    scores = v.level_scores(by_hand(), LEVEL).sel(alternative=AS_TAKEN, model=model)
    at_level = scores.sel(level=level, criterion=criterion)
    assert at_level.item() == pytest.approx(expected, nan_ok=True)


def test_shares_count_alternatives_that_have_a_ratio():
    mse = by_hand()
    summary = v.refinement_ratios(mse, LEVEL)
    mixing = summary.sel(pair="M6/M5", level="typical", criterion="mean")
    assert mixing["ratio"].sel(alternative="b.b").item() == pytest.approx(10 / 17)
    # c.c has none, and the study itself does not count.
    assert mixing["counted"] == 1 and mixing["share"] == 1
    equal = summary.sel(pair="M8/M7", level="typical", criterion="mean")
    assert equal["share"] == 0  # no gain is not below one
    assert summary["share"].sel(level="isothermal").isnull().all()


@pytest.mark.slow
def test_figure_has_a_mark_for_every_ratio_and_is_unclipped(dataset, tmp_path):
    fig = variants_figure(dataset)
    saved_whole(fig, tmp_path / "variants")
    for ax, pair in zip(fig.axes, REFINEMENT_PAIRS, strict=True):
        for line, level in zip(ax.get_lines()[1:], LEVEL_MARKS, strict=True):
            ratio = dataset["ratio"].sel(pair=pair, level=level, transport="exact", criterion="mean")
            np.testing.assert_array_equal(line.get_xdata(), ratio)
    shown = [label.get_text() for label in fig.axes[0].get_yticklabels()]
    assert shown == [alternative_name(name) for name in dataset["alternative"].values]
    assert shown[0] == "as taken" and shown[-2:] == ["supply 10 bar", "inlet colder"]
    heights = fig.axes[0].get_lines()[1].get_ydata()
    assert heights[0] == max(heights)  # the study on top


@pytest.mark.results
def test_mixing_pays_at_the_adiabatic_level_unless_air_comes_in_cold(evidence_file):
    stored = read(evidence_file("variants.nc"))
    others = stored["ratio"].drop_sel(alternative=AS_TAKEN)
    assert stored["counted"].min() == others.sizes["alternative"] >= 30  # every run went through
    np.testing.assert_allclose(stored["share"], (others < 1).mean("alternative"))
    exact = stored["ratio"].sel(transport="exact", criterion="mean", level="adiabatic")
    mixing, inlet = exact.sel(pair=["M8/M7", "M6/M5"]), ["inlet.colder", "inlet.warmer"]
    assert (mixing.drop_sel(alternative=inlet) < 1).all()
    # Eq (6) knows T_0 only: with it, a model that is told the true T_in gets worse.
    assert (mixing.sel(alternative="inlet.colder") > 1).all()
