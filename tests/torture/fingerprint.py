"""Print SHA-256 of what the core computes for a study, to compare processors.

It needs no library but those of configuration and core, so it runs in an emulator of another processor too.
"""

import hashlib
import sys
from pathlib import Path

import numpy as np

from paper.study.samplings import STUDY_SAMPLINGS, study_sampling
from paper.study.settling_run import settle
from pneumo.configuration.parameters import load, study
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay

ROOT = Path(__file__).parents[2]


def main(*files: str) -> None:
    """Print one hash for each kind of result of the paper's study, with configurations merged over it."""
    s = study(load(ROOT / "config/paper.yaml", *(ROOT / file for file in files)))
    hashes = {name: hashlib.sha256() for name in ("runs", "settling", *STUDY_SAMPLINGS)}
    for e in s.experiments.values():
        recording = record(e)
        for array in (recording.states, recording.u, recording.halvings):
            hashes["runs"].update(array.tobytes())
        for value in settle(e):
            hashes["settling"].update(np.asarray(value).tobytes())
        lanes, _ = grid_lanes(s.n, e.plant.gas.gamma)
        for name in STUDY_SAMPLINGS:
            for array in replay(recording, lanes, study_sampling(name, e), e.pressure_stride):
                hashes[name].update(array.tobytes())
    for name, of in hashes.items():
        print(f"{name}: {of.hexdigest()}")


if __name__ == "__main__":
    main(*sys.argv[1:])
