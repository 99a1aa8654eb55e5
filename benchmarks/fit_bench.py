"""Judge `pneumo fit` on benches whose truth is known, undisturbed and with what goes wrong on real ones.

The user of a bench knows it as data sheets do: what he configures is drawn off the truth by the accuracies
that the configuration states by default. The wall's law, the rate and the resolution of the record are drawn,
and whether the piston rests on both stops at the end, as the documentation advises.

Rules, fixed before any result was seen:

- Judged is the row "full" of a fit, else the best model of the ranking: its k_0, C and both dead volumes
  (with tubes), as far as it has them.
- A parameter is *outside* if the truth is not in its 95 per cent interval; an open end sets no limit.
- It is *wrong* if it is outside and off by more than `TOLERANCE`, which is what a bench engineer would mind.
- A case is *silent* if a parameter is wrong and the fit neither refused the record nor warned.
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
import json
import re
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import yaml

from benchmarks.bench_rig import (
    P_ATM,
    POSITION_NOISE,
    PRESSURE_NOISE,
    U_MAX,
    Rig,
    bench_record,
    drawn_rig,
    purpose_rig,
)
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import Accuracy, accuracy, load, study
from pneumo.errors import InputError
from pneumo.fit.estimate import fit_measurement
from pneumo.fit.mistaken_columns import check_columns
from pneumo.fit.record.measurement import read_measurement
from pneumo.publish.text.markdown_tables import markdown_table
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/static/fit_bench.json"
TOLERANCE = {"k_0": 0.25, "C": 0.05, "V_A": 0.1, "V_B": 0.1}  # of the truth
DURATION, SHORT = 10.0, 4.0  # s
RATES = (100.0, 200.0, 500.0, 1000.0, 2000.0)  # Hz
USUAL_RATE = 1000.0  # Hz, of a disturbed record: its cause is judged, not its rate
WALL_LAWS = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5))  # exponents of area and of PT
BITS = (12, 16)
FULL_SCALE = 1.6e6  # Pa, of the pressure sensors
LIMITS = 1.96  # limits of what is stated, in standard deviations
MODELS: tuple[str, ...] = ()  # beside the full order
FIRST_SEED = 8_000  # method and warnings were developed on lower ones
TO_STOPS = 0.5  # fraction of records in which the piston rests on both stops
# What a warning says of causes that `--also` cannot fit.
SAID = {"a zero of x": ("x_zero",), "a stroke": ("stroke", "x_scale")}
VERDICTS = ("right", "tied", "none", "wrong")
Columns = dict[str, np.ndarray]


class Disturbance(NamedTuple):
    """Difference from an ideal bench: in the rig, in its configuration, or in the file."""

    text: str
    rig: Callable[[Rig], Rig] = lambda rig: rig
    believed: Callable[[Rig, float], Rig] = lambda rig, _sign: rig  # sign: -1 or 1, drawn
    logged: Callable[[Columns], Columns] = lambda columns: columns
    duration: float = DURATION
    supply: bool = False  # whether the supply pressure is logged
    cause: str = ""  # name of the cause that a warning should have
    rate: float = USUAL_RATE  # Hz
    bits: int = 0  # of the pressures, of a `SINGLE` case; 0: not quantised
    noise: float = PRESSURE_NOISE  # Pa
    stops: bool = False  # whether the piston rests on both, of a `SINGLE` case


def _tubes(rig: Rig, volume: float = 12.6e-6) -> Rig:
    return rig._replace(V_A=rig.V_A + volume, V_B=rig.V_B + volume)


def _scaled(columns: Columns, factor: float, offset: float = 0.0) -> Columns:
    return columns | {name: factor * columns[name] + offset for name in ("P_A", "P_B", "P_s")}


def _averaged(columns: Columns, samples: int) -> Columns:
    window = np.ones(samples) / samples
    means = {name: np.convolve(columns[name], window)[: len(columns[name])] for name in ("P_A", "P_B")}
    return columns | {
        name: np.concatenate([columns[name][:samples], v[samples:]]) for name, v in means.items()
    }


def _late(columns: Columns, samples: int) -> Columns:
    x = columns["x"]
    return columns | {"x": np.concatenate([np.repeat(x[0], samples), x[:-samples]])}


def _rig(**fields: float) -> Callable[[Rig], Rig]:
    return lambda rig: rig._replace(**fields)


DISTURBANCES = {
    "none": Disturbance("undisturbed"),
    "lag2": Disturbance("valve lag 2 ms", rig=_rig(lag=2e-3)),
    "lag5": Disturbance("valve lag 5 ms", rig=_rig(lag=5e-3)),
    "dead": Disturbance("dead time 4 ms", rig=_rig(dead_time=4e-3)),
    "null": Disturbance("null offset 2 %", rig=_rig(null=0.02 * U_MAX)),
    "area": Disturbance("exhaust area 0.75", rig=_rig(exhaust=0.75), cause="exhaust"),
    "tube": Disturbance("tubes 12.6 cm3 each", rig=_tubes),
    "sags": Disturbance("sagging supply", rig=_rig(weak_supply=0.5), cause="sag"),
    "logs": Disturbance("the same, P_s logged", rig=_rig(weak_supply=0.5), supply=True),
    "P_s": Disturbance(
        "P_s wrong by 1 bar", believed=lambda r, sign: r._replace(P_s=r.P_s + sign * 1e5), cause="P_s"
    ),
    "stroke": Disturbance(
        "stroke wrong by 50 mm",
        believed=lambda r, sign: r._replace(stroke=r.stroke + sign * 0.05),
        cause="stroke",
    ),
    "rod": Disturbance("rod forgotten", believed=lambda r, _: r._replace(rod=0.0), cause="A_B"),
    "swap": Disturbance("chambers swapped", logged=lambda c: c | {"P_A": c["P_B"], "P_B": c["P_A"]}),
    "sign": Disturbance("u inverted", logged=lambda c: c | {"u": -c["u"]}),
    "gauge": Disturbance("gauge pressures", logged=lambda c: _scaled(c, 1.0, -101325.0)),
    "unit": Disturbance("bar in a column of kPa", logged=lambda c: _scaled(c, 1e-2)),
    "slow": Disturbance("100 Hz record", logged=lambda c: {name: v[::10] for name, v in c.items()}),
    "short": Disturbance("4 s record", duration=SHORT),
    "offset": Disturbance(
        "P_A sensor off by 10 kPa", logged=lambda c: c | {"P_A": c["P_A"] + 1e4}, cause="offset_A"
    ),
    "scale": Disturbance("x too large by 3 %", logged=lambda c: c | {"x": 1.03 * c["x"]}, cause="x_scale"),
    "zero": Disturbance("zero of x off by 5 mm", logged=lambda c: c | {"x": c["x"] + 5e-3}, cause="x_zero"),
    "skew": Disturbance("x late by 3 ms", logged=lambda c: _late(c, 3), cause="skew"),
    "mean": Disturbance("P averaged over 5 ms", logged=lambda c: _averaged(c, 5), cause="filter"),
    "band": Disturbance("dead band 3 %", rig=_rig(dead_band=0.03 * U_MAX), cause="dead_band"),
    "play": Disturbance("hysteresis 1 %", rig=_rig(hysteresis=0.005 * U_MAX), cause="hysteresis"),
    "piston": Disturbance("piston leak 2 %", rig=_rig(piston_leak=0.02), cause="piston_leak"),
    "leak": Disturbance("valve leak 2 %", rig=_rig(valve_leak=0.02), cause="valve_leak"),
    "side": Disturbance("valve's side B 15 % smaller", rig=_rig(side_B=0.85), cause="C_B"),
    "warm": Disturbance("T_amb drifts 7 K", rig=_rig(warming=0.7), cause="drift"),
}


def _off(**factors: float) -> Callable[[Rig, float], Rig]:
    """Configured rig with some fields multiplied."""
    return lambda rig, _sign: rig._replace(**{name: f * getattr(rig, name) for name, f in factors.items()})


def _b_off(by: float) -> Callable[[Rig, float], Rig]:
    return lambda rig, _sign: rig._replace(b=rig.b + by)


# One thing off at a time, of the bench of a first user, whose wall has another law than the full order.
SINGLE = {
    "exact": Disturbance("configured exactly"),
    "b005": Disturbance("b too large by 0.005", believed=_b_off(0.005)),
    "b02": Disturbance("b too large by 0.02", believed=_b_off(0.02)),
    "b05": Disturbance("b too large by 0.05", believed=_b_off(0.05)),
    "P_s02": Disturbance("P_s too large by 0.2 %", believed=_off(P_s=1.002)),
    "x3": DISTURBANCES["scale"],
    "zero": DISTURBANCES["zero"],
    "stroke6": Disturbance("stroke too long by 3 %", believed=_off(stroke=1.03)),
    "x3_stops": DISTURBANCES["scale"]._replace(text="x too large by 3 %, both stops", stops=True),
    "zero_stops": DISTURBANCES["zero"]._replace(text="zero of x off by 5 mm, both stops", stops=True),
    "stroke6_stops": Disturbance(
        "stroke too long by 3 %, both stops", believed=_off(stroke=1.03), cause="stroke", stops=True
    ),
    "rate100": Disturbance("100 Hz, controller too", rate=100.0),
    "rate200": Disturbance("200 Hz, controller too", rate=200.0),
    "bits": Disturbance("12 bit, no noise", bits=12, noise=0.0),
    "good": Disturbance("sensors of 0.1 kPa", noise=100.0),
    "poor": Disturbance("sensors of 10 kPa", noise=1e4),
    "crosses": Disturbance("a heavy piston: pressures cross P_s", rig=_rig(mass=3.0)),
}


class Outcome(NamedTuple):
    """Result of the fit of one case."""

    disturbance: str
    seed: int
    seconds: float  # of the processor
    refused: str  # message, or empty
    warnings: list[str]
    found: dict[str, list[float]]  # truth, estimate, low, high by judged parameter

    @property
    def outside(self) -> list[str]:
        """Parameters whose interval does not hold the truth."""
        return [name for name, (truth, _, low, high) in self.found.items() if truth < low or truth > high]

    @property
    def wrong(self) -> list[str]:
        """Those of them that are off by more than `TOLERANCE`."""
        return [
            name
            for name in self.outside
            if abs(self.found[name][1] / self.found[name][0] - 1) > TOLERANCE[name]
        ]

    @property
    def named(self) -> str:
        """How warnings name the cause: right, tied, none or wrong."""
        text = " ".join(self.warnings)
        names = {*re.findall(r"--also (\w+)", text)}
        names |= {name for words, causes in SAID.items() if words in text for name in causes}
        cause = (SINGLE | DISTURBANCES)[self.disturbance].cause
        if not names:
            return "none"
        return "wrong" if cause not in names else "right" if len(names) == 1 else "tied"

    @property
    def warned(self) -> bool:
        """Whether the record was refused, or the fit warned of."""
        return bool(self.refused or self.warnings)


def imperfect(rig: Rig, known: Accuracy, rng: np.random.Generator) -> tuple[Rig, dict[str, float]]:
    """Rig as its user knows it, and the keys of its section supply that a rig does not have."""

    def off(size: float) -> float:
        return float(rng.normal(0.0, size / LIMITS))

    supply = {
        "P_atm_Pa": P_ATM * (1 + off(known.P_atm)),
        "T_amb_K": rig.T_amb + off(known.T_amb),
        "T_in_K": rig.T_amb + off(known.T_in),
    }
    guess = rig._replace(
        b=float(np.clip(rig.b + off(known.b), 0.05, 0.6)),
        exhaust=rig.exhaust * (1 + off(known.exhaust)),
        P_s=rig.P_s * (1 + off(known.P_s)),
        bore=rig.bore * (1 + off(known.bore)),
        stroke=rig.stroke + off(known.stroke),
    )
    return guess, supply


def imperfect_sensors(columns: Columns, known: Accuracy, bits: int, rng: np.random.Generator) -> Columns:
    """Columns as sensors of the stated accuracy log them, quantised."""
    result, step = dict(columns), FULL_SCALE / 2**bits
    x_zero, x_scale = (rng.normal(0.0, size / LIMITS) for size in (known.x_zero, known.x_scale))
    result["x"] = columns["x"] * (1 + x_scale) + x_zero
    for name in ("P_A", "P_B", "P_s"):
        P = columns[name] * (1 + rng.normal(0.0, known.P_gain / LIMITS))
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


def judged(disturbance: str, seed: int, models: Sequence[str], rig: Rig | None = None) -> Outcome:
    """Outcome of a record of a random bench that is made and then fitted as `pneumo fit` does."""
    d, rng = DISTURBANCES[disturbance], np.random.default_rng(seed)
    known = accuracy()
    rig = drawn_rig(rng) if rig is None else rig
    e_A, e_PT = WALL_LAWS[rng.integers(len(WALL_LAWS))]
    rate, bits, stops = float(rng.choice(RATES)), int(rng.choice(BITS)), bool(rng.random() < TO_STOPS)
    guess, supply = imperfect(rig._replace(C=rig.C * rng.uniform(0.85, 1.15)), known, rng)
    believed = d.believed(guess, float(rng.choice([-1.0, 1.0])))
    rig = d.rig(rig)._replace(e_A=e_A, e_PT=e_PT)
    period = 1 / (rate if disturbance == "none" else d.rate)
    columns = bench_record(rig, rng, d.duration, period, stops=stops)
    columns = d.logged(imperfect_sensors(columns, known, bits, rng))
    return fitted_outcome(disturbance, d, seed, models, rig, believed, supply, columns)


def judged_alone(case: str, seed: int, models: Sequence[str]) -> Outcome:
    """Outcome of a record of the first user's bench with one thing off, from `SINGLE`."""
    d, rng = SINGLE[case], np.random.default_rng(seed)
    rig = d.rig(purpose_rig())._replace(e_PT=0.0)
    columns = bench_record(rig, rng, d.duration, 1 / d.rate, (d.noise, POSITION_NOISE), d.stops)
    if d.bits:
        step = FULL_SCALE / 2**d.bits
        columns |= {name: np.round(columns[name] / step) * step for name in ("P_A", "P_B")}
    believed = d.believed(rig._replace(C=1.1 * rig.C), 1.0)
    return fitted_outcome(case, d, seed, models, rig, believed, {}, d.logged(columns))


