"""Bad input of every kind ends in one line and exit code 2, and writes nothing."""

import contextlib
import io
import shutil
import traceback
import tracemalloc
from pathlib import Path

import bad_input
import netCDF4
import pytest
from bad_input import assert_one_line
from brief import in_brief
from hypothesis import HealthCheck, given, settings

from pneumo.cli import commands as cli

LONGEST_LINE = 2000

in_printed = pytest.mark.xdist_group("printed")


def run(*arguments):
    """Exit code, standard output and standard error of a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        patch.setattr("sys.argv", ["pneumo", *arguments])
        try:
            cli.main()
        except SystemExit as error:
            code = error.code or 0
        except BaseException:
            code = 1
            err.write(traceback.format_exc())
    return code, out.getvalue(), err.getvalue()


def assert_refused(done, *words):
    assert_one_line(done, *words)
    line = done[2][:-1]
    assert line.isprintable() and len(line) <= LONGEST_LINE, line[:3000]


def trying(count):
    """Settings of a test of so many inputs, always the same."""
    options = {"derandomize": True, "database": None, "suppress_health_check": list(HealthCheck)}
    return settings(max_examples=count, **options)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, in which nothing may appear."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").touch()
    yield tmp_path
    assert [file.name for file in tmp_path.iterdir()] == ["mine.yaml"]


@trying(30)
@given(mistake=bad_input.mistakes())
def test_configuration(folder, mistake):
    (folder / "mine.yaml").write_bytes(mistake.content)
    done = run("check", "mine.yaml")
    if done[0] or mistake.kind != "missing" or mistake.words:  # else a smaller study
        assert_refused(done, "mine.yaml: ", *mistake.words)


@trying(40)
@given(arguments=bad_input.command_lines())
def test_command_line(folder, arguments):
    code, out, err = run(*arguments)
    if code == 0:
        assert out and not err  # a right one
    else:
        assert_refused((code, out, err))


@pytest.fixture(scope="module")
def study(printed_once, tmp_path_factory):
    """A copy, to be spoilt."""
    return Path(shutil.copytree(printed_once, tmp_path_factory.mktemp("study") / "results"))


FOREIGN = [b"", b"hello\n", b"\x89HDF\r\n\x1a\n" + bytes(100), b"[]", b"{", b"\xff", b"[" * 99_999]
COMMANDS = {  # by the file that each reads
    "published/replay/E07.nc": ("explain", "E07", "M8", "1.35"),
    "published/statistics.nc": ("explain", "T7.M8.mse"),
    "parameters.json": ("verdict",),
}


@in_printed
@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("content", in_brief([*FOREIGN, None, "netCDF"], [FOREIGN[2], None, "netCDF"]))
def test_results_folder_with_a_foreign_file(study, name, content):
    file = study / name
    original = file.read_bytes()
    file.unlink()
    if content == "netCDF":
        with netCDF4.Dataset(file, "w") as dataset:
            dataset.createDimension("n", 3)
            dataset.createVariable("mse", "f8", ("n",)).units = "days since nonsense"
    elif content is None:
        file.mkdir()
    else:
        file.write_bytes(content)
    try:
        assert_refused(run("paper", *COMMANDS[name], "--results", str(study)), file.name)
    finally:
        file.rmdir() if content is None else file.unlink()
        file.write_bytes(original)


NO_NUMBERS = ["nan", "inf", "-1", "1.36", "1e999", "x", ""]
NO_NAMES = ["../replay/E07", "/etc/passwd", "..", "E07/../E08", "", "E07.nc", "\0", "E" * 999]


@in_printed
@pytest.mark.parametrize(
    ("cell", "words"),
    [
        *((("E07", "M8", n), ("n = ", "must be")) for n in NO_NUMBERS),
        *(((name, "M8", "1.35"), ("must be a name",)) for name in NO_NAMES),
    ],
)
def test_neither_n_nor_names_leave_grid_and_folder(study, cell, words):
    assert_refused(run("paper", "explain", "--results", str(study), "--", *cell), *words)


@pytest.mark.parametrize("text", [bad_input.LAUGHS, bad_input.MERGES, "x: " + "[" * 1_000])
def test_small_files_do_not_become_large(folder, text):
    (folder / "mine.yaml").write_text(text)
    tracemalloc.start()
    try:
        assert_refused(run("check", "mine.yaml"), "nested" if "[[" in text else "anchor or alias")
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()


def test_a_key_given_twice_and_an_endless_file_are_refused(folder):
    (folder / "mine.yaml").write_text("name: one\nname: two\n")
    assert_refused(run("check", "mine.yaml"), "key 'name' is given twice")
    assert_refused(run("check", "/dev/zero"), "not a regular file")
