"""The manuscript as PDF: its numbers from results, its text and layout in ``paper/manuscript``.

The Typst source reads every number from a JSON file, none is typed there.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import typst
from numpy.typing import ArrayLike

from paper.study.samplings import EXACT, STUDY_SAMPLINGS
from paper.study.stored_runs import read_json, read_study
from paper_verdict.facts import AGREES, NOT_JUDGED, headline_text
from paper_verdict.text import size_text
from pneumo.configuration.experiment import Study
from pneumo.physics.models import MODELS
from pneumo.publish.text.formatting import percent_text
from pneumo.statistics.intervals import CONFIDENCE
from pneumo.storage.files import atomic

CLAIMED = {  # printed numbers quoted in the text -> item of the verdict
    "of_M6": "S4.M7_40",
    "of_classical": "S4.M7_10",
    "mu": "S4.M7_mu",
    "sigma": "S4.M7_sigma",
    "replays": "S4.runs",
}


def manuscript_numbers(parameters: Path, verdict: Path) -> dict[str, Any]:
    """Numbers of the study and its verdict as text, by section; lists are rows of tables.

    Those of finished studies are in paper/manuscript/frozen.json.
    """
    return {
        "confidence": percent_text(CONFIDENCE),
        "setup": _setup(read_study(parameters)),
        "verdict": _verdict(read_json(verdict)),
        "models": [_model(name) for name in MODELS],
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
    highlights = verdict["highlights"]
    proved = [erratum for erratum in verdict["errata"] if not erratum["items"]]
    scores, transport = highlights["scores"], highlights["transport"]
    rows = {row["model"]: row for row in highlights["wrong_row"] if row["source"] == "printed"}
    printed = {item["id"]: f"{item['printed']} {item['unit']}".rstrip() for item in verdict["items"]}
    exact = {row["level"]: row["quotients"]["M8/M7"] for row in transport if row["source"] == EXACT}
    table_8, table_5 = scores["table_8"], scores["table_5"]
    return {
        "items": str(len(verdict["items"])),
        "headline": headline_text(verdict["headline"]),
        "facts": [
            {"says": fact["says"], "status": fact["status"], "size": size_text(fact)}
            for fact in verdict["facts"]
            if fact["status"] not in (AGREES, NOT_JUDGED)
        ],
        "places": str(len(proved)),
        "claimed": {key: printed[item] for key, item in CLAIMED.items()},
        "exact": {level: percent_text(quotient) for level, quotient in exact.items()},
        "errata": [{key: erratum[key] for key in ("where", "printed", "meant")} for erratum in proved],
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


def _span(values: ArrayLike) -> dict[str, str]:
    """Lowest and highest value as text."""
    return {"lowest": f"{np.min(values):.2f}", "highest": f"{np.max(values):.2f}"}


def compile_pdf(source: Path, root: Path, output: Path) -> None:
    """Typeset a Typst source, which may read below `root`, as PDF, offline, with the typesetter's own fonts.

    The same input gives the same bytes.
    """
    with atomic(output) as part:
        typst.compile(str(source), output=str(part), root=str(root), format="pdf", ignore_system_fonts=True)
