"""The public filter: pressures from a position, k_0 as a state, gaps in the readings, input refused."""

import numpy as np
import pytest
from paper_study import STUDY

import pneumo

EXPERIMENT = STUDY.experiments["E10"]
PLANT, H = EXPERIMENT.plant, EXPERIMENT.h
SECONDS = 6.0


@pytest.fixture(scope="module")
def run():
    rng = np.random.default_rng(32)
    reference = np.repeat(0.015 * rng.standard_normal(round(SECONDS / 0.05)), 50)
    controlled = pneumo.simulate(PLANT, H, reference=reference, k_p=EXPERIMENT.drive.k_p)
    return pneumo.simulate(PLANT, H, command=controlled.u)  # held from sample to sample, as a drive does


def rms(estimate, run, since=1.0):
    """RMS error of both pressures after the first second, Pa."""
    late = estimate.t >= since
    errors = [estimate.P_A - run.P_A, estimate.P_B - run.P_B]
    return float(np.sqrt(np.mean(np.square(errors)[:, late])))


def test_the_full_order_finds_pressures_temperatures_and_k_0(run):
    known = pneumo.ekf("full", None, PLANT, H, u=run.u, x=run.x)
    assert rms(known, run) < 1e3  # Pa: 0.2 % of the pressure, by the true equations from the position alone
    late = known.t >= 1.0
    assert np.abs(known.T_A - run.T_A)[late].max() < 3.0  # K, of swings of 40: less than a tenth
    assert (known.k_0 == PLANT.k_0).all() and (known.deviation[:, 6] == 0).all()

    halved = PLANT._replace(k_0=PLANT.k_0 / 2)
    wrong = pneumo.ekf("full", None, halved, H, u=run.u, x=run.x)
    learnt = pneumo.ekf("full", None, halved, H, u=run.u, x=run.x, estimate_k_0=True)
    assert rms(learnt, run, 4.0) < rms(wrong, run, 4.0)
    assert 0.75 < learnt.k_0[-1] / PLANT.k_0 < 1.33  # from a half: most of the way in six seconds
    assert learnt.deviation[-1, 6] < 0.3 * learnt.deviation[0, 6]  # clearly better known than at first
    for configured, end in ((PLANT.k_0 / 30, 10.0), (100 * PLANT.k_0, 0.1)):  # within a factor of ten
        plant = PLANT._replace(k_0=configured)
        kept = pneumo.ekf("full", None, plant, H, u=run.u, x=run.x, estimate_k_0=True)
        assert kept.k_0[-1] == pytest.approx(end * configured)


def test_a_reduced_model_has_no_temperature_and_a_measured_pressure_helps(run):
    none = pneumo.ekf("M8", 1.35, PLANT, H, u=run.u, x=run.x)
    both = pneumo.ekf("M8", 1.35, PLANT, H, u=run.u, x=run.x, P_A=run.P_A, P_B=run.P_B)
    assert np.isnan(none.T_A).all() and (none.deviation[:, 4:] == 0).all()
    assert rms(both, run) < 0.5 * rms(none, run)  # sensors of both pressures must more than halve it
    assert (both.deviation[-1, 2:4] < none.deviation[-1, 2:4]).all()


def test_samples_that_are_missing_are_bridged(run):
    x, P_A = run.x.copy(), run.P_A.copy()
    x[1000:1010] = P_A[::2] = np.nan
    gaps = pneumo.ekf("M8", 1.35, PLANT, H, u=run.u, x=x, P_A=P_A)
    whole = pneumo.ekf("M8", 1.35, PLANT, H, u=run.u, x=run.x, P_A=run.P_A)
    assert np.isfinite(gaps.P_A).all()
    assert gaps.deviation[1009, 0] > 3 * whole.deviation[1009, 0]  # ten samples without a reading
    assert rms(gaps, run) == pytest.approx(rms(whole, run), rel=0.5)


@pytest.mark.parametrize(
    "change, told",
    [
        ({"n": None}, "needs a polytropic index"),
        ({"h": 0.0}, "h = 0: must be a finite number, greater than 0"),
        ({"x": [0.0, 0.0]}, "x: shape"),
        ({"x": np.full(3, np.nan)}, "first sample"),
        ({"u": [0.0, np.nan, 0.0]}, "u: must be finite"),
        ({"first": (1e5, -1.0)}, "first = "),
        ({"pressure_noise": -1.0}, "pressure_noise = -1"),
        ({"model": "M6", "estimate_k_0": True}, "estimate_k_0"),
        ({"plant": PLANT._replace(k_0=0.0), "estimate_k_0": True}, "estimate_k_0"),
        ({"model": "full"}, "n = 1.35: the full order has no n"),
    ],
)
def test_input_that_cannot_be_right_is_refused_by_name(change, told):
    given = {"model": "M8", "n": 1.35, "plant": PLANT, "h": H, "u": np.zeros(3), "x": np.zeros(3)} | change
    with pytest.raises(pneumo.InputError, match=told):
        pneumo.ekf(given.pop("model"), given.pop("n"), given.pop("plant"), given.pop("h"), **given)
