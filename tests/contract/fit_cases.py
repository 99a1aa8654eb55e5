"""Synthetic records of the contract of fits, and what `pneumo fit` finds in them.

Cylinders come from the independent bench `benchmarks.bench_rig`, closed chambers from `closed_truth`.
`python -m tests.contract.fit_cases` accepts the present results.
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from closed_truth import Truth, compressed, measured, moving, pressures  # noqa: E402

from benchmarks.disturbances import DISTURBANCES  # noqa: E402
from benchmarks.fit_bench import drawn_case, fitted  # noqa: E402
from benchmarks.fit_counts import named_causes  # noqa: E402
from pneumo.configuration.parameters import load, study  # noqa: E402
from pneumo.errors import InputError  # noqa: E402
from pneumo.fitting.closed.closed_fit import fit_closed  # noqa: E402
from pneumo.fitting.fit_result import FitResult  # noqa: E402
from pneumo.selection.cylinder_template import TEMPLATE  # noqa: E402
from pneumo.selection.plants import configured_plant  # noqa: E402

TABLE = HERE / "fits.jsonl"
DURATION = 3.0  # s, of a cylinder's record
NOT_REPORTED = ("start_",)  # first states, whose estimates depend on the record's first samples alone
Found = dict[str, Any]  # `refused`, `causes`, `warned`, and `models`: value and ends by model and parameter


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None


def _found(fit: FitResult, truth: Mapping[str, float]) -> Found:
    models = {
        model: {
            name: [_number(end) for end in interval]
            for name, interval in fit.estimates(model).items()
            if not name.startswith(NOT_REPORTED)
        }
        for model in fit.models
    }
    found = {"causes": sorted(named_causes(fit.warnings)), "warned": bool(fit.warnings), "models": models}
    return found | {"truth": {name: _number(value) for name, value in truth.items()}}


def cylinder(disturbance: str, seed: int, models: Sequence[str] = ()) -> Found:
    """`pneumo fit` of a bench with a disturbance."""
    case = drawn_case(disturbance, seed, duration=DURATION)
    try:
        fit, plant = fitted(case, models)
    except InputError:
        return {"refused": True}
    true = case.rig
    k_xu = plant.valve.k_xu * true.C / case.believed.C
    return _found(fit, {"k_0": true.k_0, "k_xu": k_xu, "V_d_A": true.V_A, "V_d_B": true.V_B})


def closed(
    truth: Truth,
    motion: Callable[[np.ndarray], np.ndarray] = moving,
    seed: int = 1,
    noise: float = 200.0,
    open_B: bool = False,
) -> Found:
    """`pneumo fit --closed both`."""
    plant, t = configured_plant(study(load(TEMPLATE)), "mine", 1.0), 5e-3 * np.arange(1600)
    P = pressures(truth, plant, motion, t)
    P = np.array([P[0], np.full_like(P[1], 1.2e5)]) if open_B else P
    record = measured(motion(t), P, 5e-3, seed, noise)
    pairs = zip("AB", truth.k_0, truth.V_d, strict=True)
    of_sides = {
        name: value for side, k, V in pairs for name, value in ((f"k_0_{side}", k), (f"V_d_{side}", V))
    }
    fit = fit_closed(record, plant)
    return _found(fit, of_sides | {"leak": truth.leak})


LEAKING = Truth((0.25, 0.18), (5e-6, 6e-6), T=(300.0, 288.0), leak=2e-10)
EVEN = Truth((0.3, 0.3), (6.3e-6, 6.3e-6))
CASES: dict[str, Callable[[], Found]] = {
    **{f"fit undisturbed {seed}": partial(cylinder, "none", seed) for seed in range(3, 9)},
    **{f"fit {name}": partial(cylinder, name, 2) for name in DISTURBANCES if name != "none"},
    "fit M6 M8 M10": partial(cylinder, "none", 11, ("M6", "M8", "M10")),
    "fit M5 M9 of a sagging supply": partial(cylinder, "sags", 12, ("M5", "M9")),
    "fit M8 of tubes": partial(cylinder, "tube", 13, ("M8",)),
    "closed leaking": partial(closed, LEAKING),
    "closed even": partial(closed, EVEN),
    "closed constant wall": partial(closed, EVEN._replace(e_A=0.0, e_PT=0.0), seed=2),
    "closed noise": partial(closed, LEAKING, seed=3, noise=2e3),
    "closed held": partial(closed, EVEN, compressed, seed=4),
    "closed held leaking": partial(closed, EVEN._replace(leak=5e-10), compressed, seed=5),
    "closed open B": partial(closed, EVEN, seed=6, open_B=True),
    "closed weak wall": partial(closed, EVEN._replace(k_0=(0.02, 0.02)), seed=7),
}


def main() -> None:
    """Accept the present results: write the table."""
    from time import process_time

    lines: list[str] = []
    for name, case in CASES.items():
        begun = process_time()
        lines.append(json.dumps({"case": name} | case()) + "\n")
        print(f"{process_time() - begun:.1f} s: {lines[-1][:150]}", flush=True)
    TABLE.write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
