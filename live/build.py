"""Complete the page of `pneumo live`: it studies a cylinder in the browser, with the core as WebAssembly.

The package contains the finished page, so that readers need no compiler. Its HTML and script are edited
there; `make live` writes the compiled core and the numbers of models and `pneumo study` into it. A test fails
where that was forgotten after a change.
"""

import base64
import hashlib
import json
import re
import subprocess
import tempfile
from itertools import product
from math import log, log1p
from pathlib import Path
from typing import Any

import numpy as np

from pneumo.catalogue import GROWTH, coefficient_times_length, measured_bores
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import DEAD_FRACTION, load, sonic_conductance, study
from pneumo.configuration.priors import SIGMAS, Uncertain, accuracy, uncertainties
from pneumo.configuration.valve_conversions import conductance
from pneumo.core.build import FLAGS
from pneumo.core.build import FOLDER as CORE
from pneumo.errors import InputError
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import MODELS, full_order_lane, lane, lane_array
from pneumo.physics.valve import mass_flow
from pneumo.publish.pages.page import LIVE_PAGE
from pneumo.quantities.applied import LEAST_B, MOST_B
from pneumo.selection.answer import model_cost
from pneumo.selection.cylinder_ranking import (
    DRAWN_RUN,
    DRAWN_STEP,
    DRAWS,
    PART_DRAWS,
    REST,
    ROWS,
    SHORTEST,
    drawn_deviations,
    seeds_of,
)
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.selection.error_budget import FULL_ORDER, TAILS
from pneumo.selection.ranking import MATERIAL
from pneumo.simulation.excitation import initial_state
from pneumo.simulation.polynomials import flow_polynomial
from pneumo.simulation.replay import needs

FOLDER = Path(__file__).parent
FLOW = "Q_n_l_per_min"
# The C library that the core needs: its functions are instructions of WebAssembly.
HEADERS = {
    "math.h": """
        #define sqrt __builtin_sqrt
        #define fabs __builtin_fabs
        #define NAN __builtin_nanf("")
        #define INFINITY __builtin_inff()
    """,
    "string.h": """
        #include <stddef.h>
        int memcmp(const void *a, const void *b, size_t count);
        #define memcpy __builtin_memcpy
        #define memset __builtin_memset
    """,
}
OPTIONS = ["--target=wasm32", "-ffreestanding", "-nostdlib", "-mbulk-memory", "-msimd128"]
OPTIONS += ["-Wl,--no-entry,--strip-all"]
SOURCES = [FOLDER / "live.c", CORE / "full_order.c", CORE / "replay.c"]


def compiled() -> bytes:
    """WebAssembly of the core; `InputError` if clang or its linker is not installed."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in HEADERS.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        command = ["clang", *FLAGS, *OPTIONS, "-isystem", folder, "-I", str(CORE), *map(str, SOURCES)]
        try:
            subprocess.run([*command, "-o", f"{folder}/live.wasm"], check=True)
        except (FileNotFoundError, subprocess.CalledProcessError) as error:
            raise InputError(f"clang and wasm-ld (Debian: clang, lld) are needed: {error}") from None
        return Path(folder, "live.wasm").read_bytes()


def numbers_of(plant: Plant) -> dict[str, float]:
    """Numbers of a plant by name, in the order in which the page's C reads them."""
    numbers = dict[str, float]()
    for name, value in plant._asdict().items():
        parts = value._asdict() if hasattr(value, "_asdict") else {name: value}
        numbers |= {key: float(number) for key, number in parts.items() if key not in ("paths", "sag")}
    return numbers


def _template() -> str:
    """The template of `pneumo init`, in which {{key}} marks the values that the page fills in."""
    text = TEMPLATE.read_text(encoding="utf-8").replace("C_dm3_per_sbar: 1.5", f"{FLOW}: 1", 1)
    text = text.replace("# sonic conductance from supply to chamber", "# nominal flow", 1)
    for key in ("P_s_Pa", "bore_mm", "stroke_mm", "rod_mm", "mass_kg", FLOW):
        text = re.sub(
            rf"^( *)(?:#~ )?{key}: [^ \n]+", rf"\1{key}: {{{{{key}}}}}", text, count=1, flags=re.MULTILINE
        )
    text = re.sub(r"amplitude_mm: [^ \n]+", "amplitude_mm: {{amplitude_mm}}", text)
    text = text.replace(f"{{{{{FLOW}}}}}", f"{{{{{FLOW}}}}} ± {{{{within}}}} %", 1)
    text = re.sub(r"^( *b: [^ \n]+)", r"\1 ± {{b}}", text, count=1, flags=re.MULTILINE)
    return re.sub(r"(exhaust_ratio: [^ \n]+)", r"\1 ± {{exhaust_percent}} %", text, count=1)


