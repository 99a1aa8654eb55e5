"""FMUs: checked and simulated by fmpy, against replays, full-order runs and the standard's own headers."""

import io
import subprocess
import zipfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from brief import in_brief
from exported_c import C_COMPILER, STRICT
from valve_paths import CURVE
from valve_paths import plant as plant_with

from pneumo import simulate
from pneumo.equations.system import step, system
from pneumo.export import exported
from pneumo.export.fmu import PLATFORMS, UNITS, platforms_note
from pneumo.linear.linear_model import derivatives
from pneumo.physics.valve_dynamics import ValveDynamics

fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
validation, fmi2, _ = (pytest.importorskip(f"fmpy.{name}") for name in ("validation", "fmi2", "fmi3"))
pytestmark = [C_COMPILER, pytest.mark.xdist_group("fmu")]  # each is compiled once

N, H = 1.35, 1e-3
KINDS = ["CoSimulation", "ModelExchange"]


@pytest.fixture(scope="module")
def fmus(plant, tmp_path_factory):
    """Paths of FMUs, each made once."""
    folder, made = tmp_path_factory.mktemp("fmus"), {}

    def path(model, fmi, **parts):
        key = model, fmi, repr(parts)
        if key not in made:
            made[key] = folder / f"{len(made)}.fmu"
            (content,) = exported(model, N, target="fmu", fmi=fmi, **{"plant": plant} | parts).values()
            made[key].write_bytes(content)
        return str(made[key])

    return path


def signals(t, **columns):
    return np.rec.fromarrays([t, *columns.values()], names=["time", *columns])


FORMS = [
    (model, fmi, parts)
    for model in ("M1", "M10", "full")
    for fmi in (2, 3)
    for parts in ({}, {"piston": True}, {"valve": False})
]
LATE = ("full", 2, {"dynamics": ValveDynamics(lag=4e-3, null=0.1, dead_band=0.3), "piston": True})
CURVED = ("full", 3, {"plant": plant_with(curve=CURVE, exhaust_b=0.45), "two_valves": True})
FORMS += [LATE, CURVED]
BRIEF_FORMS = [("full", 3, {"piston": True}), CURVED]


@pytest.mark.parametrize(("model", "fmi", "parts"), in_brief(FORMS, BRIEF_FORMS))
def test_fmpy_finds_no_problem_and_default_inputs_simulate(model, fmi, parts, fmus, plant):
    path = fmus(model, fmi, **parts)
    assert validation.validate_fmu(path) == []
    for kind in KINDS:
        result = fmpy.simulate_fmu(path, fmi_type=kind, stop_time=0.1)
        P_0 = parts.get("plant", plant).conditions.P_0
        assert result["P_A"] == pytest.approx(P_0)  # at rest


@pytest.mark.parametrize("fmi", in_brief([2, 3], [3]))
def test_variables_have_units_and_parameters_can_be_tuned(fmi, fmus):
    description = fmpy.read_model_description(fmus("full", fmi, piston=True))
    by_name = {variable.name: variable for variable in description.modelVariables}
    assert {by_name[name].causality for name in ("u", "force")} == {"input"}
    assert {by_name[name].causality for name in ("x", "v", "P_A", "T_A", "P_B", "T_B")} == {"output"}
    parameters = [v for v in description.modelVariables if v.causality == "parameter"]
    assert {v.variability for v in parameters if v.name not in ("R", "gamma_")} >= {"tunable"}
    assert (by_name["k_0"].unit, by_name["k_0"].variability) == ("W/K", "tunable")
    assert (by_name["R"].unit, by_name["R"].variability) == ("J/(kg K)", "fixed")
    assert {v.unit for v in description.modelVariables if v.unit} <= set(UNITS)
    rates = {v.name: v.derivative.name for v in description.modelVariables if v.derivative}
    assert rates == {f"der({name})": name for name in ("x", "v", "P_A", "T_A", "P_B", "T_B")}


