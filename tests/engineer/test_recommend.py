"""The tree behind `pneumo recommend`: grown, walked, judged, drawn, and asked about a cylinder."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.collections import PathCollection
from sklearn.tree import DecisionTreeClassifier
from test_cylinders import M, errors, invented
from test_repeated import script

from pneumo.cli.commands import main
from pneumo.configuration.parameters import load, study
from pneumo.engineer import recommend
from pneumo.evidence import random_cylinders as catalogue
from pneumo.evidence import tree as t
from pneumo.evidence.dimensionless import GROUPS, groups
from pneumo.evidence.random_cylinders import random_cylinder, sizes
from pneumo.evidence.recommended import Cases, recommendation, recommendation_text, score
from pneumo.evidence.regimes import GOOD, analysed, judged
from pneumo.publish.figures import regimes_figure as drawing
from pneumo.storage.files import damaged, read, read_json

ROOT = Path(__file__).parents[2]
PAPER = study(load(ROOT / "config" / "paper.yaml"))
TREE = {
    "group": "exchange",
    "threshold": 1.5,
    "below": {"model": "M5", "n": 1.3},
    "above": {
        "group": "closed",
        "threshold": 0.5,
        "below": {"model": "M8", "n": 1.35},
        "above": {"model": "M6", "n": 1.4},
    },
}


# The tree


def test_walk_by_hand():
    assert t.walk(TREE, {"exchange": 1.5, "closed": 1.0})[1]["model"] == "M5"
    way, leaf = t.walk(TREE, {"exchange": 1.6, "closed": 1.0})
    assert leaf == {"model": "M6", "n": 1.4}
    assert way == (t.Step("exchange", False, 1.5), t.Step("closed", False, 0.5))
    assert [leaf["model"] for _, leaf in t.leaves(TREE)] == ["M5", "M8", "M6"]


def test_a_tighter_threshold_makes_an_earlier_one_needless():
    way = [t.Step("way", False, 1.0), t.Step("way", False, 3.0), t.Step("way", True, 9.0)]
    assert t.tightest(way) == way[1:]


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6), st.integers(1, 4))
def test_walk_is_scikit_learns_but_for_rounding(seed, columns):
    rng = np.random.default_rng(seed)
    known = {name: 10 ** rng.uniform(-2, 2, 300) for name in list(GROUPS)[:columns]}
    first = np.log10(known["thermal"])
    answers = np.where(first > 0.5, "M8", np.where(rng.random(300) < 0.3, "M5", "M6"))

    def leaf(cases):
        names, counts = np.unique(answers[cases], return_counts=True)
        return {"model": str(names[counts.argmax()]), "runs": len(cases)}

    mine = t.grown(known, answers, leaf)
    theirs = DecisionTreeClassifier(max_leaf_nodes=t.LEAVES, min_samples_leaf=t.LEAST, random_state=0)
    theirs.fit(np.stack([np.log10(values) for values in known.values()], axis=1), answers)
    ends = list(t.leaves(mine))
    assert 1 <= len(ends) <= t.LEAVES and sum(end["runs"] for _, end in ends) == 300
    asked = {name: 10 ** rng.uniform(-2, 2, 500) for name in known}
    place = t.places(mine, asked)
    expected = theirs.predict(np.stack([np.log10(values) for values in asked.values()], axis=1))
    far, compared = np.ones(500, dtype=bool), 0
    for way, _ in ends:
        for step in way:  # two digits move a threshold by 5 % at most
            far &= np.abs(np.log(asked[step.group] / step.threshold)) > 0.06
    for i in np.flatnonzero(far):
        one = {name: float(values[i]) for name, values in asked.items()}
        assert t.walk(mine, one)[1] is ends[place[i]][1]
        counts = [np.sum(answers[t.places(mine, known) == place[i]] == name) for name in np.unique(answers)]
        if max(counts) - sum(counts) / 2 > 15:  # a majority that rounding cannot turn
            assert ends[place[i]][1]["model"] == expected[i]
            compared += 1
    assert compared > 0


def test_thresholds_have_two_digits_and_an_empty_side_goes():
    values = np.concatenate([np.full(40, 1.06), np.full(40, 1.08)])
    answers = np.repeat(["M5", "M8"], 40)
    found = t.grown({"exchange": values}, answers, lambda cases: {"runs": len(cases)})
    assert found == {"runs": 80}  # 1.07 is 1.1 in two digits, and all lie below
    apart = np.concatenate([np.full(40, 1.0), np.full(40, 2.0)])
    found = t.grown({"exchange": apart}, answers, lambda cases: {"runs": len(cases)})
    assert found["threshold"] == 1.4 and found["below"] == {"runs": 40}


# Growing it on runs


def pays_by_exchange(cylinders=80):
    """M8 is ten times as good where much air is exchanged, M5 elsewhere."""
    exchange = np.exp(np.random.default_rng(3).normal(size=(cylinders, 2)))
    lowest = errors(cylinders, sigma=0.01)
    lowest[..., M["M8"]] *= np.where(exchange > 1.0, 0.1, 10.0)
    lowest[..., M["M5"]] *= np.where(exchange > 1.0, 10.0, 0.1)
    return judged(invented(lowest, exchange), 50)


def test_a_rule_that_is_there_is_found_and_judged_on_others():
    found = recommendation(pays_by_exchange())
    assert found["tree"]["group"] == "exchange" and found["tree"]["threshold"] == pytest.approx(1.0, rel=0.1)
    assert found["tree"]["below"]["model"] == "M5" and found["tree"]["above"]["model"] == "M8"
    assert found["tree"]["below"]["n"] == 1.3
    assert found["score"]["tree"]["right"][0] > 0.95 and found["score"]["tree"]["cost"][0] < 1.3
    assert found["score"]["majority"]["right"][0] < 0.65
    assert found["cylinders"] == {"trained": 50, "held_out": 30} and found["runs"] == {
        "trained": 100,
        "held_out": 60,
    }
    ends = [leaf for _, leaf in t.leaves(found["tree"])]
    assert sum(leaf["held_out"]["runs"] for leaf in ends) == 60
    assert sum(leaf["runs"] for leaf in ends) == 100
    assert found["groups"]["exchange"]["meaning"] == GROUPS["exchange"]


def test_what_is_held_out_grows_nothing():
    runs = pays_by_exchange()
    spoilt = runs.copy(deep=True)
    rows = dict(cylinder=runs["held_out"] == 1)
    spoilt["answer"].loc[rows] = "M9"
    one, other = recommendation(runs), recommendation(spoilt)
    for found in (one, other):
        for _, leaf in t.leaves(found["tree"]):
            del leaf["held_out"]
    assert one["tree"] == other["tree"] and other["score"]["tree"]["right"][0] == 0


def test_scores_by_hand():
    lowest = np.full((2, 2, 10), 4.0)
    lowest[..., M["M8"]] = 1.0
    cases = Cases(judged(invented(lowest), 2), GROUPS)
    found = score(cases, np.array(["M8", "M8", "M8", "M5"]), np.array([1.3, 1.2, 1.3, 1.3]))
    assert found["right"][0] == 0.75
    assert found["cost"][0] == pytest.approx((1 * 2 * 1 * 4) ** 0.25, abs=5e-3)
    assert found["cost_at_best_n"][0] == pytest.approx(4**0.25, abs=5e-3)
    assert cases.best_n("M8", np.arange(4)) == 1.3
    assert cases.leaf(np.arange(4))["answers"]["M8"] == 4


def test_a_run_that_does_not_count_is_counted_as_failed():
    runs = pays_by_exchange()
    runs["counts"][0, 0], runs["answer"][0, 0] = 0, ""
    found = recommendation(runs)
    assert found["failed_runs"] == 1 and found["runs"]["trained"] == 99


def test_the_workflows_scripts_go_from_cylinders_to_tree_and_map(tmp_path, monkeypatch):
    monkeypatch.setattr(catalogue, "STEPS", 100)
    monkeypatch.setattr(catalogue, "HOLD", (0.005, 0.01))
    blocks = [str(tmp_path / "cylinders" / f"{first:03}.nc") for first in (0, 18)]
    for first, block in zip((0, 18), blocks, strict=True):
        script("cylinders_block").main(block, list(range(first, first + 18)), 2, "")
    cells, tree = str(tmp_path / "cylinders.nc"), str(tmp_path / "recommendation.json")
    script("cylinders").main(blocks, 24, cells, tree, str(tmp_path / "regimes.svg"), "")
    found, known = read(cells), json.loads(read_json(tree))
    assert found["cylinder"].values.tolist() == list(range(36))
    assert found["held_out"].values.tolist() == [0] * 24 + [1] * 12
    assert known["runs"] == {"trained": 48, "held_out": 24} and known["failed_runs"] == 0
    assert len(list(t.leaves(known["tree"]))) <= 2  # 48 runs are too few for three
    assert (tmp_path / "regimes.png").exists()
    own = [groups(e)["exchange"] for e in random_cylinder(7)]
    assert found["exchange"].values[7].tolist() == own
    assert damaged(tmp_path) == []


# Drawing it


def test_map_shows_every_run_and_the_trees_boundaries():
    runs = pays_by_exchange()
    text = recommendation_text(runs)
    figure = drawing.regimes(analysed(runs), text)
    panels = [ax for ax in figure.axes if ax.get_title()]
    assert len(panels) == 3 and panels[0].get_xlabel() == ""
    points = [part for part in panels[0].collections if isinstance(part, PathCollection)]
    drawn = np.concatenate([np.asarray(part.get_offsets()) for part in points])
    shares = json.loads(text)["compared"]["both"]["share"]
    assert shares["M8/M7 < 1"][0] == pytest.approx(analysed(runs)["share"].values[2, 1, 0], abs=5e-4)
    names = [*drawing.asked(json.loads(text)["tree"]), *drawing.AXES]
    assert names[0] == "exchange"
    assert np.sort(drawn[:, 0]) == pytest.approx(np.sort(runs["exchange"].values.ravel()))
    threshold = json.loads(text)["tree"]["threshold"]
    assert any(np.all(line.get_xdata() == threshold) for ax in panels for line in ax.lines)
    ratio = np.log10(runs["lowest"].sel(model="M8") / runs["lowest"].sel(model="M7")).sel(loop="open")
    assert np.asarray(points[0].get_array()) == pytest.approx(np.clip(ratio.values, -1, 1))


def test_questions_come_in_the_order_of_the_tree():
    node = {"group": "way", "threshold": 1, "below": TREE, "above": TREE | {"group": "thermal"}}
    assert drawing.asked(node) == ["way", "exchange", "thermal"]


# Asking it


@pytest.fixture(scope="module")
def known():
    return recommend.shipped()


def test_the_shipped_tree_is_whole(known):
    ends = list(t.leaves(known["tree"]))
    assert 2 <= len(ends) <= 5
    assert all(leaf["model"] in GOOD and leaf["runs"] > 0 for _, leaf in ends)
    assert {step.group for way, _ in ends for step in way} <= set(GROUPS) == set(known["groups"])
    assert known["cylinders"] == {"trained": 200, "held_out": 100}
    of = known["runs"]["trained"] + known["runs"]["held_out"] + known["failed_runs"]
    assert of == 600 and sum(leaf["runs"] for _, leaf in ends) == known["runs"]["trained"]


@pytest.mark.results
def test_the_shipped_tree_is_the_one_that_was_made(results):
    made = results / "recommendation.json"
    if not made.exists():
        pytest.skip("no results/recommendation.json: `snakemake cylinders` makes it")
    assert made.read_bytes() == recommend.FILE.read_bytes()


@pytest.mark.parametrize("name", PAPER.experiments)
def test_advice_is_the_leaf_with_the_way_to_it(name, known):
    e = PAPER.experiments[name]
    found = recommend.advice(e, known)
    way, leaf = t.walk(known["tree"], groups(e))
    assert (found.model, found.n) == (leaf["model"], leaf["n"])
    for reason, step in zip(found.reasons, t.tightest(way), strict=True):
        assert step.group == "closed" or f"above {step.threshold:g}" in reason


@pytest.mark.parametrize("group", GROUPS)
def test_every_group_can_be_told_with_a_unit(group):
    e = PAPER.experiments["E10"]
    value = groups(e)[group]
    text = recommend.told(t.Step(group, False, 2.0), value, e.plant, 0.0567, 0.1)
    assert text == "the loop is closed" or ("above 2" in text and f"{value:.3g} " in text)


def test_numbers_in_the_reasons_are_those_of_the_cylinder():
    e = PAPER.experiments["E14"]
    text = recommend.told(t.Step("friction", True, 0.5), groups(e)["friction"], e.plant, 1.0, 0.1)
    # viscous alone: 100 N s/m at 0.0404 P_s A_t R T / (P_0 A), that is 0.786 m/s
    assert text.startswith("friction, 78.") and text.endswith("not above 0.5")
    text = recommend.told(t.Step("dead", True, 0.5), groups(e)["dead"], e.plant, 1.0, 0.1)
    assert "1.57 cm³" in text


def test_inside_says_nothing_and_outside_says_what():
    e = random_cylinder(4)[0]
    assert e.plant.cylinder.A_B < e.plant.cylinder.A_A  # it has a rod
    found = groups(e)
    ends = {name: [value, value] for name, value in sizes(e.plant).items()}
    inside = {
        "sizes": ends,
        "groups": {name: {"meaning": GROUPS[name], "range": [v, v]} for name, v in found.items()},
    }
    assert recommend.beyond(e, found, inside) == ()
    cylinder = e.plant.cylinder
    stroke = 1e3 * cylinder.stroke
    narrow = inside | {"sizes": ends | {"stroke": [2 * cylinder.stroke, 3 * cylinder.stroke]}}
    (note,) = recommend.beyond(e, found, narrow)
    assert note == f"stroke = {stroke:.3g} mm: sampled was {2 * stroke:.3g} to {3 * stroke:.3g} mm"
    wide = inside | {"sizes": ends | {"stroke": [cylinder.stroke / 3, cylinder.stroke / 2]}}
    assert recommend.beyond(e, found, wide)[0].startswith("stroke = ")
    (note,) = recommend.beyond(e, found | {"thermal": 1e9}, inside)
    assert note.startswith(GROUPS["thermal"]) and "1e+09" in note
    leaky = e._replace(plant=e.plant._replace(valve=e.plant.valve._replace(leak=1e-9)))
    assert "valve" in recommend.beyond(leaky, found, inside)[0]
    loaded = e._replace(plant=e.plant._replace(cylinder=cylinder._replace(load=cylinder.load + 10)))
    assert "constant force" in recommend.beyond(loaded, found, inside)[0]
    helium = e._replace(plant=e.plant._replace(gas=e.plant.gas._replace(R=2077.0)))
    assert "gas" in recommend.beyond(helium, found, inside)[-1]


def test_nothing_but_numbers_in_json(known):
    e = PAPER.experiments["E01"]
    adiabatic = e._replace(plant=e.plant._replace(k_0=0.0))
    rows = json.loads(recommend.as_json([recommend.advice(adiabatic, known)]))
    assert rows[0]["groups"]["thermal"] is None and rows[0]["experiment"] == "E01"
    assert any("sampled" in note for note in rows[0]["outside"])


# The command


@pytest.fixture
def called(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["pneumo", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code or 0, *capsys.readouterr()

    return run


def test_command_says_model_reasons_and_worth(called, known):
    assert called("init", "my.yaml")[0] == 0
    code, out, _ = called("recommend", "my.yaml")
    assert code == 0 and "open (mine): take M" in out and "closed (mine): take M" in out
    assert "  since " in out and "held out" in out and "OUTSIDE what was sampled: valve" in out
    right = known["score"]["tree"]["right"][0]
    assert f"The tree is right in {100 * right:.0f} %" in out
    code, out, _ = called("recommend", "my.yaml", "--json")
    rows = json.loads(out)
    assert code == 0 and [row["experiment"] for row in rows] == ["open", "closed"]
    assert all(row["model"] in GOOD and set(row["groups"]) == set(GROUPS) for row in rows)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["recommend"], "Missing argument"),
        (["recommend", "none.yaml"], "none.yaml: cannot be read"),
        (["recommend", "."], ".: cannot be read"),
        (["recommend", "my.yaml", "--yaml"], "No such option"),
        (["recommend", "my.yaml", "wrong.yaml"], "cylinders.mine.bore_mm = -25: must be"),
    ],
)
def test_wrong_use_is_one_line(arguments, words, called, tmp_path):
    called("init", "my.yaml")
    (tmp_path / "wrong.yaml").write_text("cylinders: {mine: {bore_mm: -25}}")
    code, out, err = called(*arguments)
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and words in err


def test_a_damaged_tree_is_named(called, tmp_path, monkeypatch):
    called("init", "my.yaml")
    spoilt = tmp_path / "recommendation.json"
    spoilt.write_bytes(recommend.FILE.read_bytes().replace(b"M8", b"M9"))
    monkeypatch.setattr(recommend, "FILE", spoilt)
    code, out, err = called("recommend", "my.yaml")
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and "recommendation.json" in err
