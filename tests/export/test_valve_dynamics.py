"""A valve with lag, null offset and dead band: in the rates, every export, linear models and commands."""

import json
import runpy
import shutil
import subprocess

import numpy as np
import pytest
import yaml
from checkout import ROOT
from exported_c import C_COMPILER, run_test_program

from pneumo import linearise
from pneumo.equations.system import rates, system
from pneumo.errors import InputError
from pneumo.export import exported
from pneumo.physics.valve_dynamics import ValveDynamics

N = 1.35
LATE = ValveDynamics(lag=4e-3, dead_time=5e-3, null=0.1, dead_band=0.3)
AT_ONCE = LATE._replace(lag=0.0)
PAPER = ROOT / "config/paper.yaml"


def some_points(count=200):
    """Rows u, x, v, opening, P_A, P_B on every branch of limiter and dead band."""
    low, high = (-12, -0.04, -1, -2, 2e5, 2e5), (12, 0.04, 1, 2, 6e5, 6e5)
    return np.random.default_rng(4).uniform(low, high, (count, 6)).tolist()


@pytest.mark.parametrize("dynamics", [LATE, AT_ONCE, LATE._replace(dead_band=0.0)])
def test_rates_are_those_of_a_proportional_valve_at_its_opening(dynamics, plant):
    chosen, ideal = system("M8", N, plant, dynamics=dynamics), system("M8", N, plant)
    seen = set()
    for u, x, v, opening, *P in some_points():
        limited = float(np.clip(u, -plant.valve.u_max, plant.valve.u_max))
        beyond = (opening if dynamics.lag else limited) - dynamics.null
        effective = np.sign(beyond) * max(abs(beyond) - dynamics.dead_band, 0.0)
        seen.add(np.sign(effective))
        *opening_rate, A, B = rates(chosen, [opening, *P] if dynamics.lag else P, [u, x, v])
        assert opening_rate == ([pytest.approx((limited - opening) / 4e-3)] if dynamics.lag else [])
        if abs(effective) <= plant.valve.u_max:  # beyond, the limiter of the proportional valve acts again
            np.testing.assert_allclose([A, B], rates(ideal, P, [effective, x, v]), rtol=1e-12)
    assert seen == ({-1.0, 0.0, 1.0} if dynamics.dead_band else {-1.0, 1.0})


@C_COMPILER
@pytest.mark.parametrize("dynamics", [LATE, AT_ONCE])
@pytest.mark.parametrize(("model", "precision", "piston"), [("full", "double", True), ("M8", "float", False)])
def test_test_programs_of_c_agree_with_python(model, precision, piston, dynamics, plant, tmp_path):
    files = exported(model, N, plant, "c", precision=precision, piston=piston, dynamics=dynamics)
    code, said = run_test_program(files, tmp_path)
    assert code == 0, said
    header = files[f"{model}.h"].decode()
    assert ("valve_lag; /* s, time constant" in header) == bool(dynamics.lag)
    assert "5 ms after it was given" in header


@pytest.mark.slow
@pytest.mark.parametrize("dynamics", [LATE, AT_ONCE])
def test_the_test_program_of_structured_text_agrees_with_python(dynamics, plant):
    from structured_text import Block, parsed

    options = {"piston": True, "dynamics": dynamics}
    texts = [text.decode() for text in exported("M8", N, plant, "st", stem="m", **options).values()]
    st = Block(*parsed(texts[1]), blocks=[parsed(texts[0])])
    st()
    assert st["passed"] and st["failures"] == 0
    st.values["model"].values["valve_null"] *= 2.0
    st()
    assert not st["passed"]


