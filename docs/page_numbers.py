"""Numbers of results on pages and in README: `make numbers` writes docs/numbers.yaml.

A page names a number where it belongs, as `{{ cluster.cylinder }}`. Those of `frozen` belong to finished
studies and stay as the last run of their code wrote them.
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import budget_counts
import cost
import drift
import measured_air
import numpy as np
import opening_picture
import vented
import xarray as xr
import yaml
from fragments import NUMBERS, ROOT, stored_numbers

from paper.study import PAPERS
from paper.study.kept_evidence import KEPT
from paper.study.pages.verdict_page import SIMULATORS
from paper.study.paper_2006.summary import LEVELS
from paper.study.samplings import STUDY_SAMPLINGS
from paper.study.text.markdown_tables import markdown_table as table
from paper_verdict.facts import (
    AGREES,
    EXPLAINED,
    MISPRINT,
    NOT_JUDGED,
    SCATTER,
    UNEXPLAINED,
    headline_text,
)
from paper_verdict.text import deviation_text
from pneumo.catalogue import coefficient_times_length, measured_conductances
from pneumo.physics.models import MODELS
from pneumo.publish.style import save
from pneumo.publish.text.terminal_tables import BUDGET_TITLE

OUTSIDE = (SCATTER, EXPLAINED, UNEXPLAINED)  # statuses of numbers that are not within their tolerance
RESULTS, STATIC = ROOT / "results", ROOT / "docs/static"

Numbers = dict[str, dict[str, Any]]  # by page or source, then by name


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    """Text of several lines, such as a table, as a block."""
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style="|" if "\n" in text else None)


yaml.SafeDumper.add_representer(str, _text)


def _stored(file: Path) -> Any:
    return json.loads(file.read_text(encoding="utf-8"))


def from_kept_files() -> Numbers:
    """Numbers from files that are in the repository: paper/evidence, docs/static, the catalogue."""
    measured, air = (xr.load_dataset(KEPT / f"{name}.nc") for name in ("measurements", "measured_air"))
    k_0 = [measured.k_0 for measured in measured_conductances()]
    return {
        "at_work": position_control(xr.load_dataset(KEPT / "at_work.nc")),
        "catalogue": {
            "factor": f"{coefficient_times_length()[1]:.1f}",
            "k_0": f"{min(k_0):g} to {max(k_0):g}",
        },
        "budget_test": budget_counts.numbers(
            *(xr.load_dataset(KEPT / f"{name}.nc") for name in ("budget_test", "budget_test_repeated"))
        ),
        "cost": cost.numbers(_stored(STATIC / "cost.json")),
        "drift": drift.tables(),
        "fit_bench": fit_bench(_stored(STATIC / "fit_bench.json")),
        "measured_air": measured_air.numbers(air),
        "measurements": measured_air.gas_spring_numbers(measured),
        "simulators": simulators(_stored(PAPERS / "2006" / SIMULATORS)),
    }


def position_control(at_work: xr.Dataset) -> dict[str, str]:
    """How much a position controller's error depends on the model, with the right k_0."""
    loss = at_work["loss"].sel(bound="estimate", factor=1.0)  # error over that of the best model

    def largest(use: str) -> str:
        return f"{100 * (loss.sel(use=f'controller, {use}').max().item() - 1):.1f} %"

    following = loss.sel(use="controller, following, none")
    M1_over_M6 = 100 * (following.sel(compared="M1") / following.sel(compared="M6") - 1)
    lower = M1_over_M6.where(M1_over_M6 < 0, drop=True)
    higher = M1_over_M6.where(M1_over_M6 > 0, drop=True)
    return {
        "with_steps": largest("tracking, none"),
        "without_steps": largest("following, none"),
        "both_measured": largest("following, both"),
        "M1_lower": f"{-lower.max().item():.0f} to {-lower.min().item():.0f} %",
        "M1_lower_on": f"{lower.size}",
        "M1_higher": f"{higher.min().item():.0f} to {higher.max().item():.0f} %",
        "M1_higher_on": f"{higher.size}",
    }


def fit_bench(bench: dict[str, Any]) -> dict[str, str]:
    """Counts that `python -m benchmarks.fit_bench --page` wrote."""
    none, every = bench["table"]["none"], bench["table"].values()
    held = [100 * row["held"] / row["intervals"] for row in bench["undisturbed"].values()]
    return {
        "cases": f"{sum(row['records'] for row in every)}",
        "undisturbed": f"{none['records']}",
        "error": f"{100 * bench['undisturbed']['k_0']['error']:.1f}",
        "lowest_held": f"{min(held):.0f}",
        "highest_held": f"{max(held):.0f}",
        "warned": f"{100 * none['warned'] / none['records']:.0f} %",
        "silent": f"{sum(row['silent'] for row in every)}",
        "named_wrong": f"{sum(row['cause wrong'] for row in every)}",
    }


