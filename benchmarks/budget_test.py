"""Test of the error budget of `pneumo study` on random cylinders with an independent truth.

``nice python -m benchmarks.budget_test`` runs it in 20 minutes of processor time and writes the outcome to
paper/evidence/budget_test.nc; docs/budget-test.md has criterion and result. ``--first`` takes other seeds, on
which the method may be changed, and ``--to`` another file.
"""

import argparse
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from benchmarks.bench_rig import Rig, run_bench
from pneumo.configuration.experiment import Experiment, Plant
from pneumo.configuration.parameters import load, sonic_conductance, study, validated
from pneumo.configuration.sampling import INTERPOLATED
from pneumo.configuration.uncertain import GROUPS, QUANTITIES, Uncertain, plant_with, uncertainties
from pneumo.physics.models import MODELS, full_order_lane, lane, lane_array
from pneumo.selection.answer import answer
from pneumo.selection.cylinder_ranking import ROWS, errors_on, run_study, seeds_of, shortened
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import Recording
from pneumo.simulation.replay import replay
from pneumo.statistics.error_budget import FULL_ORDER

ROOT = Path(__file__).parents[1]
FIRST, COUNT = 530_000, 500
DURATION, PERIOD = 10.0, 5e-4  # s; period of the recorded signals
PREDICTED = 4  # drawn cylinders from which the third figure is predicted
BLOCK = 20  # cylinders after which the file is written again
MOVES = 0.02  # strokes, standard deviation


def data_sheet(rng: np.random.Generator, closed: bool) -> dict[str, Any]:
    """Configuration of a random cylinder as its data sheet describes it, in the form of the template."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    bore, stroke = float(rng.choice([16, 20, 25, 32, 40, 50, 63])), between(50, 400)
    area = np.pi / 4 * (bore * 1e-3) ** 2
    speed = between(0.4, 2.5)  # m/s, that the valve can feed
    C = 1e8 * area * speed / (1.185 * 287.0 * 293.15)
    valve: dict[str, Any] = {"C_dm3_per_sbar": C} if rng.random() < 0.5 else {"Q_n_l_per_min": 240 * C}
    if rng.random() < 0.5:
        valve["b"] = rng.uniform(0.2, 0.45)
    crossing = between(0.3, 1.5)  # s for a stroke, at the command in open loop
    cylinder = {
        "bore_mm": bore,
        "stroke_mm": stroke,
        "rod_mm": 0.4 * bore,
        "mass_kg": rng.uniform(1, 5) * (bore / 32) ** 2,
        "friction_Ns_per_m": rng.uniform(20, 80) * (bore / 32) ** 2,
        "coulomb_N": rng.uniform(0.01, 0.04) * area * 5e5,
        "valve": valve,
        "u_max_V": 10.0,
        "seed": int(rng.integers(2**31)),
        "sample_time_s": round(between(0.05, 0.5), 3),
        "open_loop": {"amplitude_V": min(10.0, 10 * stroke * 1e-3 / crossing / speed), "reverse_at": 0.9},
        "closed_loop": {
            "amplitude_mm": rng.uniform(0.05, 0.14) * stroke,
            "k_p_V_per_m": rng.uniform(5, 15) / (stroke * 1e-3),
        },
    }
    if rng.random() < 0.5:
        cylinder["dead_volume_m3"] = rng.uniform(0.03, 0.12) * area * stroke * 1e-3
    content = load(TEMPLATE).model_dump(exclude_unset=True)
    name = "closed" if closed else "open"
    content["supply"]["P_s_Pa"] = rng.uniform(5e5, 8e5)
    content["cylinders"] = {"mine": cylinder}
    content["experiments"] = {name: content["experiments"][name] | {"duration_s": DURATION}}
    content["run"] = {"experiments": [name], "seeds": 2}
    return content


def true_run(e: Experiment, plant: Plant, rng: np.random.Generator, other_wall: bool) -> Recording:
    """Run of the independent rig with the quantities of a plant, recorded with another random sequence."""
    c, of, drive = plant.cylinder, plant.conditions, e.drive
    e_A, e_PT = rng.uniform(0, 1, 2) if other_wall else (1.0, 0.5)
    stick, bend = rng.uniform(0, 1), rng.uniform(-0.02, 0.02)
    rig = Rig(
        bore=c.bore,
        rod=2 * ((c.A_A - c.A_B) / np.pi) ** 0.5,
        stroke=c.stroke,
        mass=c.M,
        coulomb=c.coulomb,
        viscous=c.k_f,
        C=1e-8 * sonic_conductance(plant.valve, plant.gas),
        b=plant.gas.critical_ratio,
        k_0=plant.k_0,
        V_A=c.V_d_A,
        V_B=c.V_d_B,
        P_s=of.P_s,
        P_0=of.P_0,
        T_amb=of.T_amb,
        inlet=of.T_in - of.T_amb,
        exhaust=plant.valve.exhaust,
        e_A=e_A,
        e_PT=e_PT,
        stick=stick,
        bend=bend,
    )
    sequence = e.excitation._replace(seed=int(rng.integers(2**31)))
    target = np.repeat(reference_series(drive, sequence, e.steps), round(e.h / PERIOD))
    rows = run_bench(rig, target, drive.k_p if drive.closed_loop else 0.0, 0, PERIOD, drive.x_reverse)
    T = np.full(len(rows), of.T_0)  # only the first is read: the run begins in equilibrium
    states = np.column_stack([rows[:, 1], rows[:, 5], rows[:, 2], T, rows[:, 3], T])
    return Recording(states, target, rows[:, 0], drive, e.plant, PERIOD, np.zeros(len(rows) - 1, np.int8), 6)


def realised(recording: Recording, plant: Plant, rows: list[tuple[str, float]]) -> np.ndarray:
    """RMS error, Pa, of models, each at an n, that are replayed on a run with a plant's numbers."""
    gamma = plant.gas.gamma
    lanes = [
        full_order_lane(gamma) if name == FULL_ORDER else lane(MODELS[name], n, gamma) for name, n in rows
    ]
    steps = len(recording.states) - 1
    cells = replay(recording._replace(plant=plant), lane_array(lanes), INTERPOLATED, steps)
    return np.where(cells.status != 0, np.nan, cells.mse).mean(axis=1) ** 0.5


