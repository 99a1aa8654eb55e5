"""Sign of the open-loop command at 96 % of the half-stroke: toggled or forced, each stage or each step."""

import numpy as np
import pytest
from paper_study import lasting

from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import equilibrium, record, run


@pytest.mark.parametrize("toggles", [True, False])
@pytest.mark.parametrize("each_stage", [True, False])
@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("E13", {"amplitude": 5.0}),
        ("E15", {"amplitude": 2.0}),
        # 0 reverses nothing
        ("E15", {"amplitude": 2.0, "signal": "levels", "levels": (1.0, 0.0), "every": 77}),
    ],
)
def test_the_rule_step_by_step(name, change, toggles, each_stage):
    e = lasting(name, 4.0)
    excitation = e.excitation._replace(**change)  # reaches 96 % several times
    drive = e.drive._replace(toggles=toggles, each_stage=each_stage)
    reference = reference_series(drive, excitation, e.steps)
    # Within a step the plain command is used; whether stages still look is all that `each_stage` decides.
    x_seen = drive.x_reverse if each_stage else np.inf
    within = drive._replace(toggles=False, x_reverse=x_seen, each_stage=True)
    states, sign, crossings = [equilibrium(e.plant)], 1.0, 0
    for k in range(e.steps):
        x, r = states[-1][0], sign * reference[k]
        if abs(x) >= drive.x_reverse and r * x > 0:
            crossings += 1
            if toggles or not each_stage:
                r = -r
            if toggles:
                sign = -sign
        states.append(run(states[-1], np.array([r, r]), 0.0, within, e.plant, e.h).states[-1])
    recording = record(e._replace(drive=drive, excitation=excitation))
    assert np.array_equal(recording.states, np.array(states))
    assert crossings >= 2
    if toggles:  # the rest of the sequence keeps its sign
        assert recording.reference[-2] == sign * reference[-2]
