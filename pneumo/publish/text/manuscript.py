"""The manuscript as PDF: its numbers from results, its text and layout in ``paper/manuscript``.

`manuscript_numbers` returns every number of the text as text; written to a JSON file, it is read by the Typst
source, in whose sentences no number stands typed.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import typst
import xarray as xr
from numpy.typing import ArrayLike

from pneumo.configuration.experiment import Study
from pneumo.configuration.study_json import from_json
from pneumo.evidence.alternatives import INLET
from pneumo.evidence.findings import STANDING_SHARE
from pneumo.papers.paper_2006.summary import LEVELS
from pneumo.physics.models import MODELS
from pneumo.publish.text.formatting import percent_text, with_interval
from pneumo.simulation.signals import EXACT, PUBLISHED
from pneumo.statistics.intervals import CONFIDENCE
from pneumo.statistics.recommendation import MATERIAL
from pneumo.storage.files import atomic, read, read_json

REFINEMENTS = ("M6/M5", "M8/M7", "M10/M8")
TRANSPORTS = (PUBLISHED, EXACT)
ENDS = ("value", "low", "high")
CLAIMED = {  # printed numbers that the text speaks of, by item of the verdict
    "of_M6": "S4.M7_40",
    "of_classical": "S4.M7_10",
    "mu": "S4.M7_mu",
    "sigma": "S4.M7_sigma",
    "replays": "S4.runs",
}


def manuscript_numbers(results: Path) -> dict[str, Any]:
    """Collect every number of the manuscript from the folder of results, which must hold the evidence.

    Nested by section; leaves are text, lists are rows of tables.
    """
    study = from_json(read_json(results / "parameters.json"))
    verdict = json.loads(read_json(results / "verdict.json"))
    claims = json.loads(read_json(results / "findings.json"))["claims"]
    return {
        "confidence": percent_text(CONFIDENCE),
        "stands": percent_text(STANDING_SHARE),
        "setup": _setup(study),
        "verdict": _verdict(verdict),
        "identified": _identified(read(results / "identification.nc")),
        "budget": _budget(read(results / "error_budget.nc")),
        "ensemble": _ensemble(read(results / "ensemble.nc")),
        "floor": _floor(read(results / "floor.nc")),
        "variants": _variants(read(results / "variants.nc", "ratio", "share", "counted")),
        "cylinders": _cylinders(read(results / "cylinders.nc")),
        "statements": [
            {key: row[key] for key in ("claim", "published", "exact", "interval", "stands", "why")}
            for row in claims
            if row["headline"]
        ],
        "standing": {
            answer: str(sum(row["stands"] == answer for row in claims)) for answer in ("yes", "in part", "no")
        }
        | {"all": str(len(claims))},
        "models": [_model(name) for name in MODELS],
    }


def _model(name: str) -> dict[str, str]:
    row = MODELS[name]
    three = (row.n_V, row.n_in, row.n_out)
    indices = [n.replace("gamma", "γ") if isinstance(n, str) else f"{n:g}" for n in three]
    return {
        "name": name,
        "index": str(row.n_V).replace("gamma", "γ") if len(set(indices)) == 1 else ", ".join(indices),
        "temperature": row.temperature,
        "mixing": "yes" if row.mixing else "no",
        "wall": row.wall,
    }


def _setup(study: Study) -> dict[str, Any]:
    experiments = study.experiments.values()
    cylinders = {e.cylinder: e for e in experiments if not e.drive.closed_loop}
    with_n = sum(model.has_n for model in MODELS.values())
    per_experiment = with_n * len(study.n) + len(MODELS) - with_n
    some = next(iter(experiments))
    return {
        "step": f"{1e3 * some.h:g} ms",
        "lag": f"{1e3 * study.lag:g} ms",
        "experiments": str(len(study.experiments)),
        "n": str(len(study.n)),
        "replays": str(per_experiment * len(study.experiments)),
        "simulated": f"{sum(e.steps * e.h for e in experiments) / 3600:.1f} h",
        "seeds": {name: str(e.excitation.seed) for name, e in cylinders.items()},
        "amplitude": {name: f"{e.excitation.amplitude:g} V" for name, e in cylinders.items()},
        "P_s": f"{some.plant.conditions.P_s / 1e5:g} bar",
    }


def _verdict(verdict: Mapping[str, Any]) -> dict[str, Any]:
    highlights, counts = verdict["highlights"], dict(verdict["counts"])
    scores = highlights["scores"]
    readable = counts["items"] - counts["unreadable"]
    rows = {row["model"]: row for row in highlights["wrong_row"] if row["source"] == "printed"}
    printed = {item["id"]: f"{item['printed']} {item['unit']}".rstrip() for item in verdict["items"]}
    return {
        "counts": {"all": str(counts.pop("items"))} | {name: str(count) for name, count in counts.items()},
        "places": str(len(verdict["errata"])),
        "claimed": {key: printed[item] for key, item in CLAIMED.items()},
        "exact": {
            row["level"]: percent_text(row["quotients"]["M8/M7"])
            for row in highlights["transport"]
            if row["source"] == EXACT
        },
        "missed_share": percent_text(verdict["counts"]["missed"] / readable, 1),
        "readable": str(readable),
        "errata": [
            {key: erratum[key] for key in ("where", "printed", "meant")} for erratum in verdict["errata"]
        ],
        "scores": {
            **{f"table_{i}": percent_text(scores[f"table_{i}_mse"]["rms_of_ln_ratio"], 1) for i in (7, 9)},
            "table_8": f"{scores['table_8']['exact']} of {scores['table_8']['cells']}",
            "table_8_close": str(scores["table_8"]["exact_or_close"] - scores["table_8"]["exact"]),
            "table_5": f"{scores['table_5']['exact_or_close']} of {scores['table_5']['cells']}",
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
            for row in highlights["transport"]
        ],
        "by_experiment": {name: _span(highlights["by_experiment"][name]) for name in TRANSPORTS},
    }


def _identified(identified: xr.Dataset) -> dict[str, Any]:
    digits = {"M": 2, "k_f": 0, "stop": 2}
    return {
        cylinder: {
            name: with_interval([at[key].item() for key in ("estimate", "low", "high")], digits[name])
            for name in digits
            for at in [identified.sel(cylinder=cylinder, parameter=name)]
        }
        for cylinder in identified["cylinder"].values
    }


def _budget(budget: xr.Dataset) -> dict[str, Any]:
    def rms(part: str, **labels: str) -> str:
        return f"{budget[f'level_{part}_error'].sel(labels).item() ** 0.5 / 1e3:.2f} kPa"

    return {
        level: {
            model: {part: rms(part, level=level, model=model) for part in ("model", "transport")}
            for model in ("M7", "M8", "M10")
        }
        for level in LEVELS
    }


def _ensemble(ensemble: xr.Dataset) -> dict[str, Any]:
    def ratio(name: str, **labels: str) -> float:
        return ensemble[f"ratio_{name}"].sel(labels).item()

    over_all = {"ratio": "M8/M7", "level": "overall", "averaged": "mean"}
    return {
        "sets": str(int(ensemble["complete"].sum())),
        "drawn": str(ensemble.sizes["seeds"]),
        "left_out": str(int((ensemble["complete"] == 0).sum())),
        "failing": " and ".join(ensemble["experiment"].values[ensemble["failed_sets"].values > 0].tolist()),
        "rows": [
            {"ratio": pair, "level": level}
            | {
                f"{transport} {averaged}": with_interval([ratio(end, **labels) for end in ENDS], 2)
                for transport in TRANSPORTS
                for averaged in ("mean", "geometric")
                for labels in [{"ratio": pair, "level": level, "averaged": averaged, "transport": transport}]
            }
            for pair in REFINEMENTS
            for level in (*LEVELS, "overall")
        ],
        "resolvable": {
            transport: percent_text(ratio("resolvable", transport=transport, **over_all) - 1)
            for transport in TRANSPORTS
        },
        "extremes": {
            pair: {
                transport: _span(ensemble["experiment_ratio_value"].sel(ratio=pair, transport=transport))
                for transport in TRANSPORTS
            }
            for pair in (*REFINEMENTS, "M6/M7")
        },
    }


def _span(values: ArrayLike, digits: int = 2) -> dict[str, str]:
    """Lowest and highest value as text."""
    return {"lowest": f"{np.min(values):.{digits}f}", "highest": f"{np.max(values):.{digits}f}"}


def _floor(floor: xr.Dataset) -> dict[str, Any]:
    """How theory and formula compare with the measured floor, over experiments and times between samples."""
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
    """In how many alternatives each refinement pays, exact transport, mean over experiments."""
    here = variants.sel(transport=EXACT, criterion="mean")
    inlet = here["ratio"].sel(pair="M8/M7", alternative=["inlet.colder", "inlet.warmer"])

    def pays(**labels: str) -> str:
        counted = here["counted"].sel(labels).item()
        return f"{round(here['share'].sel(labels).item() * counted)} of {counted:.0f}"

    return {
        "rows": [
            {"pair": pair} | {level: pays(pair=pair, level=level) for level in LEVELS} for pair in REFINEMENTS
        ],
        "inlet": _span(inlet, 1),
        "inlet_step": f"{INLET:g} K",
    }


def _cylinders(runs: xr.Dataset) -> dict[str, Any]:
    """Ratios and shares over random cylinders."""

    def share(statement: str, loop: str) -> str:
        ends = runs["share"].sel(statement=statement, loop_of=loop).values
        value, low, high = (percent_text(end) for end in ends)
        return f"{value} ({low} to {high})"

    def ratio(name: str, **labels: str) -> str:
        return with_interval(runs[name].sel(labels).values, 2)

    thirds = {"below": "lowest", "middle": "middle", "above": "highest"}
    exchange = {"group": "exchange"}
    return {
        "compared": str(int((runs["held_out"] == 0).sum())),
        "within": percent_text(MATERIAL),
        "rows": [
            {"pair": pair, "loop": loop, "share": share(f"{pair} < 1", loop)}
            | {
                criterion: ratio("ratio", pair=pair, loop_of=loop, criterion=criterion)
                for criterion in runs["criterion"].values
            }
            for pair in REFINEMENTS
            for loop in runs["loop_of"].values
        ],
        "exchange": {
            "much": f"{runs['third_from'].sel(exchange | {'third': 'highest'}).item():.2g}",
            **{
                place: {
                    pair: ratio("third_ratio", **exchange, third=third, pair=pair) for pair in REFINEMENTS
                }
                for place, third in thirds.items()
            },
        },
        "enough": share("M6 enough", "both"),
        "failed": str(int((runs["counts"] == 0).sum())),
    }


def compile_pdf(source: Path, root: Path, output: Path) -> None:
    """Typeset a Typst source as PDF, offline, with the fonts that the typesetter carries.

    The source may read below `root`. The same input gives the same bytes.
    """
    with atomic(output) as part:
        typst.compile(str(source), output=str(part), root=str(root), format="pdf", ignore_system_fonts=True)
