"""Print the SHA-256 of what the core computes: runs, settling runs, replays; other builds must agree."""

import hashlib

import numpy as np

from paper.study.settling_run import settle
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from tests.paper_study import STUDY, lasting

digest = hashlib.sha256()
for e in (lasting("E06", 3.0), lasting("E11", 3.0)):
    recording, (lanes, _) = record(e), grid_lanes(STUDY.n, e.plant.gas.gamma)
    arrays = [recording.states, recording.u, *settle(e), *replay(recording, lanes, EXACT_SAMPLING, 10)]
    for array in arrays:
        digest.update(np.asarray(array).tobytes())
print(digest.hexdigest())
