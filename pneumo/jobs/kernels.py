"""Kernels compiled ahead, while a core is idle, and cached on disk for the job that needs them."""

import numpy as np

from pneumo.configuration.experiment import Study
from pneumo.simulation.full_order import Recording, equilibrium
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import study_sampling
from pneumo.storage.layout import datum_dataset, recording_from


def compile_replays(study: Study) -> None:
    """Compile the replay kernels of a study, or load them from the cache, by a replay of one step at rest."""
    e = next(iter(study.experiments.values()))._replace(steps=1)
    states, still = np.tile(equilibrium(e.plant), (2, 1)), np.zeros(2)
    run = Recording(
        states=states,
        reference=still,
        u=still,
        drive=e.drive,
        plant=e.plant,
        h=e.h,
        halvings=np.zeros(1, np.int8),
        most_halvings=e.most_halvings,
    )
    stored = recording_from(datum_dataset(e, run), e)  # arrays of a file's layout, which is part of the type
    lanes, _ = grid_lanes(study.n, e.plant.gas.gamma)
    replay(stored, lanes, study_sampling("exact", e))
