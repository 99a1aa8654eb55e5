"""The independent implementation and the FMU in fmpy: their runs, and the verdict on them."""

import subprocess
import sys
from itertools import islice
from pathlib import Path

import independent_simulator as independent
import numpy as np
import pytest
from exported_c import C_COMPILER
from paper_study import STUDY, lasting

import pneumo
from paper.study.paper_2006 import other_simulators as other
from pneumo.simulation.excitation import normal_deviates
from pneumo.simulation.full_order import record

NAMES = ("x", "v", "P_A", "T_A", "P_B", "T_B")
SCALE = np.array([0.1, 1.0, 1e5, 300.0, 1e5, 300.0])


def largest(run, recording):
    """Largest difference of each state over its scale."""
    states = np.column_stack([np.asarray(run[name]) for name in NAMES])
    return np.abs((states - recording.states) / SCALE).max(axis=0)


def test_the_independent_simulator_shares_no_code_with_the_package():
    code = "import sys, independent_simulator; sys.exit('pneumo' in sys.modules)"
    folder = Path(independent.__file__).parent
    assert subprocess.run([sys.executable, "-c", code], cwd=folder).returncode == 0


def test_its_random_numbers_are_simulinks():
    for seed in (666, 777, 1_234_567):
        numbers = list(islice(independent.random_numbers(seed), 50))
        assert numbers == pytest.approx(list(islice(normal_deviates(seed), 50)), rel=1e-14)


# In open loop the command is constant between samples and steps of 1 ms are accurate. In closed loop the
# chambers often are at equal pressure with a port, where eq (1) has an infinite slope: fixed steps oscillate.
@pytest.mark.parametrize(
    ("name", "seconds", "most"),
    [("E13", 1.0, 1e-6), ("E11", 2.0, 1e-6), ("E16", 1.0, 0.02), ("E10", 1.0, 0.02)],
)
def test_independent_runs_are_those_of_the_study(name, seconds, most):
    run, recording = independent.simulate(name, seconds), record(lasting(name, seconds))
    assert largest(run, recording).max() < most
    np.testing.assert_allclose(run["u"], recording.u, atol=5e-3)


def test_its_end_stops_are_met_and_left(monkeypatch, tmp_path):
    """The sign is not reversed near the ends: the piston hits both, rests there and leaves."""
    numbers = [1.0] * 40 + [-1.0] * 100 + [1.0] * 40
    monkeypatch.setattr(independent, "random_numbers", lambda _seed: iter(numbers))
    text = independent.CONFIGURATION.read_text(encoding="utf-8")
    file = tmp_path / "paper.yaml"
    file.write_text(text.replace("reverse_at: 0.96", "reverse_at: 2"), encoding="utf-8")
    run = independent.simulate("E11", 8.0, file)
    e = STUDY.experiments["E11"]
    simulated = pneumo.simulate(e.plant, 1e-3, command=np.asarray(run["u"]))
    for side in (e.plant.cylinder.x_min, e.plant.cylinder.x_max):
        assert np.sum(run["x"] == side) > 100
    # Impacts of the study are at the ends of steps, and the recorded command is late by one at a draw.
    np.testing.assert_allclose(run["x"], simulated.x, atol=1e-3 * e.plant.cylinder.stroke)
    # In a step the pressure changes by 1 % of the supply's there.
    np.testing.assert_allclose(run["P_A"], simulated.P_A, atol=0.02 * e.plant.conditions.P_s)


@pytest.mark.slow
@C_COMPILER
def test_runs_of_the_fmu_are_those_of_the_study_where_the_command_is(tmp_path):
    pytest.importorskip("fmpy", reason="fmpy is not installed")
    from benchmarks.fmu_runs import fmu_run

    # Steps of second order: far below the 0.5 kPa to which exports are held.
    assert largest(fmu_run(lasting("E13", 1.0), tmp_path), record(lasting("E13", 1.0))).max() < 5e-4
    recording = record(lasting("E16", 1.0))
    held, often = (largest(fmu_run(lasting("E16", 1.0), tmp_path, every), recording) for every in (1, 10))
    # The controller is outside: the command is late by half the time between communication points.
    assert 5 < held[0] / often[0] < 20 and often.max() < 0.02


def test_the_verdict_on_independent_runs_is_the_verdict_on_the_studys(tmp_path):
    brief = STUDY._replace(experiments={name: lasting(name, 0.3) for name in ("E13", "E16")})
    for name, e in brief.experiments.items():
        independent.write_run(independent.simulate(name, e.duration), tmp_path / f"{name}.nc")
    results = other.other_results(tmp_path, brief)
    for name, tolerance in (("E13", 1e-5), ("E16", 2e-2)):
        e = brief.experiments[name]
        sampling = other.study_sampling(other.PUBLISHED, e)
        by_pneumo = other.replayed_grid(e, brief.n, record(e), sampling, e.steps)["mse"].mean("chamber")
        np.testing.assert_allclose(results.cells["mse"].sel(experiment=name), by_pneumo, rtol=tolerance)
    judged = other.verdict_on(tmp_path, brief, "independent")
    status = {item["id"]: item["status"] for item in judged["items"]}
    assert judged["study"] == "runs of independent" and status["T8.E01.M8"] == "not judged"
