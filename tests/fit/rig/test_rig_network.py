"""A rig as a network: volumes, areas, walls and first states by hand, for rigs with and without each part."""

import numpy as np
import pytest
from test_rig_c import CHAMBER, EVERYTHING, SHUT, VESSEL, H, driven, left_alone, network_of_run

from pneumo.fit.rig.rig_file import rig
from pneumo.fit.rig.rig_record import Points
from pneumo.fit.rig.rig_replay import ADIABATIC, FULL, RIG_MODELS, errors, mean_opening, rms
from pneumo.physics.valve import choked_flow

TO_ROOM, FROM_TANK = (101325.0, 293.15), (6e5, 293.15)


def of(content, model="full order", run=None):
    known = rig(content, "test")
    values = {name: low for name, (low, _) in known.ends.items()}
    return network_of_run(known, model, values, driven() if run is None else run)


def area_of(C):
    """Area of a sonic conductance, m^2: choked flow is C P rho_0 (T_0 / T)^(1/2) by ISO 6358."""
    return C * 1.185 * 293.15**0.5 / choked_flow(1.0, 1.0, 1.0, rig(EVERYTHING, "test").gas)


def test_volumes_and_wall_areas_are_those_of_bore_rod_and_travel():
    run, found = driven(), of(EVERYTHING)
    swept = (12e-6 + np.pi / 4 * (32e-3**2 - 3e-3**2) * run.x, 20e-6)
    swept = swept[0], swept[1] + np.pi / 4 * (32e-3**2 - 12e-3**2) * (run.travel - run.x)
    constant = [6e-6, 6e-6, 5e-6, 5e-6, 1e-3]  # hoses, silencers, supply
    for volume, expected in zip(found.volumes, [*swept, *constant], strict=True):
        np.testing.assert_allclose(volume, expected * np.ones_like(run.x), rtol=1e-12)
    for ratio, volume in zip(found.area_ratios[:2], swept, strict=True):
        wall = np.pi / 2 * 32e-3**2 + 4 * volume / 32e-3  # of a plain cylinder with this volume
        np.testing.assert_allclose(ratio, wall / wall[0], rtol=1e-12)
    np.testing.assert_array_equal(found.area_ratios[2:], np.ones((5, len(run.x))))
    assert (of(VESSEL, run=left_alone()).volumes == 10e-3).all()


def test_areas_are_those_of_each_conductance_and_of_the_valves_opening():
    run, found = driven(), of(EVERYTHING | {"valve_C_in_B_dm3_per_sbar": 0.7})
    # 2 ms after its edge it opens in 5 ms, 1 ms before the other it closes in 8 ms.
    opened = mean_opening(run.t, 0.022, 5e-3) - mean_opening(run.t, 0.079, 8e-3)
    in_A, in_B = opened, 1 - opened
    expected = [0.9, 1.2 * in_A, 1.0 * (1 - in_A), 0.9, 0.7 * in_B, 1.0 * (1 - in_B), 1.5, 1.5, 0.3]
    for area, C in zip(found.areas, expected, strict=True):
        np.testing.assert_allclose(area, area_of(1e-8 * C) * np.ones_like(run.t), rtol=1e-9, atol=1e-18)
    (opening,) = of(VESSEL | {"C_d": 0.8}, run=left_alone()).areas
    np.testing.assert_allclose(opening, 0.8 * np.pi / 4 * 3e-3**2, rtol=1e-12)


def averaged(t, begin, lasts):
    """Mean of an opening about each sample, by 4,000 points, of weights that fall on a line over a step."""
    beside = (np.arange(4000) + 0.5) / 2000 - 1
    weights = (1 - np.abs(beside)) / 2000
    instants = t[:, None] + (t[1] - t[0]) * beside
    return np.clip((instants - begin) / lasts, 0, 1) @ weights


@pytest.mark.parametrize("begin", [0.0214, 0.022, 0.0309])
@pytest.mark.parametrize("lasts", [1e-5, 4e-4, 1e-3, 8e-3])
def test_an_opening_is_the_mean_over_the_steps_beside_a_sample(begin, lasts):
    t = H * np.arange(60)
    opening = mean_opening(t, begin, lasts)
    # Half a point's step, where a valve opens at once.
    np.testing.assert_allclose(opening, averaged(t, begin, lasts), atol=3e-4)
    assert H * opening.sum() == pytest.approx(t[-1] + H / 2 - begin - lasts / 2, rel=1e-9)
    # Hours later it is as exact.
    np.testing.assert_allclose(mean_opening(t + 4096, begin + 4096, lasts), opening, atol=1e-7)


