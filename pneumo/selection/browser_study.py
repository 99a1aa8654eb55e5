"""Page on which a reader's own cylinder is studied in the browser, from the template of `pneumo init`."""

import base64
import re
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from pneumo.catalogue import GROWTH, coefficient_times_length, measured_bores
from pneumo.configuration import plausible_cylinders as plausible
from pneumo.configuration.conductance import CONVERSIONS, USUAL_B
from pneumo.configuration.parameters import DEAD_FRACTION, load, sonic_conductance, study
from pneumo.configuration.schema_messages import BOUNDS, allowed, dotted, schema_at
from pneumo.export.live import assembled, module
from pneumo.physics.models import MODELS
from pneumo.selection.cylinder_ranking import seeds_of
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.simulation.excitation import normal_deviates
from pneumo.statistics.error_budget import FULL_ORDER

MINE = ("cylinders", "mine")
# Keys with their units, in the order in which `pneumo check` looks at them.
FIELDS = {
    ("supply", "P_s_Pa"): "Pa",
    (*MINE, "bore_mm"): "mm",
    (*MINE, "stroke_mm"): "mm",
    (*MINE, "rod_mm"): "mm",
    (*MINE, "dead_volume_m3"): "m³",
    (*MINE, "dead_volume_B_m3"): "m³",
    (*MINE, "mass_kg"): "kg",
    (*MINE, "friction_Ns_per_m"): "N s/m",
    (*MINE, "coulomb_N"): "N",
    (*MINE, "valve", "C_dm3_per_sbar"): "dm³/(s bar)",
    (*MINE, "valve", "b"): "",
    (*MINE, "open_loop", "amplitude_V"): "V",
    (*MINE, "closed_loop", "amplitude_mm"): "mm",
    (*MINE, "closed_loop", "k_p_V_per_m"): "V/m",
    ("experiments", "open", "k_0_W_per_K"): "W/K",
}
RUNS = 2  # of each experiment, at first: five take three times as long


def _marked(text: str) -> tuple[str, dict[str, str]]:
    """Template in which a mark {{key}} replaces each field and `seeds`; and the text replaced, by key."""
    replaced = dict[str, str]()
    for key in (*(path[-1] for path in FIELDS), "seeds"):
        line = re.compile(rf"^( *)((?:#~ )?{key}: [^ \n]+)", re.MULTILINE)
        replaced[key] = line.findall(text)[0][1]
        text = line.sub(rf"\1{{{{{key}}}}}", text)
    return text, replaced


def _layout() -> dict[str, Any]:
    """Fields with their limits, random numbers and constants, from schema and template."""
    configuration = load(TEMPLATE)
    chosen = study(configuration)
    content, experiments = configuration.model_dump(), list(chosen.experiments.values())
    plant, fields = experiments[0].plant, list[dict[str, Any]]()
    for path, unit in FIELDS.items():
        _, node = schema_at(path)
        number = next((option for option in node.get("anyOf", ()) if option.get("type") == "number"), node)
        value: Any = content
        for key in path:
            value = value.get(key)
        fields.append(
            {
                "path": dotted(path),
                "key": path[-1],
                "unit": unit,
                "words": node["description"],
                "allowed": allowed(node),
                "bounds": {
                    name: number[key] for _, name, *keys in BOUNDS for key in (name, *keys) if key in number
                },
                "value": value if isinstance(value, int | float) else None,
            }
        )
    seeds = seeds_of(experiments[0], chosen.seeds)
    count = experiments[0].steps // experiments[0].excitation.every + 1
    draws = np.array([[*islice(normal_deviates(seed), count)] for seed in seeds])
    product, factor = coefficient_times_length()
    smallest, largest = measured_bores()
    template, unset = _marked(TEMPLATE.read_text(encoding="utf-8"))
    return {
        "fields": fields,
        "template": template,
        "unset": unset,
        "area_per_conductance": plant.valve.k_xu
        * plant.valve.u_max
        / sonic_conductance(plant.valve, plant.gas),
        "dead_fraction": DEAD_FRACTION,
        "catalogue": {
            "product": product,
            "factor": factor,
            "smallest": smallest,
            "largest": largest,
            "growth": GROWTH,
        },
        "usual_b": USUAL_B,
        "flows": ", ".join([*CONVERSIONS][1:]),
        "reverse_at": content["cylinders"]["mine"]["open_loop"]["reverse_at"],
        "h": experiments[0].h,
        "steps": experiments[0].steps,
        "every": experiments[0].excitation.every,
        "experiments": [{"name": e.name, "closed": e.drive.closed_loop} for e in experiments],
        "draws": base64.b64encode(draws.astype("<f8").tobytes()).decode(),
        "runs": RUNS,
        "most_runs": len(seeds),
        "n": list(chosen.n),
        "rows": [{"name": name, "has_n": model.has_n} for name, model in MODELS.items()]
        + [{"name": FULL_ORDER, "has_n": False}],
        "plausible": {
            "least_mm": plausible.LEAST_MM,
            "fastest": plausible.FASTEST,
            "slowest": plausible.SLOWEST,
            "most_dead": plausible.MOST_DEAD,
            "least_acceleration": plausible.LEAST_ACCELERATION,
            "most_volts": plausible.MOST_VOLTS,
            "remedy": plausible.REMEDY,
        },
    }


def browser_study(folder: Path) -> str:
    """HTML page in one file, put together from the files in `folder`; it loads nothing else.

    `InputError` if clang or its linker is not installed.
    """
    chosen = study(load(TEMPLATE))
    compiled = module(next(iter(chosen.experiments.values())).plant, *chosen.n)
    return assembled(folder, "your-cylinder", _layout() | {"plant": compiled.defaults}, compiled)
