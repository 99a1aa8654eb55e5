"""Cost of a step of every exported model: ``python -m benchmarks.exported_c`` writes docs/static/cost.json.

Steps of 1 ms of both chambers with their valve follow the signals of the paper's experiment E10. Measured are
nanoseconds in C on this processor, the best of some runs; and, where arm-none-eabi-gcc and qemu-system-arm
are installed, instructions on a Cortex-M4F. ``--shared`` says in the file that other work ran meanwhile;
``--observers`` measures observers only, and leaves the rest of the file as it is.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from pneumo import MODELS
from pneumo.configuration.parameters import load, study
from pneumo.equations.substep import LENGTHS
from pneumo.equations.system import FULL_ORDER, System, system
from pneumo.export import exported, write_files
from pneumo.simulation.full_order import Recording, record

FILE = Path("docs/static/cost.json")
EXPERIMENT, N, STEPS, RUNS = "E10", 1.35, 1000, 500
SENSORS = "both"  # of the observers
MAIN = """\
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "%(M)s.h"
%(signals)s
int main(void)
{
    double best = 1e300;
    for (int run = 0; run < %(runs)d; run++) {
        %(f)s y[] = {%(start)s};
        struct timespec from, to;
        clock_gettime(CLOCK_MONOTONIC, &from);
%(work)s
        clock_gettime(CLOCK_MONOTONIC, &to);
        const double ns = 1e9 * (double)(to.tv_sec - from.tv_sec) + (double)(to.tv_nsec - from.tv_nsec);
        if (!(y[%(M)s_P_A] > 0))
            return 1;
        if (ns < best)
            best = ns;
    }
    printf("%%.1f\\n", best / %(steps)d);
    return 0;
}
"""
WORK = """\
            for (int k = 0; k < %(steps)d; k++)
                %(M)s_step(&%(M)s_defaults, signals[k], signals[k + 1], (%(f)s)1e-3, y);"""
OBSERVE = """\
            %(M)s_estimate e;
            const %(f)s P = y[%(M)s_P_A];
            %(M)s_start(&%(M)s_defaults, &%(M)s_noise_defaults, readings[0][0], P, P, &e);
            for (int k = 0; k < %(steps)d; k++) {
                %(M)s_correct(&%(M)s_defaults, &%(M)s_noise_defaults, readings[k], &e);
                %(M)s_predict(&%(M)s_defaults, &%(M)s_noise_defaults, signals[k], (%(f)s)1e-3, &e);
            }
            y[%(M)s_P_A] = e.state[%(M)s_P_A];"""
# The timer of the machine mps2-an386 counts down at 25 MHz; with `-icount shift=0` an instruction takes 1 ns.
INSTRUCTIONS_PER_TICK = 40
ARM_MAIN = """\
#include <stdint.h>
#include "%(M)s.h"
%(signals)s
static volatile uint32_t *const timer = (volatile uint32_t *)0x40000000; /* control, value, reload */
int main(void);
void reset(void);
extern uint32_t stack_top;

__attribute__((section(".vectors"), used)) static const void *const vectors[] = {&stack_top, (void *)reset};

