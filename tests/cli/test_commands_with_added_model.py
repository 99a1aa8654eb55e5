"""A new row in `MODELS` is a model for `pneumo fit`, `linearise` and `export` too."""

import numpy as np
import pytest

from pneumo import MODELS, Model, linearise, recorded, replay, simulate
from pneumo.equations.named_model import model_row
from pneumo.export import TARGETS, exported
from pneumo.fitting.measurement_fit import fit_measurement
from pneumo.fitting.record.measurement import Measurement

# Pages and figures read the table when they are imported: tests/publish.
M99 = Model("M99", "n", "n", "n", "polytropic", True, "lambda_0 A_q")


@pytest.fixture(autouse=True)
def added_model(monkeypatch):
    monkeypatch.setitem(MODELS, "M99", M99)


@pytest.fixture(scope="module")
def run(plant):
    steps = np.arange(1200)
    return simulate(plant, 1e-3, command=0.8 * np.sign(np.sin(steps / 150) + np.sin(steps / 57)))


@pytest.mark.slow
def test_fit_linear_model_and_source_code_of_the_added_model(plant, run):
    noise = np.random.default_rng(3).normal(0, 50.0, (2, len(run.t)))
    P = np.array([run.P_A, run.P_B]) + noise
    fits = fit_measurement(Measurement("m", 1e-3, run.u, run.x, P), plant, ["M99", "M6"])
    assert {name for name in fits.models if name != "full"} == {"M99", "M6"}
    parameters = ["n", "k_0", "k_xu", "V_d_A", "V_d_B"]
    assert fits.data["estimate"].sel(model="M99", parameter=parameters).notnull().all()  # n and k_0 both
    # At k_0 = 0 it is M6: its fit is no worse, to 0.1 % in which searches end.
    rms = np.hypot(*fits.data["rms_fitted"].transpose("chamber", ...))
    assert rms.sel(model="M99") < 1.001 * rms.sel(model="M6")
    point = {"u": 0.3, "P_A": 4e5, "P_B": 5e5}
    named, by_row = linearise("M99", 1.3, plant, **point), linearise(M99, 1.3, plant, **point)
    assert np.array_equal(named.A, by_row.A) and np.array_equal(named.B, by_row.B)
    for target in TARGETS:
        name, content = next(iter(exported("M99", 1.3, plant, target).items()))
        assert name.startswith("M99")
        if target == "st":
            assert b"Pneumo_M99" in content and b"n = 1.3" in content
        elif target != "fmu":
            assert b"M99_" in content and b"n = 1.3" in content and b"eq (11)" in content
    assert model_row("M99") is M99
    measured = recorded(plant, 1e-3, u=run.u, x=run.x, v=run.v)
    assert replay("M99", 1.3, measured).status == ("ok", "ok")