def case(number: int) -> dict[str, Any] | None:
    """Study of one random cylinder, and the errors on its truth; None if its true run is of no use."""
    rng = np.random.default_rng(number)
    closed, other_wall = bool(number % 2), bool(number // 2 % 2)
    configuration = validated(data_sheet(rng, closed), [])
    configured, uncertain = study(configuration), uncertainties(configuration)["mine"]
    (e,) = configured.experiments.values()
    deviations = rng.multivariate_normal(np.zeros(len(uncertain.names)), uncertain.covariance)
    recording = true_run(e, plant_with(e.plant, uncertain.names, deviations), rng, other_wall)
    x = recording.states[:, 0]
    if not np.isfinite(recording.states).all() or x.std() < MOVES * e.plant.cylinder.stroke:
        return None
    cells = run_study(configured, 1, uncertain={"mine": uncertain})
    given = answer(cells, "mine")
    budget = given.budget
    n = {row.model: row.n if np.isfinite(row.n) else 1.0 for row in budget.rows}
    ends = {end: [getattr(budget.row(name), end) for name in ROWS] for end in ("rms", "low", "high")}
    errors = realised(recording, e.plant, [(name, n[name]) for name in ROWS])
    grid = realised(recording, e.plant, [(name, n) for name in MODELS for n in configured.n])
    rows = [(name, n[name]) for name in MODELS]
    known = np.full(len(GROUPS), np.nan)  # error of the model with the lowest expected one, group known
    taken = {g: min(budget.rows, key=lambda row: row.known[g]).model for g in budget.groups}
    for group, model in taken.items():
        inside = [QUANTITIES[name].group == group for name in uncertain.names]
        plant = plant_with(e.plant, uncertain.names, np.where(inside, deviations, 0.0))
        known[GROUPS.index(group)] = realised(recording, plant, [(model, n[model])])[0]
    others = rng.multivariate_normal(np.zeros(len(uncertain.names)), uncertain.covariance, PREDICTED)
    by_draw = np.array([_known_errors(e, uncertain, g, others, rows, m) for g, m in taken.items()])
    return {
        "cylinder": number,
        "closed": int(closed),
        "other_wall": int(other_wall),
        **{f"expected_{end}": values for end, values in ends.items()},
        "n": [n.get(name, np.nan) for name in ROWS],
        "realised": errors,
        "lowest": np.nanmin([*grid, errors[-1]]),
        "recommended": ROWS.index(given.chosen),
        "first_group": GROUPS.index(budget.groups[0]),
        "realised_known": known,
        "expected_known": [budget.lowest_if_known(g) if g in taken else np.nan for g in GROUPS],
        "predicted_first": np.mean(by_draw[0] <= 1.1 * by_draw.min(axis=0)),
        "swing": recording.states[:, [2, 4]].var(axis=0).mean() ** 0.5,
    }


def _known_errors(
    e: Experiment,
    uncertain: Uncertain,
    group: str,
    drawn: np.ndarray,
    rows: list[tuple[str, float]],
    model: str,
) -> list[float]:
    """RMS error of a model on drawn cylinders, by pneumo's own full order, if a group is known."""
    others = drawn - uncertain.alone(group, drawn)
    runs = [shortened(e).with_seed(seed) for seed in seeds_of(e, len(others))]
    plants = [plant_with(e.plant, uncertain.names, moved) for moved in others]
    errors = [errors_on(run, plant, rows) for run, plant in zip(runs, plants, strict=True)]
    return [float(mse[ROWS.index(model)].mean() ** 0.5) for mse in errors]


def dataset(cases: list[dict[str, Any]]) -> xr.Dataset:
    """Cases by cylinder, models (`row`) and groups of quantities."""
    dims: dict[str, tuple[str, ...]] = dict.fromkeys(
        ("expected_rms", "expected_low", "expected_high", "n", "realised"), ("row",)
    )
    dims |= dict.fromkeys(("realised_known", "expected_known"), ("group",))
    columns = {
        name: (("cylinder", *dims.get(name, ())), np.array([each[name] for each in cases]))
        for name in cases[0]
    }
    return xr.Dataset(columns, {"row": list(ROWS), "group": list(GROUPS)})


def main() -> None:
    """Run the test and write its file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=FIRST)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--to", type=Path, default=ROOT / "paper/evidence/budget_test.nc")
    chosen = parser.parse_args()
    commit = subprocess.run(
        ["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    attributes = {
        "title": "Error budgets of random cylinders and the errors on an independent truth, Pa",
        "commit": commit.stdout.strip(),
        "command": " ".join(["python -m benchmarks.budget_test", *sys.argv[1:]]),
    }
    cases: list[dict[str, Any]] = []
    with ProcessPoolExecutor(2) as pool:
        for tried, each in enumerate(pool.map(case, range(chosen.first, chosen.first + chosen.count)), 1):
            cases += [each] if each is not None else []
            if tried % BLOCK == 0 or tried == chosen.count:
                data = dataset(cases).assign_attrs(attributes, left_out=tried - len(cases))
                data.to_netcdf(chosen.to)


if __name__ == "__main__":
    main()
