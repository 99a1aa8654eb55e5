"""Judge `pneumo fit` on benches whose truth is known, undisturbed and with what goes wrong on real ones.

Rules, fixed before any result was seen:

- Judged is the row "full" of a fit, else the best model of the ranking: its k_0, C and both dead volumes
  (with tubes), as far as it has them.
- A parameter is *outside* if the truth is not in its 95 per cent interval; an open end sets no limit.
- It is *wrong* if it is outside and off by more than `TOLERANCE`, which is what a bench engineer would mind.
- A case is *silent* if a parameter is wrong and the fit neither refused the record nor warned.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import yaml

from benchmarks.bench_rig import U_MAX, Rig, bench_record, drawn_rig, purpose_rig
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import load, study
from pneumo.errors import InputError
from pneumo.fit.estimate import fit_measurement
from pneumo.fit.mistaken_columns import check_columns
from pneumo.fit.record.measurement import read_measurement
from pneumo.publish.text.markdown_tables import markdown_table
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.plants import configured_plant

ROOT = Path(__file__).parents[1]
TOLERANCE = {"k_0": 0.25, "C": 0.05, "V_A": 0.1, "V_B": 0.1}  # of the truth
DURATION, SHORT = 10.0, 4.0  # s
MODELS: tuple[str, ...] = ()  # beside the full order
FIRST_SEED = 5_000  # the warnings' limits were chosen on lower ones
Columns = dict[str, np.ndarray]


class Disturbance(NamedTuple):
    """Difference from an ideal bench: in the rig, in its configuration, or in the file."""

    text: str
    rig: Callable[[Rig], Rig] = lambda rig: rig
    believed: Callable[[Rig, float], Rig] = lambda rig, _sign: rig  # sign: -1 or 1, drawn
    logged: Callable[[Columns], Columns] = lambda columns: columns
    duration: float = DURATION
    supply: bool = False  # whether the supply pressure is logged


def _tubes(rig: Rig, volume: float = 12.6e-6) -> Rig:
    return rig._replace(V_A=rig.V_A + volume, V_B=rig.V_B + volume)


def _scaled(columns: Columns, factor: float, offset: float = 0.0) -> Columns:
    return columns | {name: factor * columns[name] + offset for name in ("P_A", "P_B", "P_s")}


DISTURBANCES = {
    "none": Disturbance("undisturbed"),
    "lag2": Disturbance("valve lag 2 ms", rig=lambda r: r._replace(lag=2e-3)),
    "lag5": Disturbance("valve lag 5 ms", rig=lambda r: r._replace(lag=5e-3)),
    "dead": Disturbance("dead time 4 ms", rig=lambda r: r._replace(dead_time=4e-3)),
    "null": Disturbance("null offset 2 %", rig=lambda r: r._replace(null=0.02 * U_MAX)),
    "area": Disturbance("exhaust area 0.75", rig=lambda r: r._replace(exhaust=0.75)),
    "tube": Disturbance("tubes 12.6 cm3 each", rig=_tubes),
    "sags": Disturbance("sagging supply", rig=lambda r: r._replace(weak_supply=0.5)),
    "logs": Disturbance("the same, P_s logged", rig=lambda r: r._replace(weak_supply=0.5), supply=True),
    "P_s": Disturbance("P_s wrong by 1 bar", believed=lambda r, sign: r._replace(P_s=r.P_s + sign * 1e5)),
    "stroke": Disturbance(
        "stroke wrong by 50 mm", believed=lambda r, sign: r._replace(stroke=r.stroke + sign * 0.05)
    ),
    "rod": Disturbance("rod forgotten", believed=lambda r, _: r._replace(rod=0.0)),
    "swap": Disturbance("chambers swapped", logged=lambda c: c | {"P_A": c["P_B"], "P_B": c["P_A"]}),
    "sign": Disturbance("u inverted", logged=lambda c: c | {"u": -c["u"]}),
    "gauge": Disturbance("gauge pressures", logged=lambda c: _scaled(c, 1.0, -101325.0)),
    "unit": Disturbance("bar in a column of kPa", logged=lambda c: _scaled(c, 1e-2)),
    "slow": Disturbance("100 Hz record", logged=lambda c: {name: v[::10] for name, v in c.items()}),
    "short": Disturbance("4 s record", duration=SHORT),
    "offset": Disturbance("P_A sensor off by 10 kPa", logged=lambda c: c | {"P_A": c["P_A"] + 1e4}),
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
    def warned(self) -> bool:
        """Whether the record was refused, or the fit warned of."""
        return bool(self.refused or self.warnings)


def believed_plant(rig: Rig, folder: Path) -> Plant:
    """Plant that the user configures, from the template of `pneumo init`; the dead volume is the default."""
    content = yaml.safe_load(TEMPLATE.read_text(encoding="utf-8"))
    content["supply"] |= {"P_s_Pa": rig.P_s, "P_0_per_P_s": rig.P_0 / rig.P_s}
    sizes = {"bore_mm": 1e3 * rig.bore, "stroke_mm": 1e3 * rig.stroke, "rod_mm": 1e3 * rig.rod}
    valve = {"C_dm3_per_sbar": 1e8 * rig.C, "b": rig.b}
    content["cylinders"]["mine"] |= sizes | {"valve": valve, "u_max_V": U_MAX}
    file = folder / "cylinder.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return configured_plant(study(load(file)), "mine", 1.0)


def judged(disturbance: str, seed: int, models: Sequence[str], rig: Rig | None = None) -> Outcome:
    """Outcome of a record that is made and then fitted as `pneumo fit` does."""
    d, rng = DISTURBANCES[disturbance], np.random.default_rng(seed)
    rig = d.rig(drawn_rig(rng) if rig is None else rig)
    guess = rig._replace(C=rig.C * rng.uniform(0.85, 1.15))
    believed = d.believed(guess, float(rng.choice([-1.0, 1.0])))
    columns = d.logged(bench_record(rig, rng, d.duration))
    begun = time.process_time()

    def outcome(refused: str, warnings: list[str], found: dict[str, list[float]]) -> Outcome:
        return Outcome(disturbance, seed, time.process_time() - begun, refused, warnings, found)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant = believed_plant(believed, folder)
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
        one = row.sel(parameter=parameter)
        estimate, low, high = (factor * float(one[key]) for key in ("estimate", "low", "high"))
        if np.isfinite(estimate):
            ends = low if np.isfinite(low) else -np.inf, high if np.isfinite(high) else np.inf
            found[short] = [truth, estimate, *ends]
    return outcome("", list(fit.warnings), found)


def summary(outcomes: Iterable[Outcome]) -> pd.DataFrame:
    """Counts by disturbance, and the median of each parameter's estimate over its truth."""
    rows: dict[str, dict[str, Any]] = {}
    by_name: dict[str, list[Outcome]] = {}
    for one in outcomes:
        by_name.setdefault(one.disturbance, []).append(one)
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
    heads += ["refused", "warned", "outside", "wrong", "silent"]
    rows: list[list[str]] = []
    for name, row in table.iterrows():
        label = DISTURBANCES[str(name)].text if str(name) in DISTURBANCES else str(name)
        ratios = ["" if np.isnan(row[p]) else f"{row[p]:.2f}" for p in TOLERANCE]
        counts = [f"{row[c]:.0f}" for c in ("refused", "warned", "outside", "wrong", "silent")]
        rows.append([label, f"{row['records']:.0f}", *ratios, *counts])
    total = f"Wrong in silence: {table['silent'].sum():.0f} of {len(outcomes)}."
    seconds = [o.seconds for o in outcomes if not o.refused]
    if seconds:
        total += f" Processor time of a fit: median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s."
    lines += [markdown_table(heads, rows), "", total, ""]
    for name in table.index:
        first = next(o for o in outcomes if o.disturbance == name)
        said = [first.refused] if first.refused else first.warnings
        label = DISTURBANCES[name].text if name in DISTURBANCES else name
        lines += [f"- {label} (seed {first.seed}): {text}" for text in said or ["nothing said"]]
    return "\n".join(lines) + "\n"


