"""Random cylinders: their sampling, dimensionless groups, runs, and the comparison of models on them."""

from math import pi

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_study import STUDY as PAPER
from synthetic_records import true_and_configured_plants
from workflow_scripts import script

from pneumo.evidence.random_cylinders import cylinder_runs as c
from pneumo.evidence.random_cylinders import dimensionless_groups as groups
from pneumo.evidence.random_cylinders import regimes as regime
from pneumo.evidence.random_cylinders.dimensionless_groups import KNOWN_GROUPS, known_groups
from pneumo.evidence.random_cylinders.direct_rule import direct_rule
from pneumo.physics.models import MODELS
from pneumo.publish.figures.panels import symbol
from pneumo.publish.figures.regimes_figure import regime_map
from pneumo.selection.cylinder_ranking import one_run
from pneumo.simulation.full_order import equilibrium, failure, record
from pneumo.statistics.intervals import fraction_interval, quotient_interval
from pneumo.statistics.model_pairs import REFINED_MODELS
from pneumo.storage.files import damaged, read

NUMBERS = range(60)


@pytest.mark.parametrize("number", NUMBERS)
def test_cylinders_are_of_the_catalogue_and_inside_what_was_written_down(number):
    opened, closed = c.random_experiments(number)
    assert opened.plant == closed.plant
    p, cylinder = opened.plant, opened.plant.cylinder
    bore, stroke = round(1e3 * cylinder.bore), round(1e3 * cylinder.stroke)
    assert bore in c.CATALOGUE_BORES and stroke in c.CATALOGUE_STROKES
    assert stroke <= c.LONGEST_STROKES.get(bore, 1000)
    assert equilibrium(p)[2] == p.conditions.P_0 == pytest.approx(0.807458 * p.conditions.P_s, rel=2e-6)
    rod = np.sqrt(4 / pi * (cylinder.A_A - cylinder.A_B))
    assert rod == pytest.approx(0, abs=1e-9) or rod == pytest.approx(1e-3 * c.RODS[bore])
    assert cylinder.load == pytest.approx(-(cylinder.A_A - cylinder.A_B) * 1e5, abs=1e-9)
    assert c.cylinder_sizes(p)["rod_share"][0] == pytest.approx((rod / cylinder.bore) ** 2, abs=1e-9)
    force = p.conditions.P_s * cylinder.A_A
    speed = groups.full_speed(p)
    inside = {
        "supply": (p.conditions.P_s, 5e5, 10e5),
        "dead": (cylinder.V_d_A / (cylinder.A_A * cylinder.stroke / 2), 0.05, 0.2),
        "speed": (speed, min(0.1, 12 * cylinder.stroke), min(3.2, 12 * cylinder.stroke)),
        "acceleration": (0.3 * force / cylinder.M, 5, 50),
        "viscous": (cylinder.k_f * speed / force, 0.05, 0.6),
        "coulomb": (cylinder.coulomb / force, 0, 0.05),
        "lambda_0": (c.cylinder_sizes(p)["lambda_0"][0], 1.3, 663),
        "command": (opened.excitation.amplitude / p.valve.u_max, 0.03, 1),
        "deviation": (closed.excitation.amplitude / cylinder.stroke, 0.03, 0.2),
        "full at": (p.valve.u_max / closed.drive.k_p / cylinder.stroke, 0.1, 1),
    }
    for name, (value, low, high) in inside.items():
        assert low * (1 - 1e-9) <= value <= high * (1 + 1e-9), name
    for e in (opened, closed):
        hold = e.excitation.every * e.h
        assert 0.02 - e.h <= hold <= 5 + e.h  # held for whole steps
        largest = p.valve.u_max if e.drive.closed_loop else e.excitation.amplitude
        assert e.h == pytest.approx(min(1e-3, c.emptying_time(p, largest) / 30))
        wanted = np.clip(max(10 * c.thermal_time_constant(p), 200 * hold), 20, 1000)
        assert e.steps == 3_000_000 or e.steps * e.h == pytest.approx(wanted, rel=0.05)  # hold is rounded


