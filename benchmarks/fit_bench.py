"""Judge `pneumo fit` on benches whose truth is known, undisturbed and with what goes wrong on real ones.

The user of a bench knows it as data sheets do: what he configures is drawn off the truth by the accuracies
that the configuration states by default. The wall's law, the rate and the resolution of the record are drawn,
and whether the piston rests on both stops at the end, as the documentation advises.

Rules, fixed before any result was seen:

- Judged is the row "full" of a fit, else the best model of the ranking: its k_0, C and both dead volumes
  (with tubes), as far as it has them.
- A parameter is *outside* if the truth is not in its 95 per cent interval; an open end sets no limit.
- It is *wrong* if it is outside and off by more than `fit_counts.TOLERANCE`, which is what an engineer minds.
- A case is *silent* if a parameter is wrong in green and the fit neither refused the record nor warned.
- Of a disturbance with a cause that a warning can name, it is *right* (the only one named), *none* (none is
  named), *tied* (there, among others) or *wrong* (others only). A warning that gives both a stroke and a
  scale of x as the reason names both.
- Cases are judged in an order drawn beforehand; if `--minutes` ends the run, those done are a random sample.

What is asked of all cases (decision 155):

- median of |k_0 - truth| below 10 per cent, of undisturbed cases and of all without a warning;
- of undisturbed cases, intervals of each parameter hold the truth in 93 to 97 per cent, and at most 5 per
  cent are warned of;
- no case is silent, and no cause is named wrongly.
"""

import argparse
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import yaml

import pneumo
from benchmarks.bench_rig import P_ATM, U_MAX, Rig, bench_record, drawn_rig, purpose_rig
from benchmarks.disturbances import DISTURBANCES, Columns, scaled
from benchmarks.fit_counts import ROOT, Outcome, for_the_page, summary, write
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import load, study
from pneumo.configuration.priors import Accuracy, accuracy
from pneumo.errors import InputError
from pneumo.fitting.fit_result import FitResult
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

RATES = (100.0, 200.0, 500.0, 1000.0, 2000.0)  # Hz
WALL_LAWS = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5))  # exponents of area and of PT
BITS = (12, 16)
FULL_SCALE = 1.6e6  # Pa, of the pressure sensors
LIMITS = 1.96  # limits of what is stated, in standard deviations
MODELS: tuple[str, ...] = ()  # beside the full order
FIRST_SEED = 9_000  # method and warnings were developed on lower ones
TO_STOPS = 0.5  # fraction of records in which the piston rests on both stops


def imperfect(rig: Rig, known: Accuracy, rng: np.random.Generator) -> tuple[Rig, dict[str, float]]:
    """Rig as its user knows it, and the keys of its section supply that a rig does not have."""

    def off(size: float) -> float:
        return float(rng.normal(0.0, size / LIMITS))

    supply = {
        "P_atm_Pa": P_ATM * (1 + off(known["P_atm"])),
        "T_amb_K": rig.T_amb + off(known["T_amb"]),
        "T_in_K": rig.T_amb + off(known["T_in"]),
    }
    guess = rig._replace(
        b=float(np.clip(rig.b + off(known["b"]), 0.05, 0.6)),
        exhaust=rig.exhaust * (1 + off(known["exhaust"])),
        P_s=rig.P_s * (1 + off(known["P_s"])),
        bore=rig.bore * (1 + off(known["bore"])),
        stroke=rig.stroke + off(known["stroke"]),
    )
    return guess, supply


def imperfect_sensors(columns: Columns, known: Accuracy, bits: int, rng: np.random.Generator) -> Columns:
    """Columns as sensors of the stated accuracy log them, quantised."""
    result, step = dict(columns), FULL_SCALE / 2**bits
    x_zero, x_scale = (rng.normal(0.0, size / LIMITS) for size in (known["x_zero"], known["x_scale"]))
    result["x"] = columns["x"] * (1 + x_scale) + x_zero
    for name in ("P_A", "P_B", "P_s"):
        P = columns[name] * (1 + rng.normal(0.0, known["P_gain_A"] / LIMITS))
        result[name] = np.round(P / step) * step
    return result


def believed_plant(
    rig: Rig, folder: Path, supply: Mapping[str, float] = MappingProxyType({}), exhaust: float = 1.0
) -> Plant:
    """Plant that the user configures, from the template of `pneumo init`; the dead volume is the default."""
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["supply"] |= {"P_s_Pa": rig.P_s, "P_0_per_P_s": rig.P_0 / rig.P_s, **supply}
    sizes = {"bore_mm": 1e3 * rig.bore, "stroke_mm": 1e3 * rig.stroke, "rod_mm": 1e3 * rig.rod}
    valve = {"C_dm3_per_sbar": 1e8 * rig.C, "b": rig.b, "exhaust_ratio": exhaust}
    content["cylinders"]["mine"] |= sizes | {"valve": valve, "u_max_V": U_MAX}
    file = folder / "cylinder.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return configured_plant(study(load(file)), "mine", 1.0)


class Case(NamedTuple):
    """A bench, as it is and as its user knows it, and the record that was made there."""

    rig: Rig
    believed: Rig
    columns: Columns
    supply: Mapping[str, float] = MappingProxyType({})  # keys of the section supply that a rig does not have
    logs_supply: bool = False