def fitted_outcome(
    case: str,
    d: Disturbance,
    seed: int,
    models: Sequence[str],
    rig: Rig,
    believed: Rig,
    supply: Mapping[str, float],
    columns: Columns,
) -> Outcome:
    """Outcome of the fit of a record of a rig whose user believes in another."""
    begun = time.process_time()

    def outcome(refused: str, warnings: list[str], found: dict[str, list[float]]) -> Outcome:
        return Outcome(case, seed, time.process_time() - begun, refused, warnings, found)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant = believed_plant(believed, folder, supply, believed.exhaust)
        units = {"t": "t_s", "u": "u_V", "x": "x_m", "P_A": "P_A_kPa", "P_B": "P_B_kPa", "P_s": "P_s_kPa"}
        kept = {name: values for name, values in _scaled(columns, 1e-3).items() if d.supply or name != "P_s"}
        table = pd.DataFrame(kept).rename(columns=units)
        table.to_csv(folder / "bench.csv", index=False, float_format="%.9g")
        try:
            measurement = read_measurement(folder / "bench.csv", plant)
            check_columns(measurement, plant)
            fit = fit_measurement(measurement, plant, models)
        except InputError as error:
            return outcome(str(error).replace(f"{folder}/", ""), [], {})
    row = fit.data.sel(model="full" if "full" in fit.models else fit.models[0])
    to_C = believed.C / plant.valve.k_xu
    wanted = {
        "k_0": ("k_0", 1.0, rig.k_0),
        "C": ("k_xu", to_C, rig.C),
        "V_A": ("V_d_A", 1.0, rig.V_A),
        "V_B": ("V_d_B", 1.0, rig.V_B),
    }
    found: dict[str, list[float]] = {}
    for short, (parameter, factor, truth) in wanted.items():
        row_of_parameter = row.sel(parameter=parameter)
        estimate, low, high = (factor * float(row_of_parameter[key]) for key in ("estimate", "low", "high"))
        if np.isfinite(estimate):
            ends = low if np.isfinite(low) else -np.inf, high if np.isfinite(high) else np.inf
            found[short] = [truth, estimate, *ends]
    return outcome("", list(fit.warnings), found)