@pytest.mark.parametrize("fmi", in_brief([2, 3], [3]))
def test_an_fmu_says_for_which_platforms_it_has_binaries(fmi, fmus, plant, monkeypatch):
    path = fmus("M8", fmi)
    folders = {Path(name).parent.name for name in zipfile.ZipFile(path).namelist() if "binaries" in name}
    description = fmpy.read_model_description(path).description
    of = {platform.name: {platform.fmi_2, platform.fmi_3} & folders for platform in PLATFORMS}
    named = [name for name in of if name in description]
    assert named == [name for name, there in of.items() if there] and len(named) == len(folders) > 0
    monkeypatch.setattr("pneumo.export.fmu.find_spec", lambda _: None)
    monkeypatch.setattr("pneumo.export.fmu.COMPILER", "no-such-compiler")
    (bare,) = exported("M8", N, plant, "fmu", fmi=fmi).values()
    assert "No binaries" in fmpy.read_model_description(io.BytesIO(bare)).description
    assert "pip install ziglang" in platforms_note(bare)


@pytest.mark.parametrize("fmi", in_brief([2, 3], [3]))
def test_sources_agree_with_the_standard_s_headers(fmi, fmus, tmp_path):
    """With the headers of the standard, which fmpy brings, a wrong type is an error."""
    headers = Path(fmpy.__file__).parent / "c-code"
    zipfile.ZipFile(fmus("M8", fmi)).extractall(tmp_path)
    include = [f"-I{headers}", "-include", f"fmi{fmi}Functions.h", "-Wno-unused-parameter"]
    command = ["gcc", *STRICT, *include, "-c", f"fmi{fmi}.c", "model.c"]
    subprocess.run(command, cwd=tmp_path / "sources", check=True)
    declared = subprocess.run(
        ["gcc", "-E", f"-I{headers}", "-include", f"fmi{fmi}Functions.h", "-xc", "/dev/null"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    names = {word for word in declared.replace("(", " ").split() if word.startswith(f"fmi{fmi}")}
    functions = {name.removesuffix("TYPE") for name in names if name.endswith("TYPE")}
    functions -= {f"fmi{fmi}{name}" for name in ("CallbackLogger", "StepFinished")}
    (binary,) = tmp_path.glob("binaries/*/*.so")
    there = subprocess.run(
        ["nm", "-D", str(binary)], capture_output=True, text=True, check=True
    ).stdout.split()
    assert len(functions) > 40 and functions <= set(there)


@pytest.fixture(scope="module")
def run(plant):
    """Half a second of a full-order run, the piston moving."""
    t = np.arange(501) * H
    return simulate(plant, H, command=1.2 * np.sin(13 * t) + 0.7 * np.sin(41 * t))


def stepped(run, plant, model, *, held):
    """Pressures of a model that Python steps through the run."""
    chosen, state = system(model, N, plant), [plant.conditions.P_0] * 2
    states, inputs = [state], np.column_stack([run.u, run.x, run.v]).tolist()
    for start, end in pairwise(inputs):
        state = step(chosen, state, start, start if held else end, H)
        states.append(state)
    return np.transpose(states)


def simulated(path, run, kind, **options):
    table = signals(run.t, u=run.u, x=run.x, v=run.v)
    rest = {"input": table, "output_interval": H, "step_size": H, "stop_time": run.t[-1]} | options
    result = fmpy.simulate_fmu(path, fmi_type=kind, **rest)
    return np.array([result["P_A"], result["P_B"]])


@pytest.mark.parametrize("fmi", [2, 3])
def test_co_simulation_with_held_inputs_steps_as_python(fmi, run, plant, fmus):
    pressures = simulated(fmus("M8", fmi), run, "CoSimulation")
    # fmpy repeats times, so that inputs and step ends differ by roundings of t, slopes times 1e-16 s.
    np.testing.assert_allclose(pressures, stepped(run, plant, "M8", held=True), rtol=1e-10)


def test_both_versions_of_fmi_give_the_same_numbers(run, fmus):
    for kind in KINDS:
        second, third = (simulated(fmus("M8", fmi), run, kind) for fmi in (2, 3))
        assert np.array_equal(second, third)


@pytest.mark.parametrize("fmi", in_brief([2, 3], [3]))
def test_full_order_actuator_is_the_full_order_run_with_its_stops(fmi, plant, fmus):
    path = fmus("full", fmi, piston=True)
    t = np.arange(601) * H
    run = simulate(plant, H, command=np.where(t < 0.3, 4.0, -4.0))
    assert np.sum(run.x == plant.cylinder.x_max) > 10
    chosen, expected = system("full", None, plant, piston=True), run.recording.states[0].tolist()
    for u in run.u[:-1].tolist():
        expected = step(chosen, expected, [u, 0.0], [u, 0.0], H)
    names = ["x", "v", "P_A", "T_A", "P_B", "T_B"]
    stepwise = {"input": signals(t, u=run.u), "step_size": H, "output_interval": H}
    result = fmpy.simulate_fmu(path, fmi_type="CoSimulation", stop_time=t[-1], **stepwise)
    np.testing.assert_allclose([result[name][-1] for name in names], expected, rtol=1e-9)
    jumps = signals(np.array([0, 0.3, 0.3, 1.0]), u=np.array([4.0, 4.0, -4.0, -4.0]))
    exact = {"input": jumps, "relative_tolerance": 1e-9, "record_events": True}
    result = fmpy.simulate_fmu(path, fmi_type="ModelExchange", stop_time=t[-1], **exact)
    # Both meet the stop where it is; the rest is the error of the substeps, 0.5 kPa of docs/export.md.
    np.testing.assert_allclose([result[name][-1] for name in names], expected, rtol=1e-3, atol=1e-4)
    assert np.max(result["x"]) <= plant.cylinder.x_max + 1e-9


VALVES = [  # as exported, and the figures of another data sheet
    ({}, {"C": 0.8, "b": 0.45, "k_0": 5.0}),
    ({"leak_dm3_per_sbar": 0.01}, {"C": 2.0, "C_leak": 0.03}),
    ({"curve": CURVE}, {"C": 0.75}),
]


@pytest.mark.parametrize(("valve", "figures"), in_brief(VALVES, VALVES[:1]))
def test_parameters_are_tuned_by_the_figures_of_a_data_sheet(valve, figures, fmus, tmp_path):
    if "curve" in valve:
        factor = figures["C"] / max(CURVE["C_dm3_per_sbar"])
        changed = {"curve": CURVE | {"C_dm3_per_sbar": [factor * C for C in CURVE["C_dm3_per_sbar"]]}}
    else:
        keys = {"C": "C_dm3_per_sbar", "b": "b", "C_leak": "leak_dm3_per_sbar"}
        changed = valve | {key: figures[name] for name, key in keys.items() if name in figures}
    # The half-bridge pressure P_0 depends on b, but is a parameter of its own.
    usual = plant_with(**valve)
    k_0 = figures.get("k_0", usual.k_0)
    other = plant_with(**changed)._replace(conditions=usual.conditions, k_0=k_0)
    (content,) = exported("full", None, other, "fmu").values()
    (tmp_path / "other.fmu").write_bytes(content)
    table = signals(np.array([0.0, 0.3]), u=np.array([2.0, -2.0]))
    options = {"input": table, "stop_time": 0.3, "fmi_type": "CoSimulation"}
    path = fmus("full", 2, plant=usual)
    tuned = fmpy.simulate_fmu(path, start_values=figures, **options)["P_A"]
    untuned = fmpy.simulate_fmu(path, **options)["P_A"]
    expected = fmpy.simulate_fmu(str(tmp_path / "other.fmu"), **options)["P_A"]
    np.testing.assert_allclose(tuned, expected, rtol=1e-10)  # roundings of the area, over 300 steps
    assert np.max(np.abs(tuned - untuned)) > 1e3


DERIVED = [(model, fmi, parts) for model, fmi, parts in FORMS if model != "M1"]


@pytest.mark.parametrize(("model", "fmi", "parts"), in_brief(DERIVED, BRIEF_FORMS))
def test_directional_derivatives_are_those_of_the_equations(model, fmi, parts, fmus, plant, tmp_path):
    """Against central differences of the FMU's own rates, and the complex step of the equations in Python."""
    plant = parts.get("plant", plant)
    chosen, path = system(model, N, **{"plant": plant} | parts), fmus(model, fmi, **parts)
    unzipped, description = fmpy.extract(path, unzipdir=str(tmp_path)), fmpy.read_model_description(path)
    identity = {"guid": description.guid, "unzipDirectory": unzipped, "instanceName": "i"}
    fmu = (fmi2.FMU2Model if fmi == 2 else fmpy.fmi3.FMU3Model)(modelIdentifier=model, **identity)
    fmu.instantiate()
    if fmi == 2:
        fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    by_name = {variable.name: variable.valueReference for variable in description.modelVariables}
    knowns = [by_name[name] for name in (*chosen.states, *chosen.inputs)]
    unknowns = [by_name[f"der({name})"] for name in chosen.states]
    get, put = (fmu.getReal, fmu.setReal) if fmi == 2 else (fmu.getFloat64, fmu.setFloat64)
    rng, c = np.random.default_rng(3), plant.conditions
    ranges = {"x": (-0.04, 0.04), "v": (-1, 1), "P": (1.1 * c.P_atm, 0.9 * c.P_s), "T": (250, 340)}
    ranges |= {"u": (0.1, 9), "opening": (0.5, 9), "m": (1e-4, 1e-3), "force": (-100, 100)}
    bounds = np.array([ranges[name.partition("_")[0]] for name in (*chosen.states, *chosen.inputs)])
    steps = 1e-6 * np.ptp(bounds, axis=1)
    for k in range(20):
        point = rng.uniform(*bounds.T)
        if k % 2:
            flows = [i for i, name in enumerate(chosen.inputs) if name[0] in "um"]
            point[[len(chosen.states) + i for i in flows]] *= -1
        exact = derivatives(chosen, point[: len(chosen.states)], point[len(chosen.states) :])
        size = np.abs(exact) @ np.abs(point)  # of the terms of each rate
        for j, known in enumerate(knowns):
            sides = []
            for sign in (1, -1):
                put(knowns, (point + sign * steps * (np.arange(len(point)) == j)).tolist())
                sides.append(np.array(get(unknowns)))
            put(knowns, point.tolist())
            column = np.array(fmu.getDirectionalDerivative(unknowns, [known], [1.0]))
            # The equations' own rounding; a difference of rates, over 2e-6 of the range, keeps ten digits.
            assert np.all(np.abs(column - exact[:, j]) * np.ptp(bounds[j]) <= 1e-12 * size)
            difference = (sides[0] - sides[1]) / (2 * steps[j])
            assert np.all(np.abs(column - difference) * np.ptp(bounds[j]) <= 1e-6 * size)
        weights = rng.normal(size=len(point))
        together = fmu.getDirectionalDerivative(unknowns, knowns, weights.tolist())
        np.testing.assert_allclose(together, exact @ weights, rtol=1e-9, atol=1e-12 * size.max())
        if fmi == 3:
            seeds = rng.normal(size=len(unknowns))
            adjoint = fmu.getAdjointDerivative(unknowns, knowns, seeds.tolist(), len(knowns))
            np.testing.assert_allclose(adjoint, seeds @ exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max())
    outputs = [by_name[name] for name in chosen.states]
    assert fmu.getDirectionalDerivative(outputs, [outputs[0]], [2.0]) == [2.0] + [0.0] * (len(outputs) - 1)
    fmu.freeInstance()


@pytest.mark.slow
def test_an_fmu_is_the_same_on_every_run_and_has_no_model_exchange_with_dry_friction(plant):
    first, second = (exported("M8", N, plant, "fmu", piston=True) for _ in range(2))
    assert first == second
    stuck = plant._replace(cylinder=plant.cylinder._replace(coulomb=10.0))
    (content,) = exported("M8", N, stuck, "fmu", piston=True).values()
    description = fmpy.read_model_description(io.BytesIO(content))
    assert description.modelExchange is None and description.coSimulation is not None
