"""The law of the full order's wall, `wall_law`, is the same in runs, replays and exports."""

import numpy as np
import pytest
import yaml

from pneumo.configuration.parameters import Sources, study
from pneumo.equations.system import step, system
from pneumo.runs import replay, simulate
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

LAWS = {"constant": (0.0, 0.0), "area": (1.0, 0.0), "area_PT": (1.0, 0.5), None: (1.0, 0.5)}
K_0 = 10.0  # W/K: that laws differ much
COMMAND = np.concatenate([np.full(60, 3.0), np.full(60, -3.0)])


def plant_with(law):
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["cylinders"]["mine"] |= {"wall_law": law} if law else {}
    return configured_plant(study(Sources(content).validated()), "mine", K_0)


@pytest.fixture(scope="module")
def runs():
    return {law: simulate(plant_with(law), 1e-3, command=COMMAND) for law in LAWS}


@pytest.mark.parametrize("law", LAWS)
def test_a_run_is_replayed_with_its_own_law_only(runs, law):
    assert plant_with(law).wall == LAWS[law]
    for other, exponents in LAWS.items():
        with_other = runs[law].recording._replace(plant=plant_with(other))
        error = np.sqrt(replay("full", None, runs[law]._replace(recording=with_other)).mse.mean())
        assert error < 1.0 if exponents == LAWS[law] else error > 500.0, (law, other, error)  # Pa


@pytest.mark.parametrize("law", LAWS)
def test_the_step_of_exports_has_the_law_of_the_plant(runs, law):
    run, of_law = runs[law], system("full", None, plant_with(law))
    at = 50  # fast, away from the middle and from P_0
    state = [run.P_A[at], run.T_A[at], run.P_B[at], run.T_B[at]]
    inputs = [[run.u[k], run.x[k], run.v[k]] for k in (at, at + 1)]
    after = step(of_law, state, *inputs, 1e-3)
    expected = [signal[at + 1] for signal in (run.P_A, run.T_A, run.P_B, run.T_B)]
    assert after == pytest.approx(expected, rel=2e-5)
    for other in (other for other in LAWS if LAWS[other] != LAWS[law]):
        after = step(system("full", None, plant_with(other)), state, *inputs, 1e-3)
        assert after != pytest.approx(expected, rel=2e-5)