def test_a_search_sees_when_a_valve_opens_within_one_sample():
    t = H * np.arange(60)
    begins = 0.02 + H * np.linspace(0.0, 2.0, 41)
    openings = np.array([mean_opening(t, begin, 2e-4) for begin in begins])
    moved = np.abs(np.diff(openings, axis=0)).max(axis=1)
    # A twentieth of a sample moves the fraction by a fortieth at least, and by a twentieth at most.
    assert (moved > 0.02).all() and (moved <= 0.0501).all()


def test_a_valve_that_would_close_before_it_opens_stays_shut():
    areas = of(CHAMBER, run=driven()._replace(on=0.08, off=0.02, P_B=None)).areas
    assert (areas[0] == 0.0).all() and (areas[1] == areas[1].max()).all()


def test_critical_ratios_and_the_check_valve_are_those_of_each_part():
    links = of(EVERYTHING).links
    assert [link.b for link in links[:8]] == [0.3, 0.4, 0.4, 0.3, 0.4, 0.4, 0.2, 0.2]
    assert np.isnan(links[8].b)  # eq (1)
    assert [link.back for link in links] == [0.5, 1.0, 1.0, 0.5, *[1.0] * 5]


def test_nodes_begin_at_rest_with_the_walls_of_their_part():
    chambers, hoses, silencers, supply = (of(EVERYTHING).nodes[part] for part in (
        slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 7)
    ))  # fmt: skip
    assert [(node.P, node.T) for node in chambers + hoses] == [TO_ROOM, FROM_TANK] * 2
    assert [(node.P, node.T) for node in silencers + supply] == [TO_ROOM, TO_ROOM, FROM_TANK]
    for node in chambers + hoses + silencers + supply:
        assert (node.P_0, node.T_0, node.T_wall) == (node.P, node.T, 293.15)
    walls = [(node.k_0, node.k_store, node.c_store, node.k_back) for node in chambers]
    assert walls == [(0.5, 0.4, 2.0, 0.1), (0.8, 0.4, 2.0, 0.1)]
    assert [(node.k_0, node.k_store) for node in hoses] == [(0.05, 0.0)] * 2
    assert [(node.k_0, node.k_store) for node in silencers + supply] == [(0.0, 0.0)] * 3
    warm = of(SHUT, run=left_alone()).nodes[0]
    assert (warm.P, warm.T, warm.T_wall, warm.k_0) == (8e5, 350.0, 293.15, 3.0)


@pytest.mark.parametrize("model", ["M8", *FULL])
def test_every_model_but_the_adiabatic_has_walls_and_a_supply_is_of_full_order(model):
    nodes = of(EVERYTHING, model).nodes
    cold = model == ADIABATIC
    assert [node.k_0 == 0 for node in nodes[:4]] == [cold] * 4
    assert [bool(node.lane.full) for node in nodes] == [model != "M8"] * 6 + [True]
    assert nodes[6].lane == of(EVERYTHING).nodes[6].lane


@pytest.mark.parametrize(
    ("model", "exponents"), [("full order", (0.0, 0.0)), ("full order, eq (7)", (1.0, 0.5))]
)
def test_a_wall_is_constant_or_follows_area_and_root_of_P_T(model, exponents):
    lane = of(EVERYTHING, model).nodes[0].lane
    assert (lane.e_A, lane.e_PT) == exponents and model in RIG_MODELS


@pytest.mark.parametrize(
    ("content", "sensor"),
    [
        (EVERYTHING, 2),
        (EVERYTHING | {"sensor": "chamber"}, 0),
        (CHAMBER, 0),
        (CHAMBER | {"dead_volume_B_mL": 20}, 0),
    ],
)
def test_a_pressure_is_measured_at_the_valve_or_in_the_chamber(content, sensor):
    assert of(content).sensor == sensor


def test_errors_are_replayed_minus_measured_at_the_measured_times():
    replayed = Points(H * np.arange(3), np.array([1.0, 3.0, 7.0]))
    measured = Points(H * np.array([0.5, 1.75]), np.array([1.0, 9.0]))
    found = errors(replayed, measured)
    np.testing.assert_allclose(found, [1.0, -3.0], rtol=1e-12)
    assert rms(found) == pytest.approx(5**0.5, rel=1e-12)
