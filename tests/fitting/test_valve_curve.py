"""A valve whose flow is not proportional to its command: found, named, written as the configured curve."""

import numpy as np
import pandas as pd
import pytest

import pneumo
from benchmarks.bench_rig import U_MAX, bench_record, purpose_rig
from benchmarks.fit_bench import believed_plant
from pneumo.configuration.parameters import study
from pneumo.errors import InputError
from pneumo.fitting.valve_signal import KNOTS, valve_curve
from pneumo.quantities.table import CURVE
from pneumo.selection.plants import configured_plant

RIG = purpose_rig()._replace(bend=-0.15)  # a spool that opens late; the simulator shares no code with the fit
UNITS = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_Pa", "P_B": "P_B_Pa"}


def opening(part):
    """Opening of the rig's valve over that at u_max."""
    return part + 4 * RIG.bend * part * (1 - part)


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """A record, its fits without and with the curve if the valve is taken as linear, and the usual fit."""
    folder = tmp_path_factory.mktemp("curve")
    believed_plant(RIG, folder)
    (folder / "linear.yaml").write_text(
        "cylinders: {mine: {valve: {linearity_percent: 0}}}", encoding="utf-8"
    )
    usual = pneumo.load(folder / "cylinder.yaml")
    linear = pneumo.load(folder / "cylinder.yaml", folder / "linear.yaml")
    columns = bench_record(RIG, np.random.default_rng(3), 4.0)
    record = pd.DataFrame({key: columns[name] for name, key in UNITS.items()})
    choices = (), ("valve_curve",)
    taken_as_linear = [pneumo.fit(record, linear, models=["M1"], also=also) for also in choices]
    return record, taken_as_linear, pneumo.fit(record, usual, models=["M1"])


@pytest.mark.slow
@pytest.mark.xdist_group("valve curve")
def test_the_curve_is_named_and_found_within_its_intervals_and_predicts_what_is_held_out(fits, tmp_path):
    record, (straight, curved), _ = fits
    assert "(--also valve_curve fits it)" in " ".join(straight.warnings)
    assert not curved.warnings
    errors = [fit.errors.loc["full", "rms_held_out"].max() for fit in (straight, curved)]
    assert errors[1] < 0.5 * errors[0]
    found, largest = curved.result.estimates("full"), np.abs(curved.result.fitted_commands).max() / U_MAX
    truth = np.diff(np.log(opening(largest * np.array(KNOTS[1:]))))
    for name, ratio in zip(("curve_eighth", "curve_quarter", "curve_half"), np.exp(-truth), strict=True):
        # 95 % intervals, of which some miss: twice their half-width.
        assert abs(found[name].value - ratio) < found[name].high - found[name].low, name
        assert found[name].high - found[name].low < 0.2 * ratio, name
    assert found["k_0"].low < RIG.k_0 < found["k_0"].high
    curved.save(tmp_path / "fitted")
    configuration = pneumo.load(tmp_path / "fitted/fitted.yaml")
    curve = configuration.cylinders["mine"].valve.curve
    assert curve.u_V[-1] == U_MAX and configured_plant(study(configuration)).valve.paths.knots
    inside = np.array(curve.u_V) <= largest * U_MAX * (1 + 1e-9)
    C = 1e8 * RIG.C * opening(np.array(curve.u_V) / U_MAX)
    np.testing.assert_allclose(np.array(curve.C_dm3_per_sbar)[inside], C[inside], rtol=0.05, atol=1e-3)
    with pytest.raises(InputError, match="the configuration has a curve"):
        pneumo.fit(record, configuration, also=["valve_curve"])


@pytest.mark.slow
@pytest.mark.xdist_group("valve curve")
def test_a_fit_finds_by_how_much_a_valve_is_not_linear(fits):
    usual = fits[2]
    found = usual.result.estimates("full")
    assert usual.errors.loc["full", "rms_held_out"].max() < 1100  # Pa: the sensors' noise is 1000
    assert found["k_0"].low < RIG.k_0 < found["k_0"].high
    assert not usual.warnings
    reached = usual.result.reached / U_MAX  # the record shows C up to there
    C = found["k_xu"].scaled(usual.result.C_per_k_xu)
    assert C.low < 1e8 * RIG.C * opening(reached) / reached < C.high


def test_a_curve_rises_through_its_knots_and_a_proportional_one_is_a_line():
    parts, line = np.linspace(0.0, 2.0, 50), dict.fromkeys(CURVE, 0.5)
    np.testing.assert_allclose(valve_curve(line, parts), parts, atol=1e-12)
    bent = {"curve_eighth": 0.1, "curve_quarter": 0.9, "curve_half": 0.3}
    assert np.all(np.diff(valve_curve(bent, parts)) > 0)
    np.testing.assert_allclose(valve_curve(bent, np.array(KNOTS)), [0.0, 0.027, 0.27, 0.3, 1.0])