def test_a_number_means_the_same_cylinder_and_no_other_and_records_keep_theirs():
    assert c.random_experiments(7) == c.random_experiments(7)
    assert len({c.random_experiments(number)[0].plant for number in NUMBERS}) == len(NUMBERS)
    seeds = {e.excitation.seed for number in NUMBERS for e in c.random_experiments(number)}
    assert len(seeds) == 2 * len(NUMBERS)
    truth, configured = true_and_configured_plants(np.random.default_rng(10_000))
    q = truth.cylinder
    sizes = (0.029502095392723027, 0.11932500720956772, 5.586770430928518e-06, 5.031017489630016)
    assert (q.bore, q.stroke, q.V_d_A, q.M, q.k_f) == (*sizes, 161.1358386784385)
    drawn_values = (truth.k_0, truth.valve.k_xu, configured.valve.k_xu)
    assert drawn_values == (0.23457589501791445, 1.0717643896914715e-07, 1.2705634687217226e-07)


@pytest.mark.parametrize(
    ("number", "values"),
    [
        (0, (0.025, 321.94754756045245, 2986.5930189585583, 106.99899298102748, 8.005241437181015e-07)),
        (299, (0.125, 2.849012061793867, 10.590241929646945, 3.785203080924472, 8.387739165698576e-08)),
    ],
)
def test_cylinders_of_the_map_stay_the_same(number, values):
    e = c.random_experiments(number)[1]
    q = e.plant.cylinder
    assert (q.stroke, q.M, q.k_f, q.coulomb, e.plant.valve.k_xu) == values


@pytest.mark.parametrize("name", PAPER.experiments)
def test_the_papers_cylinders_lie_inside(name):
    p = PAPER.experiments[name].plant
    force, speed = p.conditions.P_s * p.cylinder.A_A, groups.full_speed(p)
    assert 0.1 < speed < 3.2 and speed / p.cylinder.stroke < 12
    assert 5 < 0.3 * force / p.cylinder.M < 50
    assert 0.05 < p.cylinder.k_f * speed / force < 0.6
    # The ends of lambda_0 are those of Table 4, with its digits.
    assert 1.3 * 0.995 < c.cylinder_sizes(p)["lambda_0"][0] < 663 * 1.005


# Exponents of metre, kilogram, second, kelvin and volt of every field that has a unit.
DIMENSIONS = {
    **dict.fromkeys(("bore", "stroke", "x_min", "x_max", "x_reverse"), (1, 0, 0, 0, 0)),
    **dict.fromkeys(("A_A", "A_B"), (2, 0, 0, 0, 0)),
    **dict.fromkeys(("P_s", "P_atm", "P_0"), (-1, 1, -2, 0, 0)),
    **dict.fromkeys(("T_in", "T_amb", "T_0"), (0, 0, 0, 1, 0)),
    **dict.fromkeys(("load", "coulomb"), (1, 1, -2, 0, 0)),
    **dict.fromkeys(("V_d_A", "V_d_B"), (3, 0, 0, 0, 0)),
    **{"M": (0, 1, 0, 0, 0), "k_f": (0, 1, -1, 0, 0), "h": (0, 0, 1, 0, 0)},
    **{"R": (2, 0, -2, -1, 0), "sonic_coefficient": (-1, 0, 1, 0.5, 0), "k_0": (2, 1, -3, -1, 0)},
    **{"k_xu": (2, 0, 0, 0, -1), "u_max": (0, 0, 0, 0, 1), "k_p": (-1, 0, 0, 0, 1)},
}


def in_units(value, units, dimensions):
    """The same experiment in other units: numbers are times the size of the SI unit in the new one."""
    if not hasattr(value, "_fields"):
        return value
    fields = value._asdict().items()
    inner = {name: in_units(field, units, dimensions) for name, field in fields if name not in dimensions}
    scaled = {
        name: field * np.prod(units ** dimensions[name]) for name, field in fields if name in dimensions
    }
    return value._replace(**inner, **scaled)


UNIT = st.floats(1e-3, 1e3)


@settings(max_examples=40)
@given(st.sampled_from(NUMBERS), st.sampled_from([0, 1]), st.tuples(UNIT, UNIT, UNIT, UNIT, UNIT))
def test_groups_have_no_unit(number, loop, units):
    e = c.random_experiments(number)[loop]
    e = e._replace(steps=20 * e.excitation.every)
    expected = known_groups(e)
    assert list(expected) == list(KNOWN_GROUPS)
    amplitude = (1, 0, 0, 0, 0) if e.drive.closed_loop else (0, 0, 0, 0, 1)
    changed = in_units(e, np.array(units), DIMENSIONS | {"amplitude": amplitude})
    assert known_groups(changed) == pytest.approx(expected, rel=1e-9)


