"""Run the paper's equations in GNU Octave and compare every pressure with pneumo's: `make crosscheck`.

Octave gets numbers of config/paper.yaml as they stand there, in the units of their names, and nothing else.
"""

import json
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from paper.study.paper_2006.paper_models import PAPER_MODELS
from pneumo.configuration.parameters import load, read_yaml, study
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import EXACT, PUBLISHED, study_sampling
from pneumo.storage.files import write_text

HERE = Path(__file__).parent
CONFIG = HERE.parents[1] / "config/paper.yaml"
EXPERIMENTS = ("E13", "E14")  # cylinder D in open and in closed loop
SECONDS, N = 10.0, 1.2
TOLERANCE = 1e-8  # of pressure, relative, on the same step
READINGS = ("linear", "hold", "hold_next")
OCTAVE = shutil.which("octave-cli")


def numbers(config: dict[str, Any], name: str, seconds: float) -> dict[str, float]:
    """Numbers of an experiment that Octave reads, in the configuration's units."""
    experiment = config["experiments"][name]
    cylinder = dict(config["cylinders"][experiment["cylinder"]])
    opened, closed = cylinder.pop("open_loop"), cylinder.pop("closed_loop")
    del cylinder["settling"]
    is_closed = experiment["loop"] == "closed"
    k_0 = experiment.get("k_0_W_per_K")
    if k_0 is None:  # (12), with both end faces and the wall of half the stroke
        bore, half = cylinder["bore_mm"] * 1e-3, cylinder["stroke_mm"] * 0.5e-3
        k_0 = experiment["lambda_0_W_per_m2K"] * math.pi * (bore**2 / 2 + bore * half)
    return {
        **(config["gas"] | config["supply"] | cylinder),
        "closed_loop": float(is_closed),
        "amplitude": closed["variance_m2"] ** 0.5 if is_closed else opened["amplitude_V"],
        "reverse_at": opened["reverse_at"],
        "k_p_V_per_m": closed["k_p_V_per_m"],
        "k_0_W_per_K": k_0,
        **{"duration_s": seconds, "step_s": config["step_s"], "n": N},
        "replays_read": READINGS.index((closed if is_closed else opened)["replays_read"]),
    }


def by_octave(name: str, seconds: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Full-order states by (step, state), and by signal sampling the pressures by (model, chamber, step)."""
    if OCTAVE is None:
        raise FileNotFoundError("octave-cli is not installed; Debian has it in the package octave")
    with tempfile.TemporaryDirectory() as folder:
        given, output = Path(folder, "numbers.txt"), Path(folder, "pressures.bin")
        values = numbers(read_yaml(CONFIG), name, seconds)
        given.write_text("".join(f"{key} {float(value)!r}\n" for key, value in values.items()))
        command = [OCTAVE, "--norc", "--quiet", "crosscheck.m", str(given), str(output)]
        # Octave 7 ends a script with a complaint about its own exit, so its words count only where it failed.
        run = subprocess.run(command, cwd=HERE, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if run.returncode:
            raise ArithmeticError(f"{name}: Octave: {' '.join(run.stderr.split())}")
        columns = np.fromfile(output).reshape(-1, 46)
    exact, published = columns[:, 6:].reshape(-1, 2, 2, len(PAPER_MODELS)).transpose(1, 3, 2, 0)
    return columns[:, :6], {EXACT: exact, PUBLISHED: published}


def largest(difference: np.ndarray, size: np.ndarray, h: float) -> dict[str, float]:
    """Largest relative difference and when it occurs; time is the last axis."""
    relative = abs(difference) / size
    step = int(relative.reshape(-1, relative.shape[-1]).max(axis=0).argmax())
    return {"largest_relative_difference": float(relative.max()), "t_s": round(step * h, 9)}


def compared(name: str, seconds: float = SECONDS) -> dict[str, Any]:
    """Largest differences between Octave and pneumo, full order and every model, both signal samplings."""
    paper = study(load(CONFIG))
    e = paper.experiments[name]
    e = e._replace(steps=round(seconds / e.h))
    states, pressures = by_octave(name, seconds)
    recording = record(e)
    lanes, index = grid_lanes((N,), e.plant.gas.gamma)
    result: dict[str, Any] = {"seconds": seconds, "n": N}
    full = recording.states[:, [2, 4]].T
    result["full order"] = largest(states[:, [2, 4]].T - full, full, e.h)
    for transport, theirs in pressures.items():
        cells = replay(recording, lanes, study_sampling(transport, e))
        triples = zip(PAPER_MODELS, theirs, cells.pressure[index[: len(PAPER_MODELS), 0]], strict=True)
        result[transport] = {model: largest(their - our, our, e.h) for model, their, our in triples}
    return result


def worst(comparison: dict[str, Any]) -> float:
    """Largest relative difference of a comparison."""
    parts = [comparison["full order"], *comparison[EXACT].values(), *comparison[PUBLISHED].values()]
    return max(part["largest_relative_difference"] for part in parts)


if __name__ == "__main__":
    try:
        comparisons = {name: compared(name) for name in EXPERIMENTS}
    except (FileNotFoundError, ArithmeticError) as error:
        sys.exit(f"pneumo: {error}")
    file = HERE.parents[1] / "results/evidence/crosscheck.json"
    write_text(json.dumps({"tolerance": TOLERANCE} | comparisons, indent=1) + "\n", file)
    for name, comparison in comparisons.items():
        print(f"{name}: largest relative difference of a pressure {worst(comparison):.2g}")
    if max(map(worst, comparisons.values())) > TOLERANCE:
        sys.exit(f"pneumo: Octave and pneumo differ by more than {TOLERANCE:g}")