def simulators(stored: list[dict[str, Any]]) -> dict[str, str]:
    """Who reproduces the paper how well, by `python -m benchmarks.simulators`."""
    cells = [
        [row["name"], f"{row['table_7']:.3f}", f"{row['table_9']:.3f}", f"{row['table_8']['exact']} of 96"]
        for row in stored
    ]
    heads = ["runs by", "RMS of ln(MSE/printed), Table 7", "Table 9", "equal n, Table 8"]
    return {"table_simulators": table(heads, cells)}


def from_the_study(results: Path) -> Numbers:
    """Numbers from results/, the whole study of the paper."""
    verdict = _stored(results / "verdict.json")
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    headlines = {
        "compared": f"{len(verdict['items'])}",
        "conclusion": conclusion(verdict),
        "unexplained": words[verdict["headline"]["statuses"][UNEXPLAINED]],
        "explained": words[verdict["headline"]["statuses"][EXPLAINED]],
        "headline": headline_text(verdict["headline"]),
        "second": headline_text(_stored(results / "2007/verdict.json")["headline"]),
    }
    return {
        "verdict": headlines | missed(verdict) | {"places": places(verdict)},
        "look": {"output": output_of_readme()},
        "which_model": wrong_conductance(results) | {"table_levels": levels(results)},
    }


def conclusion(verdict: dict[str, Any]) -> str:
    """How many numbers are reproduced, and whether the advice to take M7 is."""
    statuses = Counter(item["status"] for item in verdict["items"])
    judged = statuses.total() - statuses[NOT_JUDGED]
    reproduced = statuses[AGREES] + statuses[SCATTER]
    of_item = {item["id"]: item["status"] for item in verdict["items"]}
    assert of_item["S4.best_choice"] in (EXPLAINED, UNEXPLAINED)  # as the last sentence says
    assert of_item["S4.M7_mu"] == of_item["S4.M7_sigma"] == MISPRINT
    return (
        f"{reproduced} of {judged} judged numbers are reproduced, {statuses[SCATTER]} of them within the"
        " scatter of random numbers. The advice to take M7 is not: the text quotes M8's errors."
    )


