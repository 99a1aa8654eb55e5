"""Files that others made: only a regular file of a known size is read, wherever it is named."""

import os

import pytest
from netCDF4 import Dataset

from paper.study.kept_evidence import evidence_file
from pneumo.errors import InputError, ResultError
from pneumo.regular_file import regular_file
from pneumo.storage.files import atomic, output_folder, read, write_text

SIGNAL = "experiments: {open: {signal: {kind: csv, file: pipe.csv, column: u, hold_s: 0.1}}}"
TABLE = "cylinders: pipe.csv"
READERS = {
    "configuration": ["check", "pipe.csv"],
    "signal": ["check", "cylinder.yaml", "signal.yaml"],
    "table": ["check", "table.yaml"],
    "record": ["fit", "pipe.csv", "--config", "cylinder.yaml"],
    "columns": ["fit", "pipe.csv", "--config", "cylinder.yaml", "--columns", "pipe.csv"],
    "copied": ["init", "new.yaml", "--from", "pipe.csv"],
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


@pytest.mark.parametrize("name", ["fleet.nc", "fleet.json"])
def test_so_is_a_pipe_among_results(tmp_path, name):
    os.mkfifo(tmp_path / name)
    with pytest.raises(OSError, match="not a regular file"), regular_file(tmp_path / name, 10):
        pass
    assert evidence_file(tmp_path, name, "a" * 64) == tmp_path / name  # what reads it refuses it


def test_a_small_file_that_would_fill_the_memory_is_refused_before_it_is_loaded(inside, tmp_path):
    for name in ("fleet.nc", "record.nc"):
        with Dataset(tmp_path / name, "w") as file:
            file.source = "pneumo: numerical simulation"
            file.createDimension("a", 200_000)
            file.createDimension("b", 100_000)
            file.createVariable("block", "f8", ("a", "b"), zlib=True)
    assert (tmp_path / "fleet.nc").stat().st_size < 30_000
    with pytest.raises(ResultError) as error:
        read(tmp_path / "fleet.nc")
    words = "block would take 160000000000 bytes of memory: at most 8000000000 for all"
    assert words in str(error.value)
    inside("init")
    code, _, err = inside("fit", "record.nc", "--config", "cylinder.yaml")
    assert code == 2 and len(err.splitlines()) == 1


def test_a_link_prepared_under_the_name_of_a_temporary_file_is_not_followed(tmp_path):
    precious = tmp_path / "precious"
    precious.write_text("kept")
    for name in ("study.html.part", ".study.html.0123456789abcdef.part", "study.html"):
        (tmp_path / name).symlink_to(precious)
    write_text("page", tmp_path / "study.html")
    assert precious.read_text() == "kept" and (tmp_path / "study.html").read_text() == "page"
    with atomic(tmp_path / "study.html") as one, atomic(tmp_path / "other.html") as two:
        assert one.stat().st_size == 0 and len({one.name, two.name, "study.html.part"}) == 3


def test_a_new_file_has_the_rights_that_the_umask_leaves(tmp_path):
    before = os.umask(0o027)
    try:
        write_text("page", tmp_path / "a")
    finally:
        os.umask(before)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_folder_takes_the_output_of_one_process_and_is_removed_if_nothing_came(tmp_path):
    folder = tmp_path / "new/study"
    with output_folder(folder):
        with (
            pytest.raises(InputError, match=r"study: another pneumo writes there; wait"),
            output_folder(folder),
        ):
            pass
        assert folder.is_dir()
    assert not folder.exists()
    with output_folder(folder):
        write_text("page", folder / "study.html")
    assert [file.name for file in folder.iterdir()] == ["study.html"]


def test_a_second_study_leaves_the_first_in_peace(inside, tmp_path):
    inside("init")
    (tmp_path / "quick.yaml").write_text("n: [1.2, 1.3]\nrun: {seeds: 1, duration_limit_s: 0.3}\n")
    with output_folder(tmp_path / "study-cylinder-quick"):
        code, out, err = inside("study", "cylinder.yaml", "quick.yaml")
        assert (code, out) == (2, "") and "another pneumo writes there" in err
        assert (tmp_path / "study-cylinder-quick").is_dir()