@pytest.mark.parametrize("dynamics", [LATE, AT_ONCE])
@pytest.mark.parametrize("target", ["casadi", "matlab"])
def test_rates_in_other_languages(target, dynamics, plant, tmp_path):
    chosen = system("M8", N, plant, dynamics=dynamics)
    rows = [[*row[: 3 + bool(dynamics.lag)], *row[4:]] for row in some_points()]
    ((name, content),) = exported("M8", N, plant, target, stem="M8_dP_dt", dynamics=dynamics).items()
    (tmp_path / name).write_bytes(content)
    expected = np.array([rates(chosen, row[3:], row[:3]) for row in rows])
    if target == "casadi":
        pytest.importorskip("casadi", reason="CasADi is not installed")
        function = runpy.run_path(str(tmp_path / name))["M8_dP_dt"]
        computed = np.array([[float(rate) for rate in function(*row)] for row in rows])
    elif shutil.which("octave-cli") is None:
        pytest.skip("GNU Octave is not installed")
    else:
        np.savetxt(tmp_path / "rows.txt", rows, fmt="%.17g")
        script = (
            f"s = load('rows.txt'); r = zeros(rows(s), {expected.shape[1]}); for i = 1:rows(s)\n"
            "c = cell(1, columns(r)); [c{:}] = M8_dP_dt(num2cell(s(i, :)){:}); r(i, :) = cell2mat(c);\nend\n"
            "f = fopen('r.bin', 'w'); fwrite(f, r', 'double'); fclose(f);"
        )
        (tmp_path / "run.m").write_text(script)
        subprocess.run(["octave-cli", "--norc", "--quiet", "run.m"], cwd=tmp_path, check=True)
        computed = np.fromfile(tmp_path / "r.bin").reshape(expected.shape)
    np.testing.assert_allclose(computed, expected, rtol=1e-11, atol=1e-12 * np.abs(expected).max())


def test_a_linear_model_has_the_lag_as_a_state(plant):
    point = {"P_A": 4e5, "P_B": 5e5, "x": 0.01, "v": 0.1}
    ideal = linearise("full", None, plant, u=0.6, **point)
    late = linearise("full", None, plant, u=1.0, dynamics=LATE, **point)  # 0.1 of null, 0.3 of dead band
    assert late.A[0].tolist() == pytest.approx([-250.0, 0, 0, 0, 0])
    assert late.B[:, 0].tolist() == pytest.approx([250.0, 0, 0, 0, 0])
    np.testing.assert_allclose(late.A[1:, 0], ideal.B[:, 0], rtol=1e-12)
    np.testing.assert_allclose(late.A[1:, 1:], ideal.A, rtol=1e-12)
    with pytest.raises(InputError, match=r"u = 0\.2 V: the valve is shut"):
        linearise("full", None, plant, u=0.2, dynamics=LATE, **point)


@pytest.fixture
def configured(tmp_path):
    """Configuration whose cylinder D has such a valve."""

    def write(**changes):
        dynamics = {"lag_s": 4e-3, "dead_time_s": 5e-3, "null_V": 0.1, "dead_band_V": 0.3} | changes
        content = yaml.safe_load(PAPER.read_text(encoding="utf-8"))
        content["cylinders"]["D"]["valve_dynamics"] = dynamics
        (tmp_path / "late.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
        return ["--config", "late.yaml", "--cylinder", "D", "--k0", 0.5]

    return write


def test_commands_take_the_dynamics_of_the_configuration(configured, inside, plant, tmp_path):
    code, out, _ = inside("export", "M8", "--n", N, "--to", "casadi", *configured())
    plant = plant._replace(k_0=0.5)
    assert code == 0 and out.encode() == exported("M8", N, plant, "casadi", dynamics=LATE)["M8.py"]
    at = ["--u", 1, "--P_A", "4e5", "--P_B", "5e5", *configured()]
    code, out, told = inside("linearise", "full", "--json", *at)
    assert code == 0 and json.loads(out)["states"] == ["opening", "P_A", "T_A", "P_B", "T_B"]
    assert told.startswith("note: the valve's dead time, 5 ms, is left out\n")
    code, _, told = inside("linearise", "full", "--json", "--u", 1, *at[2:6], *configured(null_V=9.8))
    assert code == 2 and "null_V = 9.8" in told and "must be below 10" in told