static int32_t call_host(int32_t operation, const void *argument)
{
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(uint32_t number)
{
    char text[12];
    char *at = text + 11;
    *at = 0;
    *--at = '\\n';
    do
        *--at = (char)('0' + number %% 10);
    while (number /= 10);
    call_host(0x04, at);
}

void reset(void)
{
    *(volatile uint32_t *)0xe000ed88 |= 0xf << 20; /* switch the floating-point unit on */
    __asm__ volatile("dsb\\nisb");
    main();
    const uint32_t finished[] = {0x20026, 0};
    call_host(0x20, finished);
    for (;;) {
    }
}

int main(void)
{
    %(f)s y[] = {%(start)s};
    timer[0] = 0;
    timer[1] = timer[2] = 0xffffffff;
    timer[0] = 1;
%(work)s
    print(y[%(M)s_P_A] > 0 ? 0xffffffff - timer[1] : 0);
    return 0;
}
"""
LINKER_SCRIPT = """\
MEMORY { FLASH (rx) : ORIGIN = 0, LENGTH = 4M  RAM (rw) : ORIGIN = 0x20000000, LENGTH = 4M }
ENTRY(reset)
SECTIONS {
    .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) } > FLASH
    .ARM.exidx : { *(.ARM.exidx*) } > FLASH
    .data : { *(.data*) } > RAM
    .bss : { *(.bss*) *(COMMON) } > RAM
    stack_top = ORIGIN(RAM) + LENGTH(RAM);
}
"""
ARM = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
QEMU = ["qemu-system-arm", "-machine", "mps2-an386", "-nographic", "-semihosting", "-icount", "shift=0"]
CC = ["-std=c99", "-O2"]


def recording_of() -> Recording:
    """The first steps of the experiment."""
    e = study(load("config/paper.yaml")).experiments[EXPERIMENT]
    return record(e._replace(steps=STEPS))


def signals_of(recording: Recording, chosen: System) -> np.ndarray:
    """Inputs of a system at every step of the recording, shape (steps + 1, inputs)."""
    limit, states = recording.plant.valve.u_max, recording.states
    values = {"u": np.clip(recording.u, -limit, limit), "x": states[:, 0], "v": states[:, 1]}
    return np.column_stack([values.get(name, np.zeros(len(states))) for name in chosen.inputs])


def with_shortest_substeps(files: dict[str, str]) -> dict[str, str]:
    """C files of a model in single precision all of whose substeps are as short as they can be."""
    longest, shortest = (f"{LENGTHS[name]:g}f" for name in ("longest", "shortest"))
    return {
        name: text.replace(longest, shortest) if name.endswith(".c") else text for name, text in files.items()
    }


def _table(name: str, rows: np.ndarray, precision: str) -> str:
    """Declaration of an array in C."""
    suffix = "f" if precision == "float" else ""
    text = ",\n".join("{" + ", ".join(f"{value:.9e}{suffix}" for value in row) + "}" for row in rows)
    return f"static const {precision} {name}[][{rows.shape[1]}] = {{\n{text}}};\n"


def observer_programs(recording: Recording, precision: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Name and files of the program of each observer, one cycle a sample, both pressures measured."""
    c, suffix = recording.plant.conditions, "f" if precision == "float" else ""
    read = recording.states[:, [0, 2, 4]]
    for name in (*MODELS, FULL_ORDER):
        chosen = system(name, N, recording.plant, piston=True)
        start = chosen.state(x=0.0, v=0.0, P=c.P_0, T=c.T_0)
        words = {"M": name, "f": precision, "steps": STEPS, "runs": RUNS}
        words["signals"] = _table("signals", signals_of(recording, chosen), precision)
        words["signals"] += _table("readings", read, precision)
        words["start"] = ", ".join(f"{value:.9e}{suffix}" for value in start)
        words["work"] = OBSERVE % words
        files = exported(name, N, recording.plant, "c", precision=precision, observer=SENSORS)
        texts = {file: text.decode() for file, text in files.items() if "_test" not in file}
        yield name, texts | {"main.c": MAIN % words, "arm.c": ARM_MAIN % words, "arm.ld": LINKER_SCRIPT}