def test_groups_and_time_between_reversals_by_hand():
    e = PAPER.experiments["E14"]  # D, closed loop, 2.5 W/K
    known, p = known_groups(e), e.plant
    assert known["breath"] * known["thermal"] == pytest.approx(known["exchange"])
    # of m c_v / k_0 times flow over m the air drops out; c_v = R / (gamma - 1) = 717.5 J/(kg K)
    assert known["exchange"] == pytest.approx(0.0404 * 7e5 * 1e-6 / 293**0.5 * 717.5 / p.k_0)
    air = 0.8077 * 7e5 * 1.1 * 1.571e-5 / (287 * 293)  # Table 2
    time_constant = air * 717.5 / p.k_0
    between = 0.05 * 2  # a new draw has the other sign every second time; 1200 draws tell that to a 35th
    assert known["thermal"] == pytest.approx(time_constant / between, rel=3 / 35)
    assert known["command"] == 1.0  # a jump of 24 mm at 1000 V/m saturates
    assert known["supply"] == 7 and known["closed"] == 1 and known["dead"] == pytest.approx(0.1, rel=1e-3)
    assert known["friction"] == pytest.approx(100 * groups.full_speed(p) / (0.8077 * 7e5 * pi / 4 * 0.02**2))
    opened = known_groups(PAPER.experiments["E13"])
    assert opened["command"] == pytest.approx(0.08) and opened["closed"] == 0
    t = np.arange(100_000) * 1e-3
    steps = 3 + np.resize(np.repeat([1.0, 0.0, -1.0, 0.0], 50), 10_000)
    draws = np.repeat(np.random.default_rng(0).normal(size=2000), 50)
    for series, expected, tolerance in (
        (np.sin(2 * pi * 2.5 * t + 0.1), 0.2, 0.01),
        (steps, 0.1, 0.02),
        (np.ones(500), 0.5, 1e-6),
        (draws, 0.1, 3 / 44),  # a new draw has the other sign every second time; 2000 tell that to a 44th
    ):
        assert groups.reversal_time(series, 1e-3) == pytest.approx(expected, rel=tolerance)


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(c, "MOST_STEPS", 400)


def test_a_cylinders_cells_are_those_of_repeated_runs(short):
    cells = c.cylinder_cells(11)
    for loop, e in zip(c.LOOPS, c.random_experiments(11), strict=True):
        assert e.steps == 400
        theirs = one_run(e, c.GRID_N, traced=False)["mse"].mean("chamber")
        np.testing.assert_array_equal(cells["mse"].sel(loop=loop), theirs)
        assert failure(record(e).states)[0] == 0
        for name, value in known_groups(e).items():
            assert cells[name].sel(loop=loop).item() == value
    assert (cells["run_status"] == 0).all()
    assert cells["duration"].values[0] == pytest.approx(400 * cells["step"].values[0])
    assert cells["bore"].attrs["units"] == "m"


def test_a_run_that_fails_is_a_status_and_does_not_count(short, monkeypatch):
    drawn = c.random_experiments

    def light(number):
        opened, closed = drawn(number)
        q = opened.plant.cylinder._replace(M=1e-9, coulomb=0.0)
        return opened._replace(plant=opened.plant._replace(cylinder=q)), closed

    monkeypatch.setattr(c, "random_experiments", light)
    cells = c.cylinder_cells(11)
    assert cells["run_status"].sel(loop="open") != 0 and cells["run_status"].sel(loop="closed") == 0
    assert cells["mse"].sel(loop="open").isnull().all() and cells["run_failure_time"].sel(loop="open") > 0
    runs = regime.with_answers(cells.expand_dims(cylinder=[11]), 1)
    assert runs["counts"].values.tolist() == [[0, 1]]
    opened, closed = runs["answer"].sel(loop=["open", "closed"]).values[0]
    assert opened == "" and closed in REFINED_MODELS


def invented(lowest, group=None):
    """Cells whose lowest errors are given by (cylinder, loop, model); n = 1.3 is best, 1.2 twice as bad."""
    lowest = np.asarray(lowest, dtype=float)
    cells = np.stack([2 * lowest, lowest], axis=-1)
    data = {"mse": (("cylinder", "loop", "model", "n"), cells)}
    data["run_status"] = (("cylinder", "loop"), np.zeros(lowest.shape[:2], dtype=np.int8))
    data["run_failure_time"] = (("cylinder", "loop"), np.full(lowest.shape[:2], np.nan))
    rng = np.random.default_rng(4)
    for name in KNOWN_GROUPS:
        data[name] = (("cylinder", "loop"), np.exp(rng.normal(size=lowest.shape[:2])))
    data["closed"] = (("cylinder", "loop"), np.tile([0.0, 1.0], (len(lowest), 1)))
    if group is not None:
        data["exchange"] = (("cylinder", "loop"), group)
    for name in c.cylinder_sizes(c.random_experiments(0)[0].plant):
        data[name] = (("cylinder",), np.exp(rng.normal(size=len(lowest))))
    coords = {"cylinder": np.arange(len(lowest)), "loop": list(c.LOOPS), "model": list(MODELS)}
    return xr.Dataset(data, coords | {"n": [1.2, 1.3]})


