"""Kernels that are compiled ahead are those that later jobs call."""

from numba import typeof
from paper_study import STUDY, lasting

from pneumo.jobs.kernels import compile_replays
from pneumo.simulation import signals, vectorised
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.storage.files import read, write
from pneumo.storage.layout import datum_dataset, recording_from


def test_replays_of_stored_runs_find_their_kernel_compiled(tmp_path, monkeypatch):
    called = []

    def spy(first, inputs, halvings, *rest):
        called.append([typeof(each) for each in (first, inputs, halvings, *rest)])
        return len(halvings)

    def spy_on_inputs(*given):
        called.append([typeof(each) for each in given])

    monkeypatch.setattr(vectorised, "_replay", spy)
    monkeypatch.setattr(signals, "_block_inputs", spy_on_inputs)
    compile_replays(STUDY)
    compiled = called.copy()
    e = lasting("E12", 0.01)  # closed loop, where the first experiment is in open loop
    write(datum_dataset(e, record(e)), tmp_path / "E12.nc", {})
    lanes, _ = grid_lanes(STUDY.n, e.plant.gas.gamma)
    stored = recording_from(read(tmp_path / "E12.nc"), e)
    replay(stored, lanes, study_sampling(PUBLISHED, e), e.pressure_stride)
    assert len(called) > len(compiled) == 2
    assert all(types in compiled for types in called)