def programs(recording: Recording, precision: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Name and files of the program of each row: models and the full order."""
    c, suffix = recording.plant.conditions, "f" if precision == "float" else ""
    for name in (*MODELS, FULL_ORDER):
        chosen = system(name, N, recording.plant)
        signals = signals_of(recording, chosen)
        start = chosen.state(x=0.0, v=0.0, P=c.P_0, T=c.T_0)
        table = _table("signals", signals, precision)
        words = {"M": name, "f": precision, "steps": STEPS, "runs": RUNS}
        words |= {"start": ", ".join(f"{value:.9e}{suffix}" for value in start), "signals": table}
        words["work"] = WORK % words
        files = exported(name, N, recording.plant, "c", precision=precision)
        texts = {file: text.decode() for file, text in files.items() if "_test" not in file}
        texts |= {"main.c": MAIN % words, "arm.c": ARM_MAIN % words, "arm.ld": LINKER_SCRIPT}
        yield name, texts


def _run(folder: str, command: list[str]) -> str:
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


def measured(name: str, files: dict[str, str], arm: bool) -> dict[str, Any]:
    """Costs of a row: ns here; and on a Cortex-M4F instructions, bytes of code and of stack."""
    with TemporaryDirectory() as folder:
        write_files({file: text.encode() for file, text in files.items()}, Path(folder))
        _run(folder, ["gcc", *CC, "main.c", f"{name}.c", "-lm", "-o", "main"])
        costs: dict[str, Any] = {"ns": float(_run(folder, ["./main"]))}
        if arm:
            compiler = ["arm-none-eabi-gcc", *ARM, *CC]
            _run(folder, [*compiler, "-fstack-usage", "-c", f"{name}.c", "-o", "model.o"])
            linked = [*compiler, "-nostartfiles", "-T", "arm.ld", "arm.c", "model.o", "-lm", "-o", "arm.elf"]
            _run(folder, linked)
            told = subprocess.run(
                [*QEMU, "-kernel", "arm.elf"],
                cwd=folder,
                check=True,
                capture_output=True,
                text=True,
                timeout=60,
            )
            ticks = int(told.stderr)  # where the machine's host prints
            if not ticks:
                raise ValueError(f"{name}: failed on the Cortex-M4F")
            costs["instructions"] = INSTRUCTIONS_PER_TICK * ticks / STEPS
            sizes = _run(folder, ["arm-none-eabi-size", "model.o"]).splitlines()[1].split()
            costs["code_bytes"] = int(sizes[0])
            usage = Path(folder, "model.su").read_text(encoding="utf-8").splitlines()
            costs["stack_bytes"] = sum(int(line.split("\t")[1]) for line in usage)
    return costs


def _version(command: str) -> str:
    return subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout.split(
        "\n"
    )[0]


def observer_costs(shared: bool) -> dict[str, Any]:
    """Costs of a cycle of every observer, by precision and row."""
    recording, has_arm = recording_of(), _has_arm()
    results: dict[str, Any] = {"sensors": SENSORS, "processor": _processor(), "shared": shared, "rows": {}}
    for precision, size in (("double", 8), ("float", 4)):
        of_precision = results["rows"].setdefault(precision, {})
        for name, files in observer_programs(recording, precision):
            states = len(system(name, N, recording.plant, piston=True).states)
            cost = measured(name, files, has_arm and precision == "float")
            of_precision[name] = {"states": states, "estimate_bytes": size * (states + states**2)} | cost
            print("observer", precision, name, of_precision[name], flush=True)
    return results


def _has_arm() -> bool:
    return bool(which("arm-none-eabi-gcc") and which("qemu-system-arm"))


def _processor() -> str:
    cpu = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    return cpu[1] if cpu else "unknown"


def costs(shared: bool) -> dict[str, Any]:
    """All costs by precision and row."""
    recording = recording_of()
    has_arm = _has_arm()
    results: dict[str, Any] = {
        "experiment": EXPERIMENT,
        "n": N,
        "processor": _processor(),
        "shared": shared,
        "compiler": _version("gcc"),
        "arm": [_version("arm-none-eabi-gcc"), _version("qemu-system-arm")] if has_arm else [],
        "rows": {},
    }
    for precision in ("double", "float"):
        of_precision = results["rows"].setdefault(precision, {})
        for name, files in programs(recording, precision):
            on_arm = has_arm and precision == "float"
            of_precision[name] = measured(name, files, on_arm)
            if on_arm:
                most = measured(name, with_shortest_substeps(files), on_arm)
                of_precision[name]["most_instructions"] = most["instructions"]
            print(precision, name, of_precision[name], flush=True)
    return results


if __name__ == "__main__":
    shared = "--shared" in sys.argv[1:]
    kept = "--observers" in sys.argv[1:]
    every = json.loads(FILE.read_text(encoding="utf-8")) if kept else costs(shared)
    every["observers"] = observer_costs(shared)
    FILE.write_text(json.dumps(every, indent=1) + "\n", encoding="utf-8")
