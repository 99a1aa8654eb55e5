"""Every quantity that can be fitted means the same to a fit, `fitted.yaml`, `simulate` and an FMU."""

import numpy as np
import pytest
import yaml
from exported_c import C_COMPILER

from pneumo import simulate
from pneumo.configuration.parameters import configured_dynamics, load, study
from pneumo.configuration.schema import Configuration
from pneumo.export import exported
from pneumo.fitting.fit_problem import Problem, replayed_pressures
from pneumo.fitting.fit_result import Estimate, FitResult, fit_data
from pneumo.fitting.fitted_yaml import OF_SENSORS, fitted_configuration
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.stage_signals import stage_signals
from pneumo.physics.models import FULL
from pneumo.quantities.applied import value_in
from pneumo.quantities.table import ALSO, PARAMETERS, QUANTITIES, REPORTED, STARTS
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

H, SAMPLES = 2.5e-4, 2000
T = H * np.arange(SAMPLES)
U = 1.2 * np.sin(30 * T) + 1.2 * np.sin(60 * T)  # V, with the piston between its stops
WITHIN = 50.0  # Pa, at each joint: a twentieth of the noise of a sensor
CONTENT = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
CONTENT["cylinders"]["mine"]["coulomb_N"] = 0.0  # runs and exports end its sticking at another instant
CONFIGURATION = Configuration.model_validate(CONTENT)
RIG = configured_plant(study(CONFIGURATION))
OF_RIG = {"k_0": 0.5, "k_xu": 1.2 * RIG.valve.k_xu, "V_d_A": 6e-6, "V_d_B": 8e-6}
VALVE = {"lag": 4e-3, "dead_time": 3e-3, "null": 0.3}
GROUPS = {
    "rig": OF_RIG | {"b": 0.2, "P_s": 7.3e5, "exhaust": 0.8, "T_in": 285.0, "P_atm": 9.5e4, "A_B": 4.3e-4},
    "valve": OF_RIG | VALVE | {"dead_band": 0.4, "C_B": 0.9},
    "supply": OF_RIG | {"sag": 0.1},
    "linearity": OF_RIG | {"linearity": 0.06, "C_B": 0.9},
    "curve": OF_RIG | {"curve_half": 0.6, "curve_quarter": 0.4, "curve_eighth": 0.3, "C_B": 0.9},
}
NOT_WRITTEN = ("hysteresis", "piston_leak", "valve_leak")  # nothing that reads the file has them


def written(values, folder, **more):
    """Text of `fitted.yaml` after a fit that found `values`, in a file, and that file."""
    m = Measurement("m.csv", H, U, np.zeros(SAMPLES), np.full((2, SAMPLES), 4e5), **more)
    ends = ({name: factor * value for name, value in values.items()} for factor in (0.9, 1.1))
    one = Estimate(values, *ends, np.ones(2), np.ones(2), m.P)
    reported = [name for name in (*REPORTED, *ALSO) if name in values]
    fit = FitResult(data=fit_data(m, {"full": one}, reported), notes=(), warnings=(), held_out_from=T[-1])
    file = folder / "fitted.yaml"
    file.write_text(fitted_configuration(CONFIGURATION, "mine", RIG, fit, "m.csv", m), encoding="utf-8")
    return file


def replayed(run, values):
    """Pressures of the fit's replay on the motion of a run, as a gauge would show them, Pa."""
    m = Measurement(
        "m.csv",
        H,
        U,
        run.x,
        np.array([run.P_A, run.P_B]),
        zeros=dict.fromkeys(("P_A", "P_B"), RIG.conditions.P_atm),
    )
    signals = stage_signals(m, RIG)._replace(largest=np.abs(U).max())
    values = dict.fromkeys(VALVE, 0.0) | values
    problem = Problem(FULL, RIG, signals, {}, tuple(name for name in values if name in ALSO))
    first = {"start_A": run.P_A[0], "start_B": run.P_B[0], "start_T_A": run.T_A[0], "start_T_B": run.T_B[0]}
    return replayed_pressures(problem, problem.inner(values | first)[None])[0]


@pytest.fixture(scope="module", params=GROUPS)
def joint(request, tmp_path_factory):
    """Values of a group, and plant, dynamics and run of the file that has them."""
    values = GROUPS[request.param]
    configuration = load(written(values, tmp_path_factory.mktemp("joint")))
    plant, dynamics = configured_plant(study(configuration)), configured_dynamics(configuration, "mine")
    return values, plant, dynamics, simulate(plant, H, command=U, dynamics=dynamics)


def test_a_run_of_the_file_has_the_pressures_of_the_fit(joint):
    values, plant, _, run = joint
    gauge = np.array([run.P_A, run.P_B]) + RIG.conditions.P_atm - plant.conditions.P_atm  # as configured
    assert abs(replayed(run, values) - gauge).max() < WITHIN
    for name in values:  # each would be missed
        before = value_in(RIG, name) if QUANTITIES[name].field else QUANTITIES[name].start
        assert abs(replayed(run, values | {name: before}) - gauge).max() > WITHIN, name


@C_COMPILER
@pytest.mark.slow
def test_an_fmu_of_the_file_has_the_pressures_of_the_run(joint, tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not installed")
    _, plant, dynamics, run = joint
    if plant.sag:  # an FMU has a constant supply
        run = simulate(plant._replace(sag=0.0), H, command=U, dynamics=dynamics)
    (content,) = exported("full", None, plant, "fmu", dynamics=dynamics, piston=True).values()
    (tmp_path / "m.fmu").write_bytes(content)
    late = np.roll(U, round(dynamics.dead_time / H))  # an FMU has no dead time
    late[: round(dynamics.dead_time / H)] = 0.0
    command = np.rec.fromarrays([T, late], names=["time", "u"])
    steps = {"stop_time": T[-1], "step_size": H, "output_interval": H}
    found = fmpy.simulate_fmu(str(tmp_path / "m.fmu"), input=command, fmi_type="CoSimulation", **steps)
    for name in ("P_A", "P_B"):
        assert abs(found[name] - getattr(run, name)).max() < WITHIN


def test_what_only_a_fit_knows_is_refused_or_said(tmp_path):
    searched = {*PARAMETERS} - {"n", *STARTS, *OF_SENSORS, *NOT_WRITTEN}
    assert searched == {name for values in GROUPS.values() for name in values}
    plain = configured_plant(study(load(written(OF_RIG, tmp_path))))
    for name in (*OF_SENSORS, *NOT_WRITTEN):
        file = written(OF_RIG | {name: 0.01}, tmp_path)
        said = "of the record's sensor" if name in OF_SENSORS else f"no key for {QUANTITIES[name].heading}"
        assert configured_plant(study(load(file))) == plain and said in file.read_text(encoding="utf-8")
