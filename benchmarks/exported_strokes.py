"""Strokes from vented to rest by exported C: ``python -m benchmarks.exported_strokes`` writes a table.

Both chambers of `pneumo init`'s cylinder begin vented, with the piston retracted or extended. The valve opens
fully. It stays open, shuts when the piston rests, or shuts while it moves. The reference is the same method
in steps of 10 us, which the tests compare with an implicit solver on independent equations.
"""

import json
import subprocess
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from pneumo import MODELS
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import load, study
from pneumo.equations.system import FULL_ORDER
from pneumo.export import exported, write_files
from pneumo.selection.cylinder_template import write_template
from pneumo.selection.plants import configured_plant

FILE = Path("docs/static/strokes.json")
N = 1.35
ROWS = (FULL_ORDER, *(f"M{number}" for number in range(1, 11)))
# Sonic conductance, dm^3/(s bar); dead volume, m^3; supply, Pa; direction
SIZES = list(product((0.4, 1.5, 4.0), (4e-6, 30e-6), (2e5, 4e5, 7e5, 10e5), (1, -1)))
NEVER, AT_REST, MOVING = 9.0, 0.5, 0.04  # s: when the valve shuts
STEPS = 1e-3, 1e-2  # s
PRESSURE, TEMPERATURE = 500.0, 1.0  # Pa, K: what docs/export.md promises
MAIN = """\
#include <stdio.h>
#include "{M}.h"

static double larger(double a, double b) {{ return a > b ? a : b; }}

int main(void)
{{
    double C, V_d, P_s, sign, shut, h;
    while (scanf("%lf %lf %lf %lf %lf %lf", &C, &V_d, &P_s, &sign, &shut, &h) == 6) {{
        {M}_parameters p = {M}_defaults;
        {sizes}
        double state[2][{M}_STATES] = {{{{0}}}}, off[2] = {{0, 0}}, t = 0;
        for (int i = {M}_P_A; i < {M}_STATES; i++)
            state[0][i] = state[1][i] = (i - {M}_P_A) % (({M}_STATES - 2)/2) ? {T_amb!r} : p.P_atm;
        state[0][{M}_x] = state[1][{M}_x] = -sign*p.x_max;
        int failed = 0;
        while (t < 3.5) {{
            const double inputs[{M}_INPUTS] = {{t < shut - 1e-6 ? sign*p.u_max : 0, 0}};
            const int fine = (int)(h/(t < 0.5 ? 1e-5 : 5e-5) + 0.5);
            failed |= {M}_step(&p, inputs, inputs, h, state[0]);
            for (int i = 0; i < fine; i++)
                failed |= {M}_step(&p, inputs, inputs, h/fine, state[1]);
            for (int i = {M}_P_A; i < {M}_STATES; i++) {{
                const double d = state[0][i] - state[1][i];
                double *o = &off[(i - {M}_P_A) % (({M}_STATES - 2)/2)];
                *o = larger(*o, d < 0 ? -d : d);
                failed |= !(d == d);
            }}
            t += h;
        }}
        printf("%.4g %.4g %d\\n", off[0], off[1], failed);
    }}
    return 0;
}}
"""


class Stroke(NamedTuple):
    """Largest differences of a stroke from its reference, Pa and K, and whether any step was refused."""

    pressure: float
    temperature: float
    failed: bool


def sized(plant: Plant, C: float, V_d: float, P_s: float) -> Plant:
    """Plant with an ISO 6358 valve of b = 0.3, dry friction, and these sizes in the units of `SIZES`."""
    gas = plant.gas._replace(elliptic=True, critical_ratio=0.3)
    k_xu = C * 1e-8 * 1.185 * 293.15**0.5 / gas.sonic_coefficient / plant.valve.u_max
    cylinder = plant.cylinder._replace(V_d_A=V_d, V_d_B=V_d, coulomb=10.0)
    c = plant.conditions
    conditions = c._replace(P_s=P_s, P_0=c.P_0 / c.P_s * P_s)
    return plant._replace(
        gas=gas, valve=plant.valve._replace(k_xu=k_xu), cylinder=cylinder, conditions=conditions
    )


def template_plant() -> Plant:
    """Plant of `pneumo init`'s cylinder."""
    with TemporaryDirectory() as folder:
        write_template(Path(folder, "my.yaml"))
        return configured_plant(study(load(Path(folder, "my.yaml"))))


def strokes(row: str, plant: Plant, h: float, cases: list[tuple[float, ...]]) -> list[Stroke]:
    """Strokes of a model, or of the full order, in steps of h s; cases are sizes and when the valve shuts."""
    lines = [" ".join(f"{value!r}" for value in (*case, h)) for case in cases]
    n = N if row in MODELS and MODELS[row].has_n else None
    files = exported(row, n, sized(plant, *cases[0][:3]), "c", piston=True)
    sizes = "p.C = C, p.V_d_A = p.V_d_B = V_d, p.P_s = P_s;"
    if b" P_0;" in files[f"{row}.h"]:
        sizes = f"p.P_0 *= P_s/p.P_s, {sizes}"
    with TemporaryDirectory() as folder:
        main = MAIN.format(M=row, T_amb=plant.conditions.T_amb, sizes=sizes)
        write_files(files | {"main.c": main.encode()}, Path(folder))
        words = ["gcc", "-O2", "main.c", f"{row}.c", "-lm", "-o", "main"]
        subprocess.run(words, cwd=folder, check=True)
        ran = subprocess.run(
            ["./main"], cwd=folder, input="\n".join(lines), check=True, capture_output=True, text=True
        )
    rows = [line.split() for line in ran.stdout.splitlines()]
    return [Stroke(float(P), float(T) if row == FULL_ORDER else 0.0, failed != "0") for P, T, failed in rows]


def worst(row: str, plant: Plant, shuts: tuple[float, ...]) -> dict[str, float]:
    """Largest differences of a row over all sizes and steps, and how many strokes keep both limits."""
    cases = [(*sizes, shut) for sizes in SIZES for shut in shuts]
    made = [stroke for h in STEPS for stroke in strokes(row, plant, h, cases)]
    kept = [not s.failed and s.pressure < PRESSURE and s.temperature < TEMPERATURE for s in made]
    pressure, temperature = (max(getattr(s, name) for s in made) for name in ("pressure", "temperature"))
    return {"strokes": len(made), "kept": sum(kept), "pressure": pressure, "temperature": temperature}


if __name__ == "__main__":
    plant = template_plant()
    kinds = {"rest": (NEVER, AT_REST), "moving": (MOVING,)}
    rows = {row: {kind: worst(row, plant, shuts) for kind, shuts in kinds.items()} for row in ROWS}
    FILE.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
