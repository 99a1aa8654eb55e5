"""Damaged files: one line or a reading, never another error, and never much memory."""

import random
import tempfile
from functools import cache
from pathlib import Path

import pytest
import written_records as written
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumo.errors import InputError
from pneumo.fitting.record.measurement import Measurement, read_measurement
from pneumo.fitting.record.reader_process import READER

KINDS = (*written.COMMON, *(f"two rates: {kind}" for kind in written.RATES))
MOST_MEMORY = 1_000_000  # kB


@cache
def whole(kind):
    name, content = written.content(kind)
    pytest.importorskip(written.LIBRARIES.get(Path(name).suffix, "numpy"))
    return name, content


def damaged(content, rng):
    """The content with up to three changes: flipped bits, a cut, rows swapped, a part left out."""
    data = bytearray(content)
    for _ in range(rng.randint(1, 3)):
        change = rng.choice(["bits", "header", "cut", "rows", "hole"])
        if not data:
            break
        if change == "cut":
            data = data[: rng.randrange(len(data))]
        elif change == "rows":
            rows = bytes(data).split(b"\n")
            i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
            rows[i], rows[j] = rows[j], rows[i]
            data = bytearray(b"\n".join(rows))
        elif change == "hole":
            i = rng.randrange(len(data))
            del data[i : i + rng.randint(1, 100)]
        else:
            end = min(len(data), 400) if change == "header" else len(data)
            for _ in range(rng.choice([1, 1, 3, 30])):
                data[rng.randrange(end)] ^= 1 << rng.randrange(8)
    return bytes(data)


@settings(max_examples=500, deadline=None)  # `make soak`: 10,000
@given(kind=st.sampled_from(KINDS), seed=st.integers(0, 2**32))
def test_a_damaged_file_gives_one_line_or_a_reading(kind, seed):
    name, content = whole(kind)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_bytes(damaged(content, random.Random(seed)))
        try:
            found = read_measurement(file, written.plant())
        except InputError as error:
            assert len(str(error).splitlines()) == 1
        else:
            assert isinstance(found, Measurement) and len(found.u) == len(found.x) == found.P.shape[1]
    assert peak_of_reader() < MOST_MEMORY


def peak_of_reader():
    """Largest memory of the process that reads files of libraries, kB."""
    status = Path(f"/proc/{READER.process.pid}/status") if READER.process else Path("/proc/none")
    if not status.exists():
        return 0
    return next(int(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM"))
