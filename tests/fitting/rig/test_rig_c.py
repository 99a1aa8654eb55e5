"""A fitted rig in C: every step of a run as in Python, and its own test program."""

import ctypes
import subprocess
from itertools import pairwise

import numpy as np
import pytest
from exported_c import C_COMPILER, STRICT, run_test_program, write

from pneumo.fitting.rig.rig_c import rig_c
from pneumo.fitting.rig.rig_file import rig
from pneumo.fitting.rig.rig_record import Points, Run, vessel_run
from pneumo.fitting.rig.rig_replay import network, replay_run, valve_opening
from pneumo.physics.valve import choked_flow
from pneumo.simulation.gas_network import replay

VALVE = {"valve_C_in_dm3_per_sbar": 1.2, "valve_C_out_dm3_per_sbar": 1, "P_s_bar": 6, "valve_opening_ms": 5}
VALVE |= {"valve_closing_ms": 8, "valve_opening_delay_ms": 2, "valve_closing_delay_ms": -1}
CHAMBER = {"bore_mm": 32, "dead_volume_mL": 12, "n": 1.3, "k_0_W_per_K": 0.5} | VALVE
STORE = {"store_k_W_per_K": 0.4, "store_c_J_per_K": 2, "store_back_W_per_K": 0.1}
EVERYTHING = CHAMBER | STORE | {
    **{"rod_mm": 3, "hose_volume_mL": 6, "hose_C_dm3_per_sbar": 0.9, "hose_b": 0.3, "hose_k_W_per_K": 0.05},
    **{"hose_out_over_in": 0.5, "silencer_b": 0.2, "valve_b": 0.4, "silencer_volume_mL": 5},
    **{"silencer_C_dm3_per_sbar": 1.5, "supply_volume_L": 1, "regulator_C_dm3_per_sbar": 0.3},
    **{"sensor": "valve", "dead_volume_B_mL": 20, "rod_B_mm": 12, "k_0_B_W_per_K": 0.8},
}  # fmt: skip
VESSEL = {"volume_L": 10, "orifice_mm": 3, "P_start_bar": 8, "k_0_W_per_K": 3, "n": 1.3}
SHUT = {"volume_L": 10, "P_start_bar": 8, "T_start_K": 350, "k_0_W_per_K": 3, "gas": "nitrogen"}
H, SAMPLES = 1e-3, 150


def driven():
    """A run of both chambers that begins away from the smallest x, and covers the whole travel."""
    x = 0.04 - 0.04 * np.cos(np.linspace(1, 1 + 2 * np.pi, SAMPLES))
    x[np.argmin(x)], x[np.argmax(x)] = 0.0, 0.08
    points = Points(np.arange(SAMPLES) * H, np.zeros(SAMPLES))
    return Run(H, x, 0.02, 0.08, points, P_B=points, travel=0.08)


def left_alone():
    return vessel_run(Points(np.linspace(0, 40, 20), np.zeros(20)))


def network_of_run(known, model, values, run):
    return network(known, model, values, run, valve_opening(known, values, run))


class Compiled:
    def __init__(self, files, folder):
        source = write({name: text.encode() for name, text in files.items()}, folder)[0]
        subprocess.run(
            ["gcc", *STRICT, "-shared", "-fPIC", "-o", "rig.so", source, "-lm"], cwd=folder, check=True
        )
        self.library = ctypes.CDLL(str(folder / "rig.so"))

    def run(self, x, opening, h, count):
        """States of a run that begins at rest, shape (sample, state)."""
        state = (ctypes.c_double * count).in_dll(self.library, "rig_start")
        states = [list(state)]
        state = (ctypes.c_double * count)(*state)
        inputs = [(ctypes.c_double * 2)(*pair) for pair in zip(x, opening, strict=True)]
        for start, end in pairwise(inputs):
            assert self.library.rig_step(start, end, ctypes.c_double(h), state) == 0
            states.append(list(state))
        return np.array(states)


