"""The manuscript as PDF: its numbers from results, its text and layout in ``paper/manuscript``.

`manuscript_numbers` returns every number of the text; the Typst source reads them from a JSON file, none is
typed there.
"""

import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import typst
import xarray as xr
from numpy.typing import ArrayLike

from pneumo.configuration.experiment import Study
from pneumo.configuration.study_json import from_json
from pneumo.equations.system import FULL_ORDER
from pneumo.evidence.random_cylinders.contest_statistics import LIMIT, answer
from pneumo.evidence.sensitivity.alternatives import INLET
from pneumo.export.step_cost import step_costs
from pneumo.papers.paper_2006.summary import LEVELS
from pneumo.physics.models import MODELS
from pneumo.publish.text.formatting import percent_text, with_interval
from pneumo.publish.text.todays_answer import todays_answer
from pneumo.simulation.signals import EXACT, STUDY_SAMPLINGS
from pneumo.statistics.intervals import CONFIDENCE
from pneumo.statistics.model_pairs import REFINEMENT_PAIRS
from pneumo.statistics.ranking import MATERIAL
from pneumo.storage.files import atomic, read, read_json

QUOTED = ("M7", "M8", "M10")  # models whose error budget the text quotes: section 4 ranks these
ENDS = ("value", "low", "high")
STATED = ("claim", "published", "exact", "interval", "stands", "why")  # keys of a statement about models
CLAIMED = {  # printed numbers quoted in the text -> item of the verdict
    "of_M6": "S4.M7_40",
    "of_classical": "S4.M7_10",
    "mu": "S4.M7_mu",
    "sigma": "S4.M7_sigma",
    "replays": "S4.runs",
}


def manuscript_numbers(results: Iterable[Path]) -> dict[str, Any]:
    """Return every number of the manuscript as text, by section; lists are rows of tables.

    `results` are files of results and evidence, chosen by their names.
    """
    files = {file.name: file for file in results}
    study = from_json(read_json(files["parameters.json"]))
    verdict = json.loads(read_json(files["verdict.json"]))
    claims = json.loads(read_json(files["findings.json"]))["claims"]
    answers = [row["stands"] for row in claims]
    return {
        "confidence": percent_text(CONFIDENCE),
        "setup": _setup(study),
        "verdict": _verdict(verdict),
        "identified": _identified(read(files["identification.nc"])),
        "budget": _budget(read(files["error_budget.nc"])),
        "ensemble": _ensemble(read(files["ensemble.nc"])),
        "floor": _floor(read(files["floor.nc"])),
        "variants": _variants(read(files["variants.nc"], "ratio", "share", "counted")),
        "cylinders": _cylinders(read(files["cylinders.nc"])),
        "contest": _contest(
            *(read(files[f"{name}.nc"]) for name in ("contest", "measured_air", "partly_known"))
        ),
        "statements": [{key: row[key] for key in STATED} for row in claims if row["headline"]],
        "standing": {answer: str(answers.count(answer)) for answer in ("yes", "in part", "depends", "no")}
        | {"all": str(len(answers))},
        "models": [_model(name) for name in MODELS],
    }


def _contest(contest: xr.Dataset, air: xr.Dataset, partly_known: xr.Dataset) -> dict[str, Any]:
    costs = step_costs()
    full, model, polynomial = (costs[row].instructions for row in (FULL_ORDER, "M8", "M8 with a polynomial"))
    words = [
        {key: re.sub("[*`]", "", cell) for key, cell in row._asdict().items()}
        for row in todays_answer(contest, air, partly_known)
    ]
    return {
        "cylinders": str(contest.sizes["cylinder"]),
        "held_out": str(contest["cylinders"].sel(part="all").item()),
        "limit": f"{LIMIT:g}",
        "answer": answer(contest),
        "cost": {"as exported": f"{full / model:.2f}", "polynomial": f"{full / polynomial:.2f}"},
        "advice": words,
    }


def _model(name: str) -> dict[str, str]:
    row = MODELS[name]
    indices = [
        n.replace("gamma", "γ") if isinstance(n, str) else f"{n:g}" for n in (row.n_V, row.n_in, row.n_out)
    ]
    return {
        "name": name,
        "index": indices[0] if len(set(indices)) == 1 else ", ".join(indices),
        "temperature": row.temperature,
        "mixing": "yes" if row.mixing else "no",
        "wall": row.wall,
    }