def output_of_readme() -> str:
    """What README's look at the results prints."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(import pneumo\n.*?)```", readme, re.DOTALL)
    assert code, "README.md opens no results"
    done = subprocess.run(
        [sys.executable, "-c", code[1]], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return done.stdout.rstrip()


def places(verdict: dict[str, Any]) -> str:
    """Table with a row for each table and figure of the paper of which numbers were judged.

    The largest deviation is that of the numbers outside their tolerance, misprints left out.
    """
    statuses = {AGREES: "agree", SCATTER: "within scatter"} | {
        s: s for s in (MISPRINT, EXPLAINED, UNEXPLAINED)
    }
    head = [
        "numbers of",
        "judged",
        *statuses.values(),
        "largest deviation outside tolerance (%)",
        "free choices",
    ]
    rows = list[list[str]]()
    for place in (place for place in verdict["places"] if place["judged"]):
        counts = [str(place["statuses"].get(status, "")) for status in statuses]
        outside = [
            item["relative"]
            for item in verdict["items"]
            if item["place"] == place["name"] and item["agreement"] is None and item["status"] in OUTSIDE
        ]
        largest = max((relative for relative in outside if relative is not None), key=abs, default=None)
        choices = str(place["choices"] or "")
        rows.append(
            [
                place["name"],
                str(place["judged"]),
                *counts,
                deviation_text(largest).removesuffix(" %"),
                choices,
            ]
        )
    return "\n".join("|".join(["", *cells, ""]) for cells in (head, ["---"] * len(head), *rows))


def wrong_conductance(results: Path) -> dict[str, str]:
    """Errors of the full order with a wrong k_0, and of the reduced model that is best on average.

    Also the experiments in which the former is worse than the best reduced model there.
    """
    errors: list[xr.DataArray] = []
    ratios: list[xr.DataArray] = []
    for file in sorted((results / "exact/traces").glob("*.nc")):
        with xr.open_dataset(file) as traces:
            edges = [*traces["edge"].values, traces["t"].values[-1]]
            widths = xr.DataArray(np.diff(edges), dims="edge")
            mse = traces["mean_square"].sel(choice="best").mean("chamber").weighted(widths).mean("edge")
            errors.append(mse.load())
            ratios.append(mse / mse.sel(model=list(MODELS)).min())
    rms = xr.concat(errors, "run").mean("run") ** 0.5 / 1e3  # as in report.html
    best = rms.sel(model=list(MODELS)).idxmin("model").item()
    result = {"best": best, "best_error": f"{rms.sel(model=best).item():#.2g}"}
    for end in ("low", "high"):
        ratio = xr.concat(ratios, "run").sel(model=f"full, {end} k_0")
        worse = int((ratio > 1).sum())
        result[f"{end}_error"] = f"{rms.sel(model=f'full, {end} k_0').item():#.2g}"
        result |= {f"{end}_worse": f"{worse}", f"{end}_most": f"{ratio.max().item():.1f}"}
    return result


def missed(verdict: dict[str, Any]) -> dict[str, str]:
    """Missed cells of Tables 7 to 9, percentiles and swings, and chi-squares over the spread of seeds."""
    items = [i for i in verdict["items"] if i["agreement"] is None and i["status"] != NOT_JUDGED]
    by_table = {row["table"]: row for row in verdict["highlights"]["fit"]["tables"]}
    swings = [item["relative"] for item in items if item["id"].startswith("S1.")]

    def percentiles(part: str) -> str:
        count = sum(item["id"].endswith(f".p{part}") for item in items)
        return f"{count} of {by_table[f'{part} % percentiles of Figs 9 and 11']['meant']['numbers']}"

    def chi_square(kind: str) -> str:
        fit = by_table["Table 9"][kind]
        return f"{fit['chi_square']:.0f} for {fit['numbers']} numbers"

    return {
        "chi_square_9": chi_square("printed"),
        "chi_square_9_meant": chi_square("meant"),
        "swings_missed": f"{len(swings)}",
        "swings_by": f"{100 * min(swings):.0f} to {100 * max(swings):.0f} %",
        "p90_missed": percentiles("90"),
    }


def levels(results: Path) -> str:
    """Mean square error and best n of each model, by level of wall heat and signal sampling."""
    columns = {}
    for sampling in STUDY_SAMPLINGS:
        with xr.open_dataset(results / sampling / "statistics.nc") as statistics:
            for level in LEVELS:
                columns[level, sampling] = statistics[["mse", "constant_n"]].sel(level=level).load()

    def cell(model: str, at: xr.Dataset) -> str:
        error = at["mse"].sel(model=model).item() / 1e6
        text = f"{error:.0f}" if error >= 100 else f"{error:#.3g}"
        return f"{text} ({at['constant_n'].sel(model=model).item():g})" if MODELS[model].has_n else text

    ordered = [(level, sampling) for level in LEVELS for sampling in STUDY_SAMPLINGS]
    models = columns[ordered[0]]["model"].values
    body = [[model, *(cell(model, columns[column]) for column in ordered)] for model in models]
    return table(["model", *(", ".join(column) for column in ordered)], body)


def from_the_template() -> Numbers:
    """Answer of `pneumo study` for the cylinder of `pneumo init`, and its stroke by every program."""
    pneumo = Path(sys.executable).with_name("pneumo")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([pneumo, "init", "my.yaml"], cwd=folder, check=True, capture_output=True)
        done = subprocess.run(
            [pneumo, "study", "my.yaml"], cwd=folder, check=True, capture_output=True, text=True
        )
    lines = [line.rstrip() for line in done.stdout.splitlines()]
    budget = lines.index(BUDGET_TITLE)
    after = next(i for i, line in enumerate(lines) if line.startswith("- After a"))
    end = next(i for i, line in enumerate(lines) if i > after and line.startswith(("- ", "Next:")))
    first = re.match(r".*? over strokes\s+into\s+rest\.", "\n".join(lines[:budget]), re.DOTALL)
    assert first, "the answer has another form"
    answer = "\n".join([first[0], "...", *lines[after:end]])
    return {"study": {"answer": answer}, "vented": vented.tables()}


def write() -> None:
    """Write docs/numbers.yaml; without results/ its numbers stay as they are."""
    numbers = stored_numbers() | from_kept_files() | from_the_template()
    if (RESULTS / "verdict.json").exists():
        numbers |= from_the_study(RESULTS)
    head = "# Made by `make numbers` from results/ and paper/evidence/; `frozen` is of finished studies.\n"
    text = yaml.safe_dump(numbers, allow_unicode=True, sort_keys=False, width=10_000)
    NUMBERS.write_text(head + text, encoding="utf-8")


if __name__ == "__main__":
    write()
    if (RESULTS / "figures/measurements.svg").exists():
        shutil.copyfile(RESULTS / "figures/measurements.svg", STATIC / "measurements.svg")
    with tempfile.TemporaryDirectory() as scratch:
        budget = budget_counts.picture(xr.load_dataset(KEPT / "budget_test.nc"))
        shutil.copyfile(save(budget, Path(scratch, "budget"))[0], STATIC / "budget_test.svg")
        if (RESULTS / "verdict.json").exists():
            drawn = save(opening_picture.verdict_figure(RESULTS), Path(scratch, "verdict"))[1]
            shutil.copyfile(drawn, opening_picture.PICTURE)
