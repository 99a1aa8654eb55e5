"""Strokes from vented chambers to rest at open ports: exported C against Radau on equations of our own."""

from functools import cache

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, CompiledModel
from radau_strokes import radau_stroke

from benchmarks.exported_strokes import (
    AT_REST,
    NEVER,
    PRESSURE,
    ROWS,
    SIZES,
    STEPS,
    TEMPERATURE,
    sized,
    strokes,
    template_plant,
)
from pneumo.equations.system import rates, system
from pneumo.export import exported

H, DURATION = 1e-3, 0.3  # s; all strokes but the slowest end within it
REST = 10_000  # steps: air in a large dead volume takes seconds to warm up
BRIEF = [(4.0, 4e-6, 10e5, -1), (4.0, 30e-6, 2e5, 1)]
NEAREST = [("full", "corners"), ("M5", "corners")]  # to the limit, with M9
CORNERS = [(C, V_d, P_s, 1) for C in (0.4, 4.0) for V_d in (4e-6, 30e-6) for P_s in (2e5, 10e5)]

template = pytest.fixture(cache(template_plant))


@C_COMPILER
@pytest.mark.parametrize(("C", "V_d", "P_s", "sign"), in_brief(SIZES, BRIEF))
def test_a_stroke_from_vented_to_rest_is_that_of_another_solver(C, V_d, P_s, sign, template, tmp_path):
    chosen = sized(template, C, V_d, P_s)
    compiled = CompiledModel("full", None, chosen, tmp_path, piston=True)
    c, inputs = chosen.conditions, [sign * chosen.valve.u_max, 0.0]
    state = [-sign * chosen.cylinder.x_max, 0.0, c.P_atm, c.T_amb, c.P_atm, c.T_amb]
    for expected in radau_stroke(chosen, sign, DURATION):
        failed, state = compiled.step(inputs, inputs, H, state)
        off = np.abs(np.subtract(state, expected))
        assert not failed and off[[2, 4]].max() < PRESSURE and off[[3, 5]].max() < TEMPERATURE
    for _ in range(REST):
        failed, state = compiled.step(inputs, inputs, H, state)
        assert not failed
    full, vented = (state[2:4], state[4:6]) if sign > 0 else (state[4:6], state[2:4])
    assert abs(full[0] - P_s) < PRESSURE and abs(vented[0] - c.P_atm) < PRESSURE
    assert abs(vented[1] - c.T_amb) < TEMPERATURE


@C_COMPILER
@pytest.mark.parametrize(
    ("row", "sizes"),
    in_brief([*NEAREST, *((row, "all") for row in ROWS)], NEAREST),
)
def test_strokes_of_every_model_keep_to_fine_steps(row, sizes, template):
    """With the valve open, or shut when the piston rests."""
    chosen = CORNERS if sizes == "corners" else SIZES
    cases = [(*sizes, shut) for sizes in chosen for shut in (NEVER, AT_REST)]
    for h in STEPS:
        for case, made in zip(cases, strokes(row, template, h, cases), strict=True):
            assert not made.failed, case
            assert made.pressure < PRESSURE and made.temperature < TEMPERATURE, (case, made)


@C_COMPILER
@pytest.mark.parametrize("model", in_brief(["M1", "M4", "M5", "M8", "M10", "full"], ["M8"]))
@pytest.mark.parametrize("precision", ["double", "float"])
def test_no_step_is_refused_whatever_its_length(model, precision, template, tmp_path):
    chosen = sized(template, 4.0, 4e-6, 10e5)
    compiled = CompiledModel(model, 1.35, chosen, tmp_path, precision, piston=True)
    c = chosen.conditions
    for h in (1e-5, 1e-3, 0.02):
        state = compiled.system.state(x=-chosen.cylinder.x_max, v=0.0, P=c.P_atm, T=c.T_amb)
        for k in range(200):
            inputs = [(chosen.valve.u_max, -chosen.valve.u_max)[k // 50 % 2], 0.0]
            failed, state = compiled.step(inputs, inputs, h, state)
            assert not failed and np.all(np.isfinite(state))


def test_exports_say_which_models_drift_with_the_valve_shut(plant):
    """What is said is right: by the rates of the exported system itself, with no flow at rest."""
    c = plant.conditions
    for model, drifts in (("full", 0), ("M1", 0), ("M6", 0), ("M7", 1), ("M8", 1), ("M10", 1)):
        states = [c.P_atm, c.T_amb] * 2 if model == "full" else [c.P_atm] * 2
        rate = rates(system(model, 1.35, plant, valve=False), states, [0.0] * 4)[0]
        assert (abs(rate) > 1e3) == bool(drifts)
        for target in ("c", "st", "matlab") if model in ("M6", "M8") else ("c",):
            said = b"".join(exported(model, 1.35, plant, target).values()).decode()
            assert ("drifts to P_0" in " ".join(said.split())) == bool(drifts)