def errors(cylinders, sigma=0.3, seed=1):
    logs = np.random.default_rng(seed).normal(0, sigma, (cylinders, 2, len(MODELS)))
    return 1e6 * np.exp(logs)


def compared(lowest, compared_cylinders):
    return regime.compare_pairs(regime.with_answers(invented(lowest), compared_cylinders))


M = {name: i for i, name in enumerate(MODELS)}


def test_the_answer_is_the_cheapest_within_a_tenth_and_one_run_rules_the_mean_alone():
    lowest = np.full((4, 2, len(MODELS)), 9.0)
    lowest[..., M["M10"]] = 1.0
    lowest[1, 0, M["M6"]], lowest[2, 0, M["M6"]] = 1.09, 1.11
    lowest[3, 0, M["M1"]] = 0.5  # none of those that are asked about
    lowest[3, 1, M["M5"]] = np.nan
    runs = regime.with_answers(invented(lowest), 3)
    assert runs["answer"].sel(loop="open").values.tolist() == ["M10", "M6", "M10", "M10"]
    assert runs["counts"].values[3].tolist() == [1, 0] and runs["held_out"].values.tolist() == [0, 0, 0, 1]
    lowest = errors(20, sigma=0.01)
    lowest[..., M["M8"]] = 0.5 * lowest[..., M["M7"]]
    lowest[0, 0] *= 1e4
    lowest[0, 0, M["M8"]] = 2 * lowest[0, 0, M["M7"]]
    ratio = compared(lowest, 20)["ratio"].sel(pair="M8/M7", loop_of="both", bound="value")
    assert ratio.sel(criterion="mean") > 1.9
    assert ratio.sel(criterion="geometric") < 0.6 and ratio.sel(criterion="rank") < 1


def test_ratios_and_shares_by_hand():
    lowest = errors(30)
    lowest[..., M["M8"]] = 0.5 * lowest[..., M["M7"]]
    lowest[:10, :, M["M10"]] = 2 * lowest[:10, :, M["M8"]]
    lowest[10:, :, M["M10"]] = 0.5 * lowest[10:, :, M["M8"]]
    lowest[20:] *= 1e6  # held out
    lowest[20:, :, M["M8"]] *= 100
    comparison = compared(lowest, 20)
    m8 = comparison["ratio"].sel(pair="M8/M7", criterion=["mean", "geometric"])
    np.testing.assert_allclose(m8, 0.5)
    m10 = comparison["ratio"].sel(pair="M10/M8", criterion="geometric", loop_of="both")
    assert m10.sel(bound="value").item() == pytest.approx(1.0)  # ten times 2, ten times 1/2
    assert m10.sel(bound="low") < 0.9 and m10.sel(bound="high") > 1.1
    share = comparison["share"].sel(loop_of="closed")
    assert share.sel(statement="M8/M7 < 1", bound="value") == 1
    assert share.sel(statement="M10/M8 < 1").values == pytest.approx(fraction_interval(10, 20, "wilson"))
    assert (comparison["cylinders"] == 20).all()
    lowest = np.full((10, 2, len(MODELS)), 2.0)
    lowest[..., M["M9"]] = 1.0
    lowest[:6, 0, M["M6"]] = 1.05
    lowest[:3, 1, M["M6"]] = 1.05
    share = compared(lowest, 10)["share"].sel(statement=regime.ENOUGH, bound="value")
    assert share.values.tolist() == [0.6, 0.3, 0.3]


def test_thirds_show_where_a_refinement_pays():
    lowest, rng = errors(60, sigma=0.05), np.random.default_rng(2)
    exchange = np.exp(rng.normal(size=(60, 2)))
    pays = np.where(exchange > np.quantile(exchange, 2 / 3), 0.1, 1.5)
    lowest[..., M["M8"]] = pays * lowest[..., M["M7"]]
    runs = regime.with_answers(invented(lowest, exchange), 60)
    by_third = regime.compare_by_thirds(runs, ["exchange"]).sel(group="exchange", pair="M8/M7")
    assert by_third["third_ratio"].sel(bound="value").values == pytest.approx([1.5, 1.5, 0.1])
    assert by_third["third_share"].sel(bound="value").values == pytest.approx([0, 0, 1])
    assert by_third["third_to"].values[:2] == pytest.approx(by_third["third_from"].values[1:])