def drawn_case(disturbance: str, seed: int, rig: Rig | None = None, duration: float | None = None) -> Case:
    """Record of a random bench; its rig and duration, s, may be given."""
    d, rng = DISTURBANCES[disturbance], np.random.default_rng(seed)
    known = accuracy()
    rig = drawn_rig(rng) if rig is None else rig
    e_A, e_PT = WALL_LAWS[rng.integers(len(WALL_LAWS))]
    rate, bits, stops = float(rng.choice(RATES)), int(rng.choice(BITS)), bool(rng.random() < TO_STOPS)
    guess, supply = imperfect(rig._replace(C=rig.C * rng.uniform(0.85, 1.15)), known, rng)
    believed = d.believed(guess, float(rng.choice([-1.0, 1.0])))
    rig = d.rig(rig)._replace(e_A=e_A, e_PT=e_PT)
    period = 1 / (rate if disturbance == "none" else d.rate)
    columns = bench_record(rig, rng, duration or d.duration, period, stops=stops)
    columns = d.logged(imperfect_sensors(columns, known, bits, rng))
    return Case(rig, believed, columns, supply, d.supply)


def judged(disturbance: str, seed: int, models: Sequence[str], rig: Rig | None = None) -> Outcome:
    """Outcome of a record of a random bench that is made and then fitted as `pneumo fit` does."""
    return fitted_outcome(disturbance, seed, models, drawn_case(disturbance, seed, rig))


def fitted(case: Case, models: Sequence[str]) -> tuple[FitResult, Plant]:
    """Fit of a case, as `pneumo fit` makes it, and the configured plant; `InputError` if it is refused."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        believed_plant(case.believed, folder, case.supply, case.believed.exhaust)
        units = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_kPa", "P_B": "P_B_kPa", "P_s": "P_s_kPa"}
        columns = scaled(case.columns, 1e-3)
        logged = {name: values for name, values in columns.items() if case.logs_supply or name != "P_s"}
        table = pd.DataFrame(logged).rename(columns=units)
        table.to_csv(folder / "bench.csv", index=False, float_format="%.9g")
        try:
            found = pneumo.fit(folder / "bench.csv", folder / "cylinder.yaml", "mine", models=models)
        except InputError as error:
            raise InputError(str(error).replace(f"{folder}/", "")) from None
        return found.result, found.plant


def fitted_outcome(name: str, seed: int, models: Sequence[str], case: Case) -> Outcome:
    """Outcome of the fit of a record of a rig whose user believes in another."""
    begun = time.process_time()
    try:
        fit, plant = fitted(case, models)
    except InputError as error:
        return Outcome(name, seed, time.process_time() - begun, str(error), [], {}, {})
    estimates = fit.estimates("full" if "full" in fit.models else fit.models[0])
    to_C, rig = case.believed.C / plant.valve.k_xu, case.rig
    wanted = {
        "k_0": ("k_0", 1.0, rig.k_0),
        "C": ("k_xu", to_C, rig.C),
        "V_A": ("V_d_A", 1.0, rig.V_A),
        "V_B": ("V_d_B", 1.0, rig.V_B),
    }
    found: dict[str, list[float]] = {}
    lights: dict[str, str] = {}
    for short, (parameter, factor, truth) in wanted.items():
        if parameter in estimates:
            value, low, high = estimates[parameter].scaled(factor)
            ends = low if np.isfinite(low) else -np.inf, high if np.isfinite(high) else np.inf
            found[short] = [truth, value, *ends]
            if parameter in fit.judgements:
                lights[short] = fit.judgements[parameter][0]
    return Outcome(name, seed, time.process_time() - begun, "", list(fit.warnings), found, lights)


def main() -> None:
    """Judge records of every disturbance and write results/fit_bench.json."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--count", type=int, default=3, help="records of each disturbance [3]")
    parser.add_argument("--undisturbed", type=int, default=20, help="undisturbed records [20]")
    parser.add_argument("--only", nargs="*", choices=[*DISTURBANCES], help="these disturbances [all]")
    parser.add_argument(
        "--models", nargs="*", default=[*MODELS], help="models to fit beside the full order [none]"
    )
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help=f"of the first record [{FIRST_SEED}]")
    parser.add_argument("--output", type=Path, default=ROOT / "results", help="folder [results]")
    parser.add_argument("--page", action="store_true", help="only write the folder's counts for fit.md")
    parser.add_argument("--jobs", type=int, default=1, help="records at a time [1]")
    chosen = parser.parse_args()
    if chosen.page:
        for_the_page(chosen.output)
        return
    outcomes: list[Outcome] = []
    cases: list[tuple[Any, ...]] = [
        (name, chosen.seed + number, chosen.models, None)
        for name in chosen.only or DISTURBANCES
        for number in range(chosen.undisturbed if name == "none" else chosen.count)
    ]
    if not chosen.only:
        cases.append(("none", chosen.seed - 1, chosen.models, purpose_rig()))
    np.random.default_rng(0).shuffle(cases)
    with ProcessPoolExecutor(chosen.jobs) as pool:
        for outcome in pool.map(judged, *zip(*cases, strict=True)):
            outcomes.append(outcome)
            verdict = "refused" if outcome.refused else f"wrong {outcome.wrong}"
            print(f"{outcome.disturbance} {outcome.seed}: {verdict} ({outcome.seconds:.1f} s)", flush=True)
            write(outcomes, chosen.output)  # keep finished cases
    print(summary(outcomes).T.to_string(float_format="{:.3g}".format))


if __name__ == "__main__":
    main()
