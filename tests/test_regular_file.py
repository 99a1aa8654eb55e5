"""Files that others made: only a regular file of a known size is read, wherever it is named."""

import os

import pytest

SIGNAL = "experiments: {open: {signal: {kind: csv, file: pipe.csv, column: u, hold_s: 0.1}}}"
TABLE = "cylinders: pipe.csv"
READERS = {
    "configuration": ["check", "pipe.csv"],
    "signal": ["check", "cylinder.yaml", "signal.yaml"],
    "table": ["check", "table.yaml"],
    "record": ["fit", "pipe.csv", "--config", "cylinder.yaml"],
    "columns": ["fit", "pipe.csv", "--config", "cylinder.yaml", "--columns", "pipe.csv"],
}


@pytest.mark.parametrize("endless", ["pipe", "/dev/zero"])
@pytest.mark.parametrize("arguments", READERS.values(), ids=READERS)
def test_a_pipe_or_a_device_is_refused_at_once(inside, tmp_path, arguments, endless):
    inside("init")
    (tmp_path / "signal.yaml").write_text(SIGNAL)
    (tmp_path / "table.yaml").write_text(TABLE)
    if endless == "pipe":
        os.mkfifo(tmp_path / "pipe.csv")
    else:
        (tmp_path / "pipe.csv").symlink_to(endless)
    code, out, err = inside(*arguments)
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and "not a regular file" in err
