"""Exports of a valve with lag, null offset, dead band, curve or unlike paths, or one for each chamber."""

import json
import shutil
import subprocess

import numpy as np
import pytest
import yaml
from brief import in_brief
from checkout import ROOT
from exported_c import C_COMPILER, CompiledModel, run_test_program
from valve_paths import CURVE, FOUR, OVERLAP, STRAIGHT, throttled
from valve_paths import plant as plant_with

import pneumo
from benchmarks.exported_strokes import template_plant as plant_of_template
from pneumo import MODELS, linearise
from pneumo.equations.system import rates, step, system
from pneumo.errors import InputError
from pneumo.export import exported
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics

N, H = 1.35, 1e-3
FINE = 100  # steps of Python in one of C
LATE = ValveDynamics(lag=4e-3, dead_time=5e-3, null=0.1, dead_band=0.3)
AT_ONCE = LATE._replace(lag=0.0)
PAPER = ROOT / "config/paper.yaml"

template_plant = pytest.fixture(plant_of_template)


@pytest.mark.parametrize("dynamics", [LATE, AT_ONCE, LATE._replace(dead_band=0.0)])
def test_rates_are_those_of_a_proportional_valve_at_its_opening(dynamics, plant):
    chosen, ideal = system("M8", N, plant, dynamics=dynamics), system("M8", N, plant)
    seen = set()
    low, high = (-12, -0.04, -1, -2, 2e5, 2e5), (12, 0.04, 1, 2, 6e5, 6e5)
    for u, x, v, opening, *P in np.random.default_rng(4).uniform(low, high, (200, 6)).tolist():
        limited = float(np.clip(u, -plant.valve.u_max, plant.valve.u_max))
        beyond = (opening if dynamics.lag else limited) - dynamics.null
        effective = np.sign(beyond) * max(abs(beyond) - dynamics.dead_band, 0.0)
        seen.add(np.sign(effective))
        *opening_rate, A, B = rates(chosen, [opening, *P] if dynamics.lag else P, [u, x, v])
        assert opening_rate == ([pytest.approx((limited - opening) / 4e-3)] if dynamics.lag else [])
        if abs(effective) <= plant.valve.u_max:  # beyond, the limiter of the proportional valve acts again
            np.testing.assert_allclose([A, B], rates(ideal, P, [effective, x, v]), rtol=1e-12)
    assert seen == ({-1.0, 0.0, 1.0} if dynamics.dead_band else {-1.0, 1.0})


CURVED = plant_with(curve=CURVE, exhaust_b=0.45)
FORMS = {  # plant, None for the paper's, dynamics, and whether each chamber has a valve
    "proportional": (None, PROPORTIONAL, False),
    "late": (None, LATE, False),
    "dead band": (None, AT_ONCE, False),
    "curve": (CURVED, PROPORTIONAL, False),
    "curves": (CURVED, LATE, True),
    "throttles": (throttled(), LATE, False),
    "overlap": (plant_with(curve=OVERLAP), AT_ONCE, False),
    "four paths": (plant_with(valve_B=FOUR, exhaust_ratio=0.8, exhaust_b=0.4), PROPORTIONAL, True),
}

BRIEF = ["late", "throttles", "four paths"]


@pytest.fixture(params=FORMS)
def form(request, plant):
    """A plant with another valve, and the options of its exports."""
    own, dynamics, two_valves = FORMS[request.param]
    return own or plant, {"dynamics": dynamics, "two_valves": two_valves}


def test_a_late_valve_nears_its_command_exponentially(plant):
    chosen, inputs = system("M8", 1.3, plant, dynamics=LATE), [4.0, 0.0, 0.0]
    for h in (2e-5, 2e-3):  # in one substep, and in several
        opening, *_ = step(chosen, [1.0, 4e5, 4e5], inputs, inputs, h)
        assert opening == pytest.approx(4.0 - 3.0 * np.exp(-h / LATE.lag), rel=0.01)


@C_COMPILER
@pytest.mark.parametrize("form", in_brief(FORMS, BRIEF), indirect=True)
@pytest.mark.parametrize(("model", "precision", "piston"), [("full", "double", True), ("M8", "float", False)])
def test_test_programs_of_c_agree_with_python(model, precision, piston, form, tmp_path):
    files = exported(model, N, form[0], "c", precision=precision, piston=piston, **form[1])
    code, said = run_test_program(files, tmp_path)
    assert code == 0, said
    header = files[f"{model}.h"].decode()
    assert ("valve_lag; /* s, time constant" in header) == bool(form[1]["dynamics"].lag)
    assert ("5 ms after it was given" in header) == bool(form[1]["dynamics"].dead_time)


