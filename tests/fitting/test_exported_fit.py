"""Exported C has what a fit finds: valve, dead volumes, wall and start, on a rig with a slow valve."""

import numpy as np
import pandas as pd
import pytest
import yaml
from exported_c import C_COMPILER, CompiledModel

import pneumo
from benchmarks.bench_rig import U_MAX, bench_record, purpose_rig
from pneumo.configuration.parameters import configured_dynamics, load, study
from pneumo.fitting.stage_signals import stage_signals
from pneumo.physics.valve_dynamics import ValveDynamics
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

RIG = purpose_rig()._replace(lag=4e-3, dead_time=5e-3, null=0.2)
WITHIN = 1.1  # times the fit's own error on the part held out; without the valve's dynamics it is a hundred


@pytest.fixture(scope="module")
def fit():
    """Full order fitted to a record of a rig that shares no code with pneumo."""
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["supply"] |= {"P_s_Pa": RIG.P_s, "P_0_per_P_s": RIG.P_0 / RIG.P_s}
    valve = {"C_dm3_per_sbar": 1e8 * RIG.C, "b": RIG.b}
    sizes = {"bore_mm": 1e3 * RIG.bore, "stroke_mm": 1e3 * RIG.stroke, "rod_mm": 1e3 * RIG.rod}
    content["cylinders"]["mine"] |= sizes | {"valve": valve, "u_max_V": U_MAX}
    columns = bench_record(RIG, np.random.default_rng(3), 5.0)
    units = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_Pa", "P_B": "P_B_Pa"}
    record = pd.DataFrame({key: columns[name] for name, key in units.items()})
    from pneumo.configuration.schema import Configuration

    return pneumo.fit(record, Configuration.model_validate(content), models=["M1"])


def held_out_error(fit, plant, dynamics, folder):
    """Root mean square error of exported C, Pa, that runs from the fitted start to the end of the record."""
    m, found = fit.measurement, fit.estimates.loc["full", "value"]
    folder.mkdir()
    exported = CompiledModel("full", None, plant, folder, dynamics=dynamics)
    motion = stage_signals(m, plant).motion
    xv = np.append(motion[:, 0], motion[-1:, -1], axis=0).tolist()
    late = round(dynamics.dead_time / m.period)
    u = np.concatenate([np.full(late, m.u[0]), m.u])[: len(m.u)].tolist()
    state = [found[name] for name in ("start_A", "start_T_A", "start_B", "start_T_B")]
    state = [u[0], *state] if dynamics.lag else state
    pressures = [[state[-4], state[-2]]]
    for k in range(len(u) - 1):
        failed, state = exported.step([u[k], *xv[k]], [u[k], *xv[k + 1]], m.period, state)
        assert not failed
        pressures.append([state[-4], state[-2]])
    held_out = m.t > fit.result.held_out_from
    return np.sqrt(np.mean((m.P - np.transpose(pressures))[:, held_out] ** 2))


@C_COMPILER
@pytest.mark.slow
def test_exported_c_follows_the_part_held_out_as_the_fit_does(fit, tmp_path):
    fit.save(tmp_path / "fitted")
    configuration = load(tmp_path / "fitted/fitted.yaml")
    plant = configured_plant(study(configuration))
    dynamics = configured_dynamics(configuration, "mine")
    assert dynamics == pytest.approx((RIG.lag, RIG.dead_time, RIG.null, 0.0), rel=0.05)
    own = np.sqrt(np.mean(fit.errors.loc["full", "rms_held_out"] ** 2))
    assert held_out_error(fit, plant, dynamics, tmp_path / "late") < WITHIN * own
    assert held_out_error(fit, plant, ValveDynamics(), tmp_path / "ideal") > 10 * own