def test_the_direct_rule_finds_a_threshold_and_is_judged_on_cylinders_it_has_not_seen():
    lowest, thermal = errors(400, sigma=0.02), np.exp(np.random.default_rng(7).normal(size=(400, 2)))
    lowest[..., M["M6"]] *= np.where(thermal < 0.7, 0.5, 2.0)
    lowest[..., M["M8"]] *= np.where(thermal < 0.7, 1.0, 0.8)
    cells = invented(lowest)
    cells["thermal"] = (("cylinder", "loop"), thermal)
    rule = direct_rule(regime.with_answers(cells, 200))
    # Hundred percentiles of 400 runs: some four runs lie between two of them.
    assert rule["rule_threshold"].item() == pytest.approx(0.7, rel=0.03)
    assert rule["rule_model"].values.tolist() == ["M6", "M8"]
    below = (thermal[200:] < 0.7).mean()
    quotient = rule["rule_quotient"].sel(bound="value").item()
    assert quotient == pytest.approx(0.5**below, rel=0.02)  # the spread of the errors
    low, high = rule["rule_quotient"].sel(bound=["low", "high"]).values
    assert low < quotient < high < 0.95
    # Where the group says nothing, neither does the rule.
    rule = direct_rule(regime.with_answers(invented(errors(400)), 200))
    assert rule["rule_quotient"].sel(bound="high") > 0.95


def test_the_direct_rule_does_not_see_the_half_held_out():
    lowest, thermal = errors(400, sigma=0.02), np.exp(np.random.default_rng(7).normal(size=(400, 2)))
    below = thermal[:200] < 0.7
    lowest[:200, :, M["M6"]] *= np.where(below, 0.5, 2.0)
    lowest[:200, :, M["M8"]] *= np.where(below, 1.0, 0.8)
    lowest[200:, :, M["M10"]] *= 0.1  # another rule would be better there
    cells = invented(lowest)
    cells["thermal"] = (("cylinder", "loop"), thermal)
    rule = direct_rule(regime.with_answers(cells, 200))
    assert rule["rule_model"].values.tolist() == ["M6", "M8"]
    assert rule["rule_threshold"].item() == pytest.approx(0.7, rel=0.03)
    # Nor is it judged on the half that it was fitted to.
    held, names = lowest[200:], [M["M6"], M["M8"]]
    chosen = np.where(thermal[200:] < rule["rule_threshold"].item(), *(held[..., name] for name in names))
    expected = np.exp(np.log(chosen / held[..., M["M10"]]).mean())
    assert rule["rule_error"].sel(choice="rule", bound="value").item() == pytest.approx(expected)


def test_a_tie_is_no_gain_and_a_run_on_an_edge_is_in_both_thirds():
    lowest = errors(31)
    lowest[..., M["M8"]] = lowest[..., M["M7"]]
    fraction = compared(lowest, 31)["share"].sel(statement="M8/M7 < 1", bound="value")
    assert (fraction == 0).all()
    group = np.arange(62.0).reshape(31, 2) + 1.0
    lowest[..., M["M8"]] = np.where(group == 62, 1e-6, 1.0) * lowest[..., M["M7"]]
    runs = regime.with_answers(invented(lowest, group), 31)
    third = regime.compare_by_thirds(runs, ["exchange"]).sel(group="exchange", pair="M8/M7")
    assert third["third_share"].sel(bound="value", third=["lowest", "middle"]).values.tolist() == [0, 0]
    assert third["third_share"].sel(bound="value", third="highest") > 0  # the run at its upper end
    assert third["third_from"].values[0] == 1 and third["third_to"].values[-1] == 62


def test_intervals_are_wilsons_and_those_of_the_standard_error():
    z, p, n = 1.959963985, 0.3, 40
    centre, half = p + z**2 / 2 / n, z * (p * (1 - p) / n + z**2 / 4 / n**2) ** 0.5
    expected = (p, (centre - half) / (1 + z**2 / n), (centre + half) / (1 + z**2 / n))
    assert fraction_interval(12, 40, "wilson") == pytest.approx(expected)
    assert np.isnan(fraction_interval(0, 0, "wilson")).all()
    values = np.random.default_rng(5).normal(1.0, 0.4, 400)
    value, low, high = quotient_interval(values, np.ones(400))
    # 1.96 standard errors of 0.02 either way; 2000 resamples place an end to a tenth of that
    assert value == pytest.approx(values.mean())
    assert value - low == pytest.approx(0.0392, rel=0.15) and high - value == pytest.approx(0.0392, rel=0.15)
    assert np.isnan(quotient_interval(np.zeros(3), np.zeros(3))).all()