@pytest.mark.slow
@pytest.mark.parametrize("form", BRIEF, indirect=True)
def test_the_test_program_of_structured_text_agrees_with_python(form):
    """Of the forms, those that have all kinds of statements; blark takes half a minute for each."""
    from structured_text import Block, parsed

    options = {"piston": True, **form[1]}
    texts = [text.decode() for text in exported("full", None, form[0], "st", stem="m", **options).values()]
    st = Block(*parsed(texts[1]), blocks=[parsed(texts[0])])
    st()
    assert st["passed"] and st["failures"] == 0
    st.values["model"].values["a_a"] *= 1.2
    st()
    assert not st["passed"]


MATLAB = [("full", form) for form in FORMS]
MATLAB += [(MODELS[name], "proportional") for name in ("M4", "M10")]
BRIEF_MATLAB = [*(("full", form) for form in BRIEF), MATLAB[-1]]


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="GNU Octave is not installed")
@pytest.mark.parametrize(("model", "form"), in_brief(MATLAB, BRIEF_MATLAB), indirect=["form"])
def test_rates_in_matlab(model, form, tmp_path):
    chosen = system(model, N, form[0], **form[1])
    low = {"u": -12, "x": -0.04, "v": -1, "opening": -2, "P": 0.9e5, "T": 230}
    high = {"u": 12, "x": 0.04, "v": 1, "opening": 2, "P": 7.5e5, "T": 370}
    names = (*chosen.inputs, *chosen.states)
    ends = [[of[name.partition("_")[0]] for name in names] for of in (low, high)]
    rows, count = np.random.default_rng(4).uniform(*ends, (200, len(names))), len(chosen.inputs)
    function = f"{chosen.name}_dP_dt"
    ((name, content),) = exported(model, N, form[0], "matlab", stem=function, **form[1]).items()
    (tmp_path / name).write_bytes(content)
    expected = np.array([rates(chosen, row[count:], row[:count]) for row in rows.tolist()])
    np.savetxt(tmp_path / "rows.txt", rows, fmt="%.17g")
    script = (
        f"s = load('rows.txt'); r = zeros(rows(s), {expected.shape[1]}); for i = 1:rows(s)\n"
        f"c = cell(1, columns(r)); [c{{:}}] = {function}(num2cell(s(i, :)){{:}});\n"
        "r(i, :) = cell2mat(c);\nend\n"
        "f = fopen('r.bin', 'w'); fwrite(f, r', 'double'); fclose(f);"
    )
    (tmp_path / "run.m").write_text(script)
    subprocess.run(["octave-cli", "--norc", "--quiet", "run.m"], cwd=tmp_path, check=True)
    computed = np.fromfile(tmp_path / "r.bin").reshape(expected.shape)
    np.testing.assert_allclose(computed, expected, rtol=1e-11, atol=1e-12 * np.abs(expected).max())


@C_COMPILER
@pytest.mark.parametrize("name", in_brief(["curve", "overlap", "four paths"], ["overlap", "four paths"]))
def test_runs_with_paths_of_their_own_are_those_of_python(name, tmp_path):
    """From vented, through strokes, a shut valve and both paths open, within the limits of docs/export.md."""
    plant, _, two_valves = FORMS[name]
    compiled = CompiledModel("full", None, plant, tmp_path, piston=True, two_valves=two_valves)
    t = np.arange(1200) * H
    u = np.select([t < 0.4, t < 0.6, t < 0.9], [8.0, 0.0, -5.0], 0.2)
    command = np.stack([u, np.where(t < 0.7, -10.0, 10.0)], axis=1) if two_valves else u
    fine = np.concatenate([np.repeat(command, FINE, axis=0), command[-1:]])
    expected = pneumo.simulate(plant, H / FINE, command=fine, start="vented").recording.states[::FINE]
    state = expected[0].tolist()
    for given, known in zip(command, expected[1:], strict=True):
        inputs = [*np.atleast_1d(given).tolist(), 0.0]
        failed, state = compiled.step(inputs, inputs, H, state)
        off = np.abs(state - known)
        assert not failed and off[[2, 4]].max() < 500 and off[[3, 5]].max() < 1