def write(outcomes: Sequence[Outcome], models: Sequence[str], folder: Path) -> None:
    """Write the table, and every case as JSON."""
    folder.mkdir(exist_ok=True)
    (folder / "fit_bench.md").write_text(markdown(outcomes, models), encoding="utf-8")
    found: list[dict[str, Any]] = []
    for one in outcomes:
        ends = {name: [v if np.isfinite(v) else None for v in row] for name, row in one.found.items()}
        found.append(one._asdict() | {"found": ends, "outside": one.outside, "wrong": one.wrong})
    (folder / "fit_bench.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


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
    chosen = parser.parse_args()
    outcomes: list[Outcome] = []

    def add(one: Outcome) -> None:
        outcomes.append(one)
        verdict = "refused" if one.refused else f"wrong {one.wrong}, {len(one.warnings)} warnings"
        print(f"{one.disturbance} {one.seed}: {verdict} ({one.seconds:.1f} s)", flush=True)
        write(outcomes, chosen.models, chosen.output)  # keep finished cases

    for name in chosen.only or DISTURBANCES:
        for number in range(chosen.undisturbed if name == "none" else chosen.count):
            add(judged(name, chosen.seed + number, chosen.models))
    if not chosen.only:
        purpose = judged("none", chosen.seed, chosen.models, purpose_rig())
        add(purpose._replace(disturbance="32 x 200 mm, k_0 = 0.6 W/K"))
    print(markdown(outcomes, chosen.models))


if __name__ == "__main__":
    main()
