"""Cost of exported steps: eq (6) as a polynomial, the operations counted, the rows of the kept file."""

import numpy as np
import pytest
from exported_c import C_COMPILER, CompiledModel

from benchmarks import exported_c as cost
from pneumo import MODELS
from pneumo.equations.system import FULL_ORDER, system
from pneumo.export import exported
from pneumo.physics.models import lane, temperature


@pytest.fixture(scope="module")
def recording():
    return cost.recording_of()


def test_the_polynomial_is_eq_6_within_its_stated_error(recording):
    polynomial, error = cost.temperature_polynomial(recording)
    c = recording.plant.conditions
    P = np.geomspace(0.5 * c.P_atm, 1.5 * c.P_s, 999)
    exact = temperature(P, c.P_0, c.T_0, lane(MODELS["M8"], cost.N, recording.plant.gas.gamma).a)
    off = np.abs(c.T_0 * polynomial((P / c.P_0) ** 0.25) / exact - 1).max()
    assert 0.9 * error < off <= error * (1 + 1e-9) and error < 1e-5


@C_COMPILER
def test_exported_c_with_the_polynomial_steps_as_with_the_power(recording, tmp_path, monkeypatch):
    polynomial, error = cost.temperature_polynomial(recording)
    power = CompiledModel("M8", cost.N, recording.plant, tmp_path)
    files = exported("M8", cost.N, recording.plant, "c")
    source = cost.with_polynomial(files["M8.c"].decode(), polynomial, "double")
    assert "root*" in source
    (tmp_path / "again").mkdir()
    monkeypatch.setattr("exported_c.exported", lambda *_, **__: files | {"M8.c": source.encode()})
    replaced = CompiledModel("M8", cost.N, recording.plant, tmp_path / "again")
    signals = cost.signals_of(recording, power.system)
    P = [recording.plant.conditions.P_0] * 2, [recording.plant.conditions.P_0] * 2
    for k in range(cost.STEPS):
        P = tuple(
            model.step(signals[k], signals[k + 1], 1e-3, state)[1]
            for model, state in zip((power, replaced), P, strict=True)
        )
    # The pressure follows the temperature's error: at most ten times as large after a second of flow.
    np.testing.assert_allclose(*P, rtol=10 * error)
    assert P[0] != P[1]


def test_operations_are_those_of_the_equations(recording):
    def counted(name):
        return cost.operations(recording, system(name, cost.N, recording.plant, valve=False))

    # Without valve: eq (6) is one power a chamber, and the wall law of the full order one root.
    assert counted("M8")["power"] == 2 and "root" not in counted("M8")
    assert "power" not in counted(FULL_ORDER) and counted(FULL_ORDER)["root"] == 2
    assert "power" not in counted("M1") and counted("M1")["multiply"] < counted("M8")["multiply"]