def _layout() -> dict[str, Any]:
    """Numbers that the page's script needs, from template, catalogue, models and `pneumo study`."""
    configuration = load(TEMPLATE)
    chosen = study(configuration)
    experiments = list(chosen.experiments.values())
    plant, first = experiments[0].plant, experiments[0]
    valve, gas, conditions, b = plant.valve, plant.gas, plant.conditions, plant.gas.critical_ratio
    cells = [(name, n) for name, n in product(MODELS, chosen.n) if MODELS[name].has_n or n == chosen.n[0]]
    lanes = [lane(MODELS[name], n, gas.gamma) for name, n in cells]
    order = np.argsort(needs(lane_array(lanes)), kind="stable").tolist()
    rows = [(cells[i][0], cells[i][1] if MODELS[cells[i][0]].has_n else None, lanes[i]) for i in order]
    rows.append((FULL_ORDER, None, full_order_lane(gas.gamma)))
    (uncertain,) = uncertainties(configuration).values()
    places = range(len(uncertain.names))
    unit = Uncertain(uncertain.names, tuple(tuple(float(i == j) for i in places) for j in places))
    product_, factor = coefficient_times_length()
    supplies = {
        P_s // 100_000 - 1: {"P_s": P_s, "P_0": equilibrium_pressure(P_s, conditions.P_atm, gas)}
        for P_s in range(300_000, 1_200_000, 100_000)
    }
    sensitivity = [log(conductance(FLOW, 1.0, b + step)) for step in (-0.02, 0.02)]
    return {
        "plant": {**numbers_of(plant), "linearity": 0.0},
        "k_xu_per_flow": valve.k_xu / sonic_conductance(valve, gas) * conductance(FLOW, 1.0, b),
        "supplies": supplies,
        "flows": {  # into a chamber at rest pressure, kg/s, by the valve fully open, for k_x k_u = 1 m²/V
            gauge: mass_flow(valve.u_max, of["P_s"], of["P_0"], conditions.T_in, gas)
            for gauge, of in supplies.items()
        },
        "rest": REST,
        "strokes": PART_DRAWS,
        "drifting": [
            name for name, row in MODELS.items() if row.temperature == "polytropic" and row.wall != "none"
        ],
        "flow_slope": (sensitivity[1] - sensitivity[0]) / 0.04,
        "dead_fraction": DEAD_FRACTION,
        "dead_limit": log1p(accuracy(configuration)["V_d_A"]),  # of a dead volume that is given
        "wall": {"product": product_, "factor": factor, "bores": measured_bores(), "growth": GROWTH},
        "h": first.h,
        "steps": first.steps,
        "every": first.excitation.every,
        "experiments": [
            {"closed": e.drive.closed_loop, "amplitude": e.excitation.amplitude, "k_p": e.drive.k_p}
            for e in experiments
        ],
        "reverse_at": 2 * first.drive.x_reverse / plant.cylinder.stroke,
        "stroke_mm": 1e3 * plant.cylinder.stroke,
        "runs": chosen.seeds,
        "seeds": [initial_state(seed) for seed in seeds_of(first, DRAWS)],
        "lanes": [{"row": name, "n": n, "lane": coefficients} for name, n, coefficients in rows],
        "psi": flow_polynomial(gas)[0],
        "rows": ROWS,
        "cost": sorted(ROWS, key=model_cost),
        "points": drawn_deviations(unit, DRAWS).tolist(),
        "quantities": uncertain.names,
        "limits": {name: uncertain.half_width(name) for name in uncertain.names},
        "sigmas": SIGMAS,
        "b": [LEAST_B, MOST_B],
        "shortest": [DRAWN_RUN, SHORTEST],
        "drawn_step": DRAWN_STEP,
        "tails": TAILS,
        "material": MATERIAL,
        "template": _template(),
    }


def assembled(code: bytes) -> str:
    """HTML of the page, in one file that loads nothing else, with the compiled core and today's numbers."""
    text = LIVE_PAGE.read_text(encoding="utf-8")
    sources = [*SOURCES, *sorted(CORE.glob("*.h"))]
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in sources)).hexdigest()
    parts = {
        r'(<meta name="sources" content=").*?(">)': digest,
        r'(<script id="layout" .*?>).*?(</script>)': json.dumps(_layout()).replace("</", r"<\/"),
        r'(<script id="wasm" .*?>).*?(</script>)': base64.b64encode(code).decode(),
    }
    for pattern, content in parts.items():
        (place,) = re.finditer(pattern, text)
        text = text[: place.end(1)] + content + text[place.start(2) :]
    return text


if __name__ == "__main__":
    LIVE_PAGE.write_text(assembled(compiled()), encoding="utf-8")