@C_COMPILER
@pytest.mark.parametrize(
    ("content", "run", "model"),
    [
        *((EVERYTHING, driven(), model) for model in ("M4", "M8", "M10", "full order", "full order, eq (7)")),
        (CHAMBER, driven()._replace(P_B=None), "M6"),
        (CHAMBER, driven()._replace(P_B=None), "full order, adiabatic"),
        (VESSEL, left_alone(), "M8"),
        (VESSEL | STORE, left_alone(), "full order"),
        (SHUT, left_alone(), "full order"),
    ],
)
def test_every_step_is_that_of_python(content, run, model, tmp_path):
    known = rig(content, "test")
    values = {name: low for name, (low, _) in known.ends.items()}
    in_c = Compiled(rig_c(known, model, values, [run]), tmp_path)
    of_rig = network_of_run(known, model, values, run)
    *arguments, _, _ = of_rig
    nodes, links, surroundings, V, areas, ratios = arguments
    expected = replay(nodes, links, surroundings, V, areas, known.gas, run.h, ratios)
    if known.has("valve_C_in"):
        in_c.library.rig_opening.restype = ctypes.c_double
        opened = [
            in_c.library.rig_opening(*map(ctypes.c_double, (t, run.on, run.off))) for t in run.t.tolist()
        ]
        # At each instant: 2 ms after its edge it opens in 5 ms, 1 ms before the other it closes in 8 ms.
        ramps = np.interp(run.t, [0.022, 0.027, 0.079, 0.087], [0.0, 1.0, 1.0, 0.0])
        np.testing.assert_allclose(opened, ramps, atol=1e-12)
    count = len(nodes)
    states = in_c.run(run.x, valve_opening(known, values, run), run.h, 3 * count)
    P, T, T_store = states.T.reshape(3, count, -1)
    # Roundings of some thousand steps, of which most die out, and powers a few units in the last place off.
    np.testing.assert_allclose(P, expected.P, rtol=1e-10)
    np.testing.assert_allclose(T, expected.T, rtol=1e-10)
    np.testing.assert_allclose(T_store, expected.T_store, rtol=1e-10)
    assert np.ptp(P[of_rig.sensor]) > 1e4
    np.testing.assert_array_equal(expected.P[of_rig.sensor], replay_run(known, model, values, run).P.values)


@C_COMPILER
@pytest.mark.parametrize("content", [EVERYTHING, VESSEL, SHUT])
def test_its_test_program_passes_and_fails_where_a_number_is_another(content, tmp_path):
    known = rig(content, "test")
    values = {name: low for name, (low, _) in known.ends.items()}
    run = driven() if known.has("bore") else left_alone()
    files = rig_c(known, "full order", values, [run])
    code, said = run_test_program({name: text.encode() for name, text in files.items()}, tmp_path)
    assert code == 0 and "from Python" in said, said
    other = rig_c(known, "full order", values | {"k_0": 1.01 * values["k_0"]}, [run])
    mixed = files | {"rig_test.c": other["rig_test.c"]}
    assert run_test_program({name: text.encode() for name, text in mixed.items()}, tmp_path)[0] == 1


@C_COMPILER
def test_a_step_that_fails_leaves_the_state(tmp_path):
    known = rig(CHAMBER, "test")
    values = {name: low for name, (low, _) in known.ends.items()}
    library = Compiled(rig_c(known, "full order", values, [driven()]), tmp_path).library
    state = (ctypes.c_double * 3)(1e5, 293.0, 293.0)
    start, end = (ctypes.c_double * 2)(0.0, 0.0), (ctypes.c_double * 2)(-0.1, 0.0)  # beyond no volume
    assert library.rig_step(start, end, ctypes.c_double(1e-3), state) == 1
    assert list(state) == [1e5, 293.0, 293.0]


def test_a_sonic_conductance_gives_the_flow_of_iso_6358():
    known = rig(CHAMBER, "test")
    values = {name: low for name, (low, _) in known.ends.items()}
    areas = network_of_run(known, "full order", values, driven()._replace(P_B=None)).areas.max(axis=1)
    for area, C in zip(areas, (1.2e-8, 1e-8), strict=True):
        flow = choked_flow(area, 6e5, 350.0, known.gas)
        # Reference: 1.185 kg/m^3 at 20 degrees.
        assert flow == pytest.approx(C * 1.185 * 6e5 * (293.15 / 350.0) ** 0.5, rel=1e-12)
