"""The core in WebAssembly, run by node: a full-order run and its replays beside the native ones."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from paper_study import STUDY, lasting

import pneumo.core as core
from pneumo.configuration.sampling import EXACT_SAMPLING
from pneumo.core.build import FLAGS, FOLDER
from pneumo.physics.models import Lane
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import first_states, replay_one_by_one

TOOLS = ("clang", "wasm-ld", "node")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not all(map(shutil.which, TOOLS)), reason="needs clang, lld and node"),
]

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
# Structs without pointers have the same layout in both; the recording has pointers, so it is made here.
HARNESS = """
#include "maths.h"
int memcmp(const void *a, const void *b, size_t count)
{
    const unsigned char *one = a, *other = b;
    while (count && *one == *other)
        one++, other++, count--;
    return count ? *one - *other : 0;
}
#define EXPORT(name) __attribute__((export_name(#name)))
EXPORT(simulated) void simulated(const double *y_0, double *reference, int steps, const Drive *drive,
                                 const Plant *plant, double h, double *states, int8_t *halvings)
{
    fill_tables();
    run(y_0, reference, NULL, steps, 0, drive, plant, h, 0, states, halvings);
}
EXPORT(replayed) void replayed(const double *states, const double *reference, const double *u, int steps,
                               const Drive *drive, const Plant *plant, double h, const int8_t *halvings,
                               const Sampling *sampling, const Lane *lanes, int count, double *y,
                               double *moments, int64_t *failure, double *pressure)
{
    Recording recording = {states, reference, u, NULL, *drive, *plant, h, halvings, 0, steps};
    replay_scalar(&recording, sampling, lanes, count, 1, y, moments, failure, pressure);
}
"""
SCRIPT = """
const fs = require("fs"), given = JSON.parse(fs.readFileSync("given.json"));
WebAssembly.instantiate(fs.readFileSync("core.wasm")).then(({instance: {exports: core}}) => {
  const place = {};
  let end = core.__heap_base.value;
  for (const [name, hex] of Object.entries(given.arrays)) {
    const bytes = Buffer.from(hex, "hex");
    place[name] = end = 64 * Math.ceil(end / 64);
    end += bytes.length;
    const missing = end - core.memory.buffer.byteLength;
    if (missing > 0) core.memory.grow(Math.ceil(missing / 65536));
    new Uint8Array(core.memory.buffer).set(bytes, place[name]);
  }
  for (const [name, words] of given.calls) core[name](...words.map((word) => place[word] ?? word));
  for (const [name, hex] of Object.entries(given.arrays))
    given.arrays[name] = Buffer.from(core.memory.buffer, place[name], hex.length / 2).toString("hex");
  console.log(JSON.stringify(given.arrays));
});
"""


def compiled(folder: Path) -> None:
    """Compile the core and the harness to `folder`/core.wasm."""
    for name, text in {**HEADERS, "harness.c": HARNESS}.items():
        (folder / name).write_text(text)
    options = ["--target=wasm32", "-ffreestanding", "-nostdlib", "-mbulk-memory", "-isystem", "."]
    options += ["-I", str(FOLDER), "-Wl,--no-entry", "-Wl,--export=__heap_base"]
    sources = [str(FOLDER / f"{name}.c") for name in ("full_order", "replay")]
    command = ["clang", *FLAGS, *options, "harness.c", *sources, "-o", "core.wasm"]
    subprocess.run(command, cwd=folder, check=True)


@pytest.mark.parametrize("name", ["E06", "E13"])
def test_results_in_webassembly_are_the_native_ones(name, tmp_path):
    compiled(tmp_path)
    e, (lanes, _) = lasting(name, 1.0), grid_lanes(STUDY.n, 1.4)
    native, steps = record(e), round(e.duration / e.h)
    replays = replay_one_by_one(native, lanes, EXACT_SAMPLING)
    structs = {
        "drive": ("Drive", e.drive),
        "plant": ("Plant", e.plant),
        "sampling": ("Sampling", EXACT_SAMPLING),
    }
    arrays = {key: bytes(core.ffi.buffer(core.struct(*of))) for key, of in structs.items()}
    filled = {
        "y_0": native.states[0],
        "reference": native.reference,
        "states": np.zeros_like(native.states),
        "halvings": np.zeros(steps, np.int8),
        "u": native.u,
        "lanes": lanes,
        "y": first_states(native, lanes, EXACT_SAMPLING),
        "moments": np.zeros((len(lanes), 2, 2)),
        "failure": np.zeros((len(lanes), 2), np.int64),
        "pressure": np.zeros((len(lanes), 2, steps + 1)),
    }
    arrays |= {key: np.ascontiguousarray(values).tobytes() for key, values in filled.items()}
    assert len(arrays["lanes"]) == 8 * len(Lane._fields) * len(lanes)
    simulated = ["y_0", "reference", steps, "drive", "plant", e.h, "states", "halvings"]
    replayed = ["states", "reference", "u", steps, "drive", "plant", e.h, "halvings", "sampling", "lanes"]
    replayed += [len(lanes), "y", "moments", "failure", "pressure"]
    given = {"arrays": {key: value.hex() for key, value in arrays.items()}}
    given["calls"] = [["simulated", simulated], ["replayed", replayed]]
    (tmp_path / "given.json").write_text(json.dumps(given))
    done = subprocess.run(["node", "-e", SCRIPT], cwd=tmp_path, check=True, capture_output=True, text=True)
    results = json.loads(done.stdout)
    states, pressure = (np.frombuffer(bytes.fromhex(results[key])) for key in ("states", "pressure"))
    assert np.array_equal(states, native.states.ravel())
    assert np.array_equal(pressure, replays.pressure.ravel(), equal_nan=True)