def _setup(study: Study) -> dict[str, Any]:
    experiments = study.experiments.values()
    cylinders = {e.cylinder: e for e in experiments if not e.drive.closed_loop}
    per_experiment = sum(len(study.n) if model.has_n else 1 for model in MODELS.values())
    leaks = (e.push.leak / (e.plant.valve.k_xu * e.plant.valve.u_max) for e in experiments)
    first = next(iter(experiments))
    return {
        "step": f"{1e3 * first.h:g} ms",
        "leak": percent_text(max(leaks), 1),
        "experiments": str(len(study.experiments)),
        "n": str(len(study.n)),
        "replays": str(per_experiment * len(study.experiments)),
        "simulated": f"{sum(e.duration for e in experiments) / 3600:.1f} h",
        "seeds": {name: str(e.excitation.seed) for name, e in cylinders.items()},
        "amplitude": {name: f"{e.excitation.amplitude:.3g} V" for name, e in cylinders.items()},
        "P_s": f"{first.plant.conditions.P_s / 1e5:g} bar",
    }


def _verdict(verdict: Mapping[str, Any]) -> dict[str, Any]:
    highlights, counts = verdict["highlights"], verdict["counts"]
    scores, transport = highlights["scores"], highlights["transport"]
    rows = {row["model"]: row for row in highlights["wrong_row"] if row["source"] == "printed"}
    printed = {item["id"]: f"{item['printed']} {item['unit']}".rstrip() for item in verdict["items"]}
    exact = {row["level"]: row["quotients"]["M8/M7"] for row in transport if row["source"] == EXACT}
    table_8, table_5 = scores["table_8"], scores["table_5"]
    return {
        "counts": _texts(counts),
        "by_basis": {basis: _texts(numbers) for basis, numbers in verdict["counts_by_basis"].items()},
        "headline": {basis: _texts(verdict["headline"][basis]) for basis in ("measured", "fitted")},
        **{group: _texts(numbers) for group, numbers in highlights["measured"].items()},
        "places": str(len(verdict["errata"])),
        "claimed": {key: printed[item] for key, item in CLAIMED.items()},
        "exact": {level: percent_text(quotient) for level, quotient in exact.items()},
        "missed_share": percent_text(counts["missed"] / counts["items"], 1),
        "errata": [
            {key: erratum[key] for key in ("where", "printed", "meant")} for erratum in verdict["errata"]
        ],
        "scores": {
            **{f"table_{i}": percent_text(scores[f"table_{i}_mse"]["rms_of_ln_ratio"], 1) for i in (7, 9)},
            "table_8": f"{table_8['exact']} of {table_8['cells']}",
            "table_8_close": str(table_8["exact_or_close"] - table_8["exact"]),
            "table_5": f"{table_5['exact_or_close']} of {table_5['cells']}",
        },
        "wrong_row": {
            model: {name: percent_text(rows[model][name]) for name in ("of_M6", "of_classical")}
            | {name: f"{rows[model][name]:.0f} Pa" for name in ("mu", "sigma")}
            for model in ("M7", "M8")
        },
        "transport": [
            {"level": row["level"], "source": row["source"]}
            | {model: f"{row['mse'][model] / 1e6:.2f}" for model in row["mse"]}
            | {name: f"{quotient:.2f}" for name, quotient in row["quotients"].items()}
            for row in transport
        ],
        "by_experiment": {name: _span(highlights["by_experiment"][name]) for name in STUDY_SAMPLINGS},
    }


def _texts(numbers: Mapping[str, int]) -> dict[str, str]:
    return {"all" if name == "items" else name: str(number) for name, number in numbers.items()}


def _identified(identified: xr.Dataset) -> dict[str, Any]:
    def text(cylinder: str, name: str, digits: int) -> str:
        part = identified.sel(cylinder=cylinder, parameter=name)
        return with_interval([part[key].item() for key in ("estimate", "low", "high")], digits)

    shown = {"M": 2, "k_f": 0, "stop": 2}  # digits after the point
    cylinders = identified["cylinder"].values
    return {cylinder: {name: text(cylinder, name, shown[name]) for name in shown} for cylinder in cylinders}


def _budget(budget: xr.Dataset) -> dict[str, Any]:
    def rms(level: str, model: str) -> dict[str, str]:
        cell = budget.sel(level=level, model=model)
        mse = {part: cell[f"level_{part}_error"].item() for part in ("model", "transport")}
        return {part: f"{value**0.5 / 1e3:.2f} kPa" for part, value in mse.items()}

    return {level: {model: rms(level, model) for model in QUOTED} for level in LEVELS}


