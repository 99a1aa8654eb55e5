"""Exported observers, in C, against `pneumo.ekf` sample by sample."""

from functools import cache

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, CompiledObserver
from plain_rates import OWN

import pneumo
from pneumo.equations.named_model import FULL_ORDER
from pneumo.equations.system import system
from pneumo.errors import InputError
from pneumo.export import exported
from pneumo.export.observer_noise import READINGS, observer_noise

N, H = 1.35, 1e-3
pytestmark = pytest.mark.xdist_group("observer")


@cache
def readings(plant, count):
    """Command and readings of a run: x in steps of 10 um, pressures with noise, some of each missing."""
    rng = np.random.default_rng(38)
    command = np.repeat(plant.valve.u_max * rng.uniform(-0.2, 0.2, count // 50 + 1), 50)[:count]
    run = pneumo.simulate(plant, H, command=command)
    x = np.round(run.x / 1e-5) * 1e-5
    P = np.column_stack([run.P_A, run.P_B]) + 1e3 * rng.standard_normal((count, 2))
    x[30:40] = P[50:55, 0] = np.nan
    return command, np.column_stack([x, P])


def expected(model, plant, sensors, count):
    """Estimates and variances in Python, by the exported states."""
    u, read = readings(plant, count)
    chosen, pressures = system(model, N, plant, piston=True), len(READINGS[sensors]) - 1
    noise = observer_noise(chosen, sensors)
    seen = pneumo.ekf(
        model,
        None if model == FULL_ORDER else N,
        plant,
        H,
        u=u,
        x=read[:, 0],
        P_A=read[:, 1] if pressures > 0 else None,
        P_B=read[:, 2] if pressures > 1 else None,
        force_noise=noise.force,
        pressure_noise=noise.pressure,
        x_deviation=noise.x_deviation,
        pressure_deviation=noise.pressure_deviation,
    )
    deviation = dict(zip(("x", "v", "P_A", "P_B", "T_A", "T_B"), seen.deviation.T, strict=False))
    estimates = np.column_stack([getattr(seen, name) for name in chosen.states])
    return estimates, np.column_stack([deviation[name] ** 2 for name in chosen.states])


def farthest(estimates, variances, model, plant, sensors):
    """Largest differences from Python: of an estimate over the state's scale, and relative of a variance."""
    right, right_variances = expected(model, plant, sensors, len(estimates))
    size = system(model, N, plant, piston=True).scale
    return np.abs((estimates - right) / size).max(), np.abs(variances / right_variances - 1).max()


FORMS = [
    (model, sensors, precision)
    for model in ("M1", "M8", OWN, FULL_ORDER)
    for sensors in READINGS
    for precision in ("double", "float")
]
BRIEF = [("M8", "both", "double"), ("M8", "one", "float"), (FULL_ORDER, "none", "double")]


@C_COMPILER
@pytest.mark.parametrize(("model", "sensors", "precision"), in_brief(FORMS, BRIEF))
def test_c_estimates_as_the_filter_in_python(model, sensors, precision, plant, tmp_path):
    c, (u, read) = CompiledObserver(model, N, plant, tmp_path, sensors, precision), readings(plant, 1000)
    c.start(read[0, 0], [plant.conditions.P_0] * 2)
    estimates = []
    for command, row in zip(u, read[:, : 1 + len(READINGS[sensors]) - 1].tolist(), strict=True):
        estimates.append(c.correct(row))
        c.predict(command, H)
    states, variances = (np.array(each) for each in zip(*estimates, strict=True))
    off = farthest(states, variances, model, plant, sensors)
    print(f"{c.system.name}, {sensors}, {precision}: {off[0]:.1e}, variances {off[1]:.1e}")
    # Derivatives are differences over a thousandth of a state: a thousand roundings of 1e-16, or of 6e-8.
    assert max(off) < (1e-10 if precision == "double" else 5e-3)


@C_COMPILER
def test_both_observers_know_a_return_spring(plant, tmp_path):
    sprung = plant._replace(cylinder=plant.cylinder._replace(spring=300.0))
    test_c_estimates_as_the_filter_in_python("M8", "none", "double", sprung, tmp_path)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"target": "fmu"}, "--observer: only with --to c, and"),
        ({"target": "matlab"}, "--observer: only with --to c, and"),
        ({"target": "c", "valve": False}, "--observer: only with --to c, and"),
        ({"target": "st"}, "--observer: only with --to c, and"),
        ({"target": "c", "two_valves": True}, "--observer: not with --two-valves"),
        ({"target": "c", "observer": "three"}, "--observer three: must name the pressures"),
    ],
)
def test_what_has_no_observer_is_refused(options, told, plant):
    with pytest.raises(InputError, match=told):
        exported("M8", N, plant, options.pop("target"), **({"observer": "both"} | options))
