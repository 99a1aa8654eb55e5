"""Numbers of results on pages and in README: `make numbers` writes docs/numbers.yaml.

A page names a number where it belongs, as `{{ cluster.cylinder }}`.
readme_blocks.py has the blocks of README.
"""

import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

import cluster
import cost
import drift
import fit_bench
import measured_air
import measurements
import opening_picture
import simulators
import which_model
import xarray as xr
import yaml
from fragments import NUMBERS, ROOT, stored_numbers

from benchmarks.fleet_law import law_figure
from pneumo.catalogue import coefficient_times_length, measured_conductances
from pneumo.export.step_cost import FILE as STEP_COST
from pneumo.publish.style import save
from pneumo.storage.kept_evidence import KEPT

RESULTS = ROOT / "results"
FIGURES = ("measurements", "pulses", "vessel")  # copies of results/figures/

Numbers = dict[str, dict[str, Any]]  # by page or source, then by name


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    """Text of several lines, such as a table, as a block."""
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


yaml.SafeDumper.add_representer(str, _text)


def named(numbers: dict[str, str], tables: dict[str, str]) -> dict[str, str]:
    """Join numbers and tables, with names that a page can write: `M5/M8 none` is M5_over_M8_none."""
    both = numbers | {f"table {name}": text for name, text in tables.items()}
    return {re.sub(r"\W+", "_", name.replace("/", " over ")): text for name, text in both.items()}


def from_kept_files() -> Numbers:
    """Numbers from files that are in the repository: paper/evidence, docs/static, the catalogue."""
    measured, air = (xr.load_dataset(KEPT / f"{name}.nc") for name in ("measurements", "measured_air"))
    bench = fit_bench.stored()
    fleet, slurm = (cluster.stored(name) for name in ("fleet", "slurm"))
    steps = json.loads(STEP_COST.read_text(encoding="utf-8"))
    k_0 = [measured.k_0 for measured in measured_conductances()]
    return {
        "catalogue": {
            "factor": f"{coefficient_times_length()[1]:.1f}",
            "k_0": f"{min(k_0):g} to {max(k_0):g}",
        },
        "cluster": named(cluster.numbers(fleet, slurm), cluster.tables(fleet, slurm)),
        "cost": named(cost.numbers(steps), cost.tables(steps)),
        "drift": named({}, drift.tables()),
        "fit_bench": named(fit_bench.numbers(bench), fit_bench.tables(bench)),
        "measured_air": named(
            measured_air.numbers(air),
            measured_air.tables(air) | {"walls": measured_air.wall_table(air, measured)},
        ),
        "measurements": named(measurements.numbers(measured), measurements.tables(measured)),
        "simulators": named(simulators.numbers(simulators.stored()), simulators.tables(simulators.stored())),
    }


def missed(verdict: dict[str, Any]) -> dict[str, str]:
    """Missed cells of Tables 7 to 9, percentiles and swings, and chi-squares over the spread of seeds."""
    items = [item for item in verdict["items"] if item["status"] == "missed"]
    by_table = {row["table"]: row for row in verdict["highlights"]["fit"]["tables"]}
    of_9, swings = by_table["Table 9"], [item["relative"] for item in items if item["id"].startswith("S1.")]
    made = {
        "missed_of_tables": f"{sum(item['table'] in (7, 8, 9) for item in items)}",
        "chi_square_9": _chi_square(of_9["printed"]),
        "chi_square_9_meant": _chi_square(of_9["meant"]),
        "swings_missed": f"{len(swings)}",
        "swings_by": f"{100 * min(swings):.0f} to {100 * max(swings):.0f} %",
    }
    for share in ("10", "90"):
        of_share = by_table[f"{share} % percentiles of Figs 9 and 11"]["meant"]
        missed_ones = sum(item["id"].endswith(f".p{share}") for item in items)
        made |= {
            f"p{share}_missed": f"{missed_ones} of {of_share['numbers']}",
            f"p{share}_chi_square": _chi_square(of_share),
        }
    return made


def _chi_square(fit: dict[str, Any]) -> str:
    return f"{fit['chi_square']:.0f} for {fit['numbers']} numbers"


def from_the_study(results: Path) -> Numbers:
    """Numbers from results/, the whole study of the paper."""
    levels, mse = which_model.over_levels(results), which_model.by_experiment(results)
    verdict = json.loads((results / "verdict.json").read_text(encoding="utf-8"))
    return {
        "table_7": {"table": (results / "table7.md").read_text(encoding="utf-8").strip()},
        "verdict": {kind: verdict[kind] for kind in ("counts", "counts_by_basis", "headline", "near_misses")}
        | {"measured": verdict["highlights"]["measured"]}
        | missed(verdict),
        "which_model": named(which_model.numbers(levels, mse), which_model.tables(levels, mse)),
    }


def write() -> None:
    """Write docs/numbers.yaml; without results/ its numbers stay as they are."""
    numbers = stored_numbers() | from_kept_files()
    if (RESULTS / "verdict.json").exists():
        numbers |= from_the_study(RESULTS)
    head = "# Made by `make numbers` from results/ and paper/evidence/; not edited by hand.\n"
    text = yaml.safe_dump(numbers, allow_unicode=True, sort_keys=False, width=10_000)
    NUMBERS.write_text(head + text, encoding="utf-8")


if __name__ == "__main__":
    if (RESULTS / "evidence/slurm.json").exists():
        shutil.copyfile(RESULTS / "evidence/slurm.json", cluster.STATIC / "slurm.json")
    write()
    for name in FIGURES:
        if (RESULTS / f"figures/{name}.svg").exists():
            shutil.copyfile(RESULTS / f"figures/{name}.svg", cluster.STATIC / f"{name}.svg")
    with tempfile.TemporaryDirectory() as scratch:
        if (RESULTS / "verdict.json").exists():
            drawn = save(opening_picture.errors_figure(RESULTS), Path(scratch, "errors"))[1]
            shutil.copyfile(drawn, opening_picture.PICTURE)
        shutil.copyfile(
            save(law_figure(cluster.stored("fleet")), Path(scratch, "fleet"))[0], cluster.STATIC / "fleet.svg"
        )
