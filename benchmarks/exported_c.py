"""Time of a step of every exported model in C: ``python -m benchmarks.exported_c`` prints a table.

Steps of 1 ms of both chambers with valve and piston, compiled by gcc -O2, each the best of nine runs. Cycles
are those of the processor's time stamp counter, on x86-64 only.
"""

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from pneumo import MODELS
from pneumo.configuration.parameters import load, study
from pneumo.equations.system import FULL_ORDER, METHODS, system
from pneumo.export import exported, write_files
from pneumo.selection.plants import configured_plant

STEPS, RUNS = 20_000, 9
MAIN = """\
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#if defined __x86_64__
#include <x86intrin.h>
#define CYCLES() ((double)__rdtsc())
#else
#define CYCLES() 0.0
#endif
#include "%(M)s.h"

int main(void)
{
    for (int method = 0; method < %(methods)d; method++) {
        double best = 1e300, cycles = 0;
        for (int run = 0; run < %(runs)d; run++) {
            %(f)s y[] = {%(start)s}, u[] = {1, 0};
            struct timespec from, to;
            clock_gettime(CLOCK_MONOTONIC, &from);
            const double before = CYCLES();
            for (int k = 0; k < %(steps)d; k++) {
                u[0] = k %% 200 < 100 ? 1 : -1;
                %(M)s_step(&%(M)s_defaults, method, u, u, (%(f)s)1e-3, y);
            }
            const double spent = CYCLES() - before;
            clock_gettime(CLOCK_MONOTONIC, &to);
            const double ns = 1e9 * (double)(to.tv_sec - from.tv_sec) + (double)(to.tv_nsec - from.tv_nsec);
            if (!(y[2] > 0))
                return 1;
            if (ns < best) {
                best = ns;
                cycles = spent;
            }
        }
        printf("%%.0f %%.0f\\n", best / %(steps)d, cycles / %(steps)d);
    }
    return 0;
}
"""


def timed(model: str, precision: str) -> list[str]:
    """Nanoseconds and cycles of a step by each method, as text."""
    plant = configured_plant(study(load("config/paper.yaml")), "D", 0.5)
    c, chosen = plant.conditions, system(model, 1.35, plant, piston=True)
    start = {"x": 0.0, "v": 0.0, "P": c.P_0, "T": c.T_0}
    words = {"M": model, "f": precision, "methods": len(METHODS), "steps": STEPS, "runs": RUNS}
    words["start"] = ", ".join(str(start[name[0]]) for name in chosen.states)
    with TemporaryDirectory() as folder:
        write_files(exported(model, 1.35, plant, "c", precision=precision, piston=True), Path(folder))
        (Path(folder) / "main.c").write_text(MAIN % words, encoding="utf-8")
        compiler = ["gcc", "-std=c99", "-O2", "main.c", f"{model}.c", "-lm", "-o", "main"]
        subprocess.run(compiler, cwd=folder, check=True)
        ran = subprocess.run(["./main"], cwd=folder, check=True, capture_output=True, text=True)
    return [f"{ns} ({cycles})" for ns, cycles in (line.split() for line in ran.stdout.splitlines())]


if __name__ == "__main__":
    print(f"ns (cycles) per step | {' | '.join(f'{p} {m}' for p in ('double', 'float') for m in METHODS)}")
    for name in (*MODELS, FULL_ORDER):
        print(f"{name} | {' | '.join(timed(name, 'double') + timed(name, 'float'))}", flush=True)
