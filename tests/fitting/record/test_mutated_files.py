"""Damaged files: one line or a reading, never another error; a library may crash or ask for much memory."""

import importlib
import os
import random
import sys
import tempfile
from functools import cache
from pathlib import Path

import pytest
import test_loggers
import written_records as written
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumo.errors import InputError
from pneumo.fitting.record.measurement import Measurement, read_measurement
from pneumo.fitting.record.reader_process import LARGEST_MEMORY, isolated

LOGGERS = {kind: text for kind, (text, _) in (test_loggers.CHANNELS | test_loggers.CLOCKS).items()}
KINDS = (*LOGGERS, *written.COMMON, *(f"two rates: {kind}" for kind in written.RATES))


def is_text(kind):
    return kind in LOGGERS or written.is_text(kind)


OF_LIBRARIES = [kind for kind in KINDS if not is_text(kind)]
SEEDS = st.integers(0, 2**32)


@cache
def whole(kind):
    if kind in LOGGERS:
        return "a.csv", LOGGERS[kind].encode()
    name, content = written.content(kind)
    pytest.importorskip(written.LIBRARIES.get(Path(name).suffix, "numpy"))
    return name, content


def damaged(content, rng):
    """The content with up to three changes: flipped bits, a cut, rows swapped, a part left out."""
    data = bytearray(content)
    for change in rng.choices(["bits", "header", "cut", "rows", "hole"], k=rng.randint(1, 3)):
        if change == "cut":
            del data[rng.randrange(len(data) + 1) :]
        elif change == "rows":
            rows = bytes(data).split(b"\n")
            i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
            rows[i], rows[j] = rows[j], rows[i]
            data = bytearray(b"\n".join(rows))
        elif change == "hole":
            i = rng.randrange(len(data) + 1)
            del data[i : i + rng.randint(1, 100)]
        else:
            end = min(len(data), 400) if change == "header" else len(data)
            for _ in range(rng.choice([1, 3, 30]) if data else 0):
                data[rng.randrange(end)] ^= 1 << rng.randrange(8)
    return bytes(data)


def check(kind, seed):
    name, content = whole(kind)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_bytes(damaged(content, random.Random(seed)))
        try:
            found = read_measurement(file, written.plant(), test_loggers.MAPPINGS.get(kind))
        except InputError as error:
            assert len(str(error).splitlines()) == 1
        else:
            assert isinstance(found, Measurement) and len(found.u) == len(found.x) == found.P.shape[1]


@settings(max_examples=100, deadline=None)  # `make soak`: 2,000
@given(kind=st.sampled_from([kind for kind in KINDS if is_text(kind)]), seed=SEEDS)
def test_a_damaged_text_gives_one_line_or_a_reading(kind, seed):
    check(kind, seed)


@settings(max_examples=5, deadline=None)  # `make soak`: 100; each starts a process
@given(kind=st.sampled_from(OF_LIBRARIES), seed=SEEDS)
def test_a_damaged_file_of_a_library_gives_one_line_or_a_reading(kind, seed):
    check(kind, seed)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded on Linux only")
def test_a_library_may_not_fill_the_memory():
    with pytest.raises(ValueError, match="800 MB of memory"):
        isolated(bytes, 2 * LARGEST_MEMORY)


def test_a_library_may_crash_or_be_missing():
    with pytest.raises(ValueError, match="crashes the library"):
        isolated(os._exit, 1)
    with pytest.raises(ImportError):
        isolated(importlib.import_module, "no_such_library")