def _ensemble(ensemble: xr.Dataset) -> dict[str, Any]:
    def ratios(pair: str, level: str) -> dict[str, str]:
        at = ensemble.sel(ratio=pair, level=level)
        return {
            f"{transport} {averaged}": with_interval(
                [at[f"ratio_{end}"].sel(transport=transport, averaged=averaged).item() for end in ENDS], 2
            )
            for transport in STUDY_SAMPLINGS
            for averaged in ("mean", "geometric")
        }

    least = ensemble["ratio_resolvable"].sel(ratio="M8/M7", level="overall", averaged="mean")
    extremes = ensemble["experiment_ratio_value"]
    return {
        "sets": str(ensemble["seed_sets"].item()),
        "failed": str(int(ensemble["failed_sets"].sum())),
        "rows": [
            {"ratio": pair, "level": level} | ratios(pair, level)
            for pair in REFINEMENT_PAIRS
            for level in (*LEVELS, "overall")
        ],
        "resolvable": {name: percent_text(least.sel(transport=name).item() - 1) for name in STUDY_SAMPLINGS},
        "extremes": {
            pair: {name: _span(extremes.sel(ratio=pair, transport=name)) for name in STUDY_SAMPLINGS}
            for pair in (*REFINEMENT_PAIRS, "M6/M7")
        },
    }


def _span(values: ArrayLike, digits: int = 2) -> dict[str, str]:
    """Lowest and highest value as text."""
    return {"lowest": f"{np.min(values):.{digits}f}", "highest": f"{np.max(values):.{digits}f}"}


def _floor(floor: xr.Dataset) -> dict[str, Any]:
    """Ratios of theory and formula to the measured floor, over all experiments and times between samples."""
    ms = 1e3 * floor["period"]
    linear = floor.sel(transport="linear")
    formula, at_1_ms = linear["formula"] / linear["measured"], linear["measured"].sel(period=1e-3)
    return {
        "experiments": str(floor.sizes["experiment"]),
        "shortest": f"{ms.min().item():g} ms",
        "longest": f"{ms.max().item():g} ms",
        "theory": _span(floor["predicted"] / floor["measured"]),
        "formula": _span(formula),
        "formula_open": _span(formula.isel(experiment=floor["loop"].values == "open")),
        "lowest": f"{at_1_ms.min().item():.0f} Pa",
        "highest": f"{at_1_ms.max().item():.0f} Pa",
    }


def _variants(variants: xr.Dataset) -> dict[str, Any]:
    """Number of alternatives under which each refinement pays; exact signals, mean over experiments."""
    ratios = variants.sel(transport=EXACT, criterion="mean")
    inlet = ratios["ratio"].sel(pair="M8/M7", alternative=["inlet.colder", "inlet.warmer"])

    def pays(**labels: str) -> str:
        cell = ratios[["counted", "share"]].sel(labels)
        return f"{round((cell['share'] * cell['counted']).item())} of {cell['counted'].item():.0f}"

    return {
        "rows": [
            {"pair": p} | {level: pays(pair=p, level=level) for level in LEVELS} for p in REFINEMENT_PAIRS
        ],
        "inlet": _span(inlet, 1),
        "inlet_step": f"{INLET:g} K",
    }


def _cylinders(runs: xr.Dataset) -> dict[str, Any]:
    """Ratios of mean square errors over random cylinders, and fractions of the cylinders, with intervals."""

    def fraction(statement: str, loop: str) -> str:
        ends = runs["share"].sel(statement=statement, loop_of=loop).values
        value, low, high = map(percent_text, ends)
        return f"{value} ({low} to {high})"

    def ratio(name: str, **labels: str) -> str:
        return with_interval(runs[name].sel(labels).values, 2)

    thirds = {"below": "lowest", "middle": "middle", "above": "highest"}
    exchange = {"group": "exchange"}
    return {
        "compared": str(int((runs["held_out"] == 0).sum())),
        "within": percent_text(MATERIAL),
        "rows": [
            {"pair": pair, "loop": loop, "share": fraction(f"{pair} < 1", loop)}
            | {
                criterion: ratio("ratio", pair=pair, loop_of=loop, criterion=criterion)
                for criterion in runs["criterion"].values
            }
            for pair in REFINEMENT_PAIRS
            for loop in runs["loop_of"].values
        ],
        "exchange": {
            "much": f"{runs['third_from'].sel(exchange | {'third': 'highest'}).item():.2g}",
            **{
                place: {p: ratio("third_ratio", **exchange, third=third, pair=p) for p in REFINEMENT_PAIRS}
                for place, third in thirds.items()
            },
        },
        "enough": fraction("M6 enough", "both"),
        "failed": str(int((runs["counts"] == 0).sum())),
    }


def compile_pdf(source: Path, root: Path, output: Path) -> None:
    """Typeset a Typst source, which may read below `root`, as PDF, offline, with the typesetter's own fonts.

    The same input gives the same bytes.
    """
    with atomic(output) as part:
        typst.compile(str(source), output=str(part), root=str(root), format="pdf", ignore_system_fonts=True)