@C_COMPILER
@pytest.mark.parametrize(
    ("dynamics", "command", "h", "end"),
    [
        (ValveDynamics(lag=0.02, null=0.5, dead_band=0.4), [1.0], 1e-3, 0.3),
        (ValveDynamics(lag=4e-3, dead_time=0.01, null=-0.5), [10.0], 1e-4, 0.07),  # opens beyond the limiter
        (ValveDynamics(dead_time=0.01, null=0.2, dead_band=0.1), [1.0, -0.7], 1e-4, 0.15),
    ],
)
def test_simulate_opens_a_valve_as_exports_do(dynamics, command, h, end, template_plant, tmp_path):
    """An export has no dead time: its command is delayed. The piston moves, and has not met its stop."""
    two_valves, steps = len(command) == 2, round(end / h)
    given = np.tile(command if two_valves else command[0], (steps + 1, 1)).squeeze()
    run = pneumo.simulate(template_plant, h, command=given, start="vented", dynamics=dynamics)
    parts = {"piston": True, "dynamics": dynamics, "two_valves": two_valves}
    compiled = CompiledModel("full", None, template_plant, tmp_path, **parts)
    names = compiled.system.states
    first = dict(zip(("x", "v", "P_A", "T_A", "P_B", "T_B"), run.recording.states[0].tolist(), strict=True))
    state = [first.get(name, 0.0) for name in names]
    for k in range(steps):
        u = command if k >= round(dynamics.dead_time / h) else [0.0] * len(command)
        failed, state = compiled.step([*u, 0.0], [*u, 0.0], h, state)
        reached = dict(zip(names, state, strict=True))
        assert not failed and abs(reached["x"] - run.x[k + 1]) < 1e-4
        assert abs(reached["P_A"] - run.P_A[k + 1]) < 100 and abs(reached["P_B"] - run.P_B[k + 1]) < 100
    assert run.x[0] + 5e-3 < run.x[-1] < template_plant.cylinder.x_max


def test_a_linear_model_of_a_curve_has_its_slope():
    point = {"P_A": 4e5, "P_B": 5e5, "x": 0.01, "v": 0.1}
    straight, curved = plant_with(), plant_with(curve=CURVE)
    usual, linear = (linearise("full", None, at, u=3.0, **point) for at in (straight, curved))
    # From 2 to 4 V the curve is 0.27 dm3/(s bar) per volt, the straight valve 0.15 everywhere.
    np.testing.assert_allclose(linear.B[:, 0], usual.B[:, 0] * 0.27 / 0.15, rtol=1e-9)
    with pytest.raises(InputError, match="curve has a kink"):
        linearise("full", None, curved, u=-4.0, **point)
    with pytest.raises(InputError, match="equal pressures"):
        linearise("full", None, curved, u=3.0, **point | {"P_A": curved.conditions.P_s})
    # From 5 V on chamber A has no path to the atmosphere, so it may be at that pressure.
    supply, exhaust = [0, 0, 1, 1.5], [1.5, 1, 0, 0]
    curve = {"u_V": [-10, -5, 5, 10], "C_dm3_per_sbar": supply, "exhaust_C_dm3_per_sbar": exhaust}
    empty = point | {"P_A": curved.conditions.P_atm}
    assert np.isfinite(linearise("full", None, plant_with(curve=curve), u=6.0, **empty).A).all()
    # 3 V is a knot of chamber B's own valve only, at its own command of -3 V.
    lopsided = {"curve": {"u_V": [-10, -3, 0, 10], "C_dm3_per_sbar": [1.5, 0.2, 0, 1.5]}, "b": 0.3}
    with pytest.raises(InputError, match=r"u = 3 V: the valve's curve has a kink"):
        linearise("full", None, plant_with(curve=STRAIGHT, valve_B=lopsided), u=3.0, **point)


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
    code, out, _ = inside("export", "M8", "--n", N, "--to", "matlab", *configured())
    plant = plant._replace(k_0=0.5)
    assert code == 0 and out.encode() == exported("M8", N, plant, "matlab", dynamics=LATE)["M8.m"]
    at = ["--u", 1, "--P_A", "4e5", "--P_B", "5e5", *configured()]
    code, out, told = inside("linearise", "full", "--json", *at)
    assert code == 0 and json.loads(out)["states"] == ["opening", "P_A", "T_A", "P_B", "T_B"]
    assert told.startswith("note: the valve's dead time, 5 ms, is left out\n")
    code, _, told = inside("linearise", "full", "--json", "--u", 1, *at[2:6], *configured(null_V=9.8))
    assert code == 2 and "null_V = 9.8" in told and "must be below 10" in told