@pytest.mark.slow
def test_workflow_scripts_go_from_cylinders_to_comparisons_and_map(tmp_path, monkeypatch):
    monkeypatch.setattr(c, "MOST_STEPS", 100)
    monkeypatch.setattr(c, "HOLD", (0.005, 0.01))
    blocks = [tmp_path / "cylinders" / f"{first:04}.nc" for first in (0, 18)]
    for first, block in zip((0, 18), blocks, strict=True):
        script("cylinders_block")(block, list(range(first, first + 18)), 2, "")
    cells = tmp_path / "cylinders.nc"
    script("cylinders")(blocks, 24, cells, "")
    draw = "pneumo.publish.figures.regimes_figure.regime_map"
    script("figure")(cells, draw, [tmp_path / "regimes.svg"])
    stored = read(cells)
    assert stored["cylinder"].values.tolist() == list(range(36))
    assert stored["held_out"].values.tolist() == [0] * 24 + [1] * 12
    assert (stored["counts"] == 1).all() and (stored["cylinders"] == 24).all()
    assert (tmp_path / "regimes.png").exists()
    exchange = [known_groups(e)["exchange"] for e in c.random_experiments(7)]
    # Kept to four digits.
    np.testing.assert_allclose(stored["exchange"].values[7], exchange, rtol=1e-4)
    assert stored["rule_model"].sizes["side"] == 2
    assert damaged(tmp_path) == []


@pytest.mark.slow
def test_map_has_the_mean_ratio_of_each_part_and_marks_where_it_is_not_one():
    lowest, drawn = errors(900, sigma=0.05), np.random.default_rng(3).lognormal(size=(2, 900, 2))
    lowest[..., M["M8"]] *= np.where(drawn[1] > 1, 0.5, 1.0) * lowest[..., M["M7"]] / lowest[..., M["M8"]]
    cells = invented(lowest)
    for name, values in zip(regime.MAP_GROUPS, drawn, strict=True):
        cells[name] = (("cylinder", "loop"), values)
    runs = regime.regime_statistics(regime.with_answers(cells, 800))
    gains = runs["map_ratio"].sel(map_ratio_of="M8/M7", loop="open")
    many = gains.sel(bound="value").notnull().values
    assert many.sum() > 10
    above = runs["exchange_edge"].values[:-1] > 1
    below = runs["exchange_edge"].values[1:] < 1
    value = gains.sel(bound="value").values
    assert value[:, above][many[:, above]] == pytest.approx(0.5)
    assert value[:, below][many[:, below]] == pytest.approx(1.0)
    # By hand, in the part with the most runs of those that are compared.
    inside = np.ones(800, dtype=bool)
    place = np.argwhere(many)[0]
    for name, i in zip(regime.MAP_GROUPS, place, strict=True):
        edges, group = runs[f"{name}_edge"].values, drawn[regime.MAP_GROUPS.index(name), :800, 0]
        inside &= (group >= edges[i]) & (group <= edges[i + 1])
    best = lowest[:800, 0][:, [M[name] for name in REFINED_MODELS]].min(axis=1)
    logs = np.log(lowest[:800, 0, M["M6"]] / best)
    mean = runs["map_ratio"].sel(map_ratio_of="M6/best", loop="open", bound="value").values[*place]
    assert mean == pytest.approx(np.exp(logs[inside].mean()))
    panel = next(ax for ax in regime_map(runs).axes if symbol("M8") in ax.get_title())
    drawn = np.asarray(panel.collections[0].get_array()).reshape(value.T.shape)
    np.testing.assert_allclose(drawn, np.log10(value).T)
    dots = len(panel.lines[0].get_xdata())
    assert many[:, above].sum() <= dots < many.sum()
    # Everything is in one dataset.
    everything = regime.regime_statistics(regime.with_answers(invented(errors(30)), 20))
    assert everything["ratio"].sizes["criterion"] == 3 and "mse" not in everything
    assert all("long_name" in v.attrs for name, v in everything.data_vars.items() if name.startswith("third"))