def summary(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """Counts by disturbance, and the median of each parameter's estimate over its truth."""
    rows: dict[str, dict[str, Any]] = {}
    by_name: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        by_name.setdefault(outcome.disturbance, []).append(outcome)
    for name, group in by_name.items():
        row: dict[str, Any] = {"records": len(group)}
        for parameter in TOLERANCE:
            ratios = [o.found[parameter][1] / o.found[parameter][0] for o in group if parameter in o.found]
            row[parameter] = float(np.median(ratios)) if ratios else np.nan
        row["refused"] = sum(bool(o.refused) for o in group)
        row["warned"] = sum(bool(o.warnings) for o in group)
        row["outside"] = sum(bool(o.outside) for o in group)
        row["wrong"] = sum(bool(o.wrong) for o in group)
        row["silent"] = sum(bool(o.wrong) and not o.warned for o in group)
        row |= {f"cause {verdict}": sum(o.named == verdict for o in group) for verdict in VERDICTS}
        rows[name] = row
    return pd.DataFrame.from_dict(rows, orient="index")


def markdown(outcomes: Sequence[Outcome], models: Sequence[str]) -> str:
    """Table of `summary`, then what the fit said of the first record of each disturbance."""
    table = summary(outcomes)
    limits = ", ".join(f"{name} {100 * part:.0f} %" for name, part in TOLERANCE.items())
    lines = [
        f"Records of {DURATION:g} s at 1 kHz from random benches, fitted with"
        f" {', '.join(['the full order', *models])}. Medians of estimate over truth; records refused, warned"
        f" of, with a truth outside its interval, wrong (outside and off by more than {limits}), and wrong in"
        " silence. A fit that leaves far more than noise is warned of and gives no intervals, so nothing is"
        " outside them.",
        "",
    ]
    heads = ["disturbance", "records", "k_0", "C", "V_d A", "V_d B"]
    heads += [
        "refused",
        "warned",
        "outside",
        "wrong",
        "silent",
        *(f"cause {verdict}" for verdict in VERDICTS),
    ]
    rows: list[list[str]] = []
    for name, row in table.iterrows():
        label = (SINGLE | DISTURBANCES)[str(name)].text
        ratios = ["" if np.isnan(row[p]) else f"{row[p]:.2f}" for p in TOLERANCE]
        counts = [f"{row[c]:.0f}" for c in heads[6:]]
        rows.append([label, f"{row['records']:.0f}", *ratios, *counts])
    total = f"Wrong in silence: {table['silent'].sum():.0f} of {len(outcomes)}."
    seconds = [o.seconds for o in outcomes if not o.refused]
    if seconds:
        total += f" Processor time of a fit: median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s."
    lines += [markdown_table(heads, rows), "", total, "", coverage_text(outcomes), ""]
    for name in table.index:
        first = next(o for o in outcomes if o.disturbance == name)
        said = [first.refused] if first.refused else first.warnings
        label = (SINGLE | DISTURBANCES)[str(name)].text
        lines += [f"- {label} (seed {first.seed}): {text}" for text in said or ["nothing said"]]
    return "\n".join(lines) + "\n"


def held(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """By parameter: intervals, those that hold the truth, and the median error of the estimate."""
    rows: dict[str, dict[str, float]] = {}
    for parameter in TOLERANCE:
        found = [case.found[parameter] for case in outcomes if parameter in case.found]
        holds = [low <= truth <= high for truth, _, low, high in found]
        errors = [abs(estimate / truth - 1) for truth, estimate, _, _ in found]
        if found:
            rows[parameter] = {"intervals": len(found), "held": sum(holds), "error": float(np.median(errors))}
    return pd.DataFrame.from_dict(rows, orient="index")


def coverage_text(outcomes: Sequence[Outcome]) -> str:
    """How often intervals held the truth, by parameter, and median errors."""
    groups = {
        "undisturbed records": [outcome for outcome in outcomes if outcome.disturbance == "none"],
        "records without a warning": [outcome for outcome in outcomes if not outcome.warned],
    }
    lines: list[str] = []
    for text, group in groups.items():
        parts = [
            f"{name} {row['held']:.0f} of {row['intervals']:.0f} (median error {100 * row['error']:.1f} %)"
            for name, row in held(group).iterrows()
        ]
        lines.append(f"Intervals that hold the truth, of {text}: {', '.join(parts)}.")
    return "\n".join(lines)


def write(outcomes: Sequence[Outcome], models: Sequence[str], folder: Path) -> None:
    """Write the table, and every case as JSON."""
    folder.mkdir(exist_ok=True)
    (folder / "fit_bench.md").write_text(markdown(outcomes, models), encoding="utf-8")
    records: list[dict[str, Any]] = []
    for outcome in outcomes:
        ends = {name: [v if np.isfinite(v) else None for v in row] for name, row in outcome.found.items()}
        records.append(
            outcome._asdict() | {"found": ends, "outside": outcome.outside, "wrong": outcome.wrong}
        )
    (folder / "fit_bench.json").write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")


def for_the_page(folder: Path) -> None:
    """Write counts of the cases that `write` left in a folder to docs/static/fit_bench.json, for fit.md."""
    outcomes = kept(folder)
    table = summary(outcomes)
    table = table.astype(object).where(table.notna(), None)
    table.insert(0, "text", [DISTURBANCES[str(name)].text for name in table.index])
    undisturbed = [outcome for outcome in outcomes if outcome.disturbance == "none"]
    content = {
        "table": table.to_dict(orient="index"),
        "undisturbed": held(undisturbed).to_dict(orient="index"),
        "unwarned": held([o for o in outcomes if not o.warned]).to_dict(orient="index"),
        "seconds": float(np.median([o.seconds for o in outcomes if not o.refused])),
    }
    PAGE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def kept(folder: Path) -> list[Outcome]:
    """Outcomes that `write` left in a folder."""
    outcomes: list[Outcome] = []
    for one in json.loads((folder / "fit_bench.json").read_text(encoding="utf-8")):
        ends = (np.nan, np.nan, -np.inf, np.inf)
        found = {
            name: [end if v is None else v for v, end in zip(row, ends, strict=True)]
            for name, row in one["found"].items()
        }
        texts = one["refused"], one["warnings"]
        outcomes.append(Outcome(one["disturbance"], one["seed"], one["seconds"], *texts, found))
    return outcomes


def main() -> None:
    """Judge records of every disturbance and write results/fit_bench.md and .json."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--count", type=int, default=3, help="records of each disturbance [3]")
    parser.add_argument("--undisturbed", type=int, default=20, help="undisturbed records [20]")
    parser.add_argument("--only", nargs="*", choices=[*DISTURBANCES], help="these disturbances [all]")
    parser.add_argument(
        "--models", nargs="*", default=[*MODELS], help="models to fit beside the full order [none]"
    )
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help=f"of the first record [{FIRST_SEED}]")
    parser.add_argument("--output", type=Path, default=ROOT / "results", help="folder [results]")
    parser.add_argument("--single", action="store_true", help="one thing off at a time, of one bench")
    parser.add_argument("--minutes", type=float, default=np.inf, help="no case is begun after these [no end]")
    parser.add_argument("--resume", action="store_true", help="keep the cases that the folder has")
    parser.add_argument("--page", action="store_true", help="only write the folder's counts for fit.md")
    parser.add_argument("--jobs", type=int, default=1, help="records at a time [1]")
    chosen = parser.parse_args()
    if chosen.page:
        for_the_page(chosen.output)
        return
    outcomes = kept(chosen.output) if chosen.resume else []

    def add(outcome: Outcome) -> None:
        outcomes.append(outcome)
        verdict = "refused" if outcome.refused else f"wrong {outcome.wrong}, {len(outcome.warnings)} warnings"
        print(f"{outcome.disturbance} {outcome.seed}: {verdict} ({outcome.seconds:.1f} s)", flush=True)
        write(outcomes, chosen.models, chosen.output)  # keep finished cases

    if chosen.single:
        for case in SINGLE:
            add(judged_alone(case, chosen.seed, chosen.models))
        for one in outcomes:
            rows = [
                f"{p} {v[1]:.4g} ({v[2]:.4g} to {v[3]:.4g}), truth {v[0]:.4g}" for p, v in one.found.items()
            ]
            print(f"{SINGLE[one.disturbance].text}: {'; '.join(rows)} {one.warnings}")
        return
    cases: list[tuple[Any, ...]] = [
        (name, chosen.seed + number, chosen.models)
        for name in chosen.only or DISTURBANCES
        for number in range(chosen.undisturbed if name == "none" else chosen.count)
    ]
    if not chosen.only:
        cases.append(("none", chosen.seed - 1, chosen.models, purpose_rig()))
    np.random.default_rng(0).shuffle(cases)
    cases = cases[len(outcomes) :]
    ends = time.monotonic() + 60 * chosen.minutes
    with ProcessPoolExecutor(chosen.jobs) as pool:
        for future in [pool.submit(judged, *case) for case in cases]:
            add(future.result())
            if time.monotonic() > ends:
                pool.shutdown(cancel_futures=True)
                break
    print(markdown(outcomes, chosen.models))


if __name__ == "__main__":
    main()
