"""Bad input of every kind ends in one line and exit code 2, and writes nothing.

`make fuzz` tries 10 000 inputs and records them in results/evidence/fuzz.json; `make test` tries some 100
and `make test-all` 500, always the same.
"""

import contextlib
import io
import json
import os
import shutil
import subprocess
import sys
import time
import traceback
import tracemalloc
from collections import Counter
from pathlib import Path

import bad_input
import netCDF4
import pytest
from brief import in_brief
from checkout import PNEUMO, ROOT
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import paper.study.paper_2006.paper  # noqa: F401
from pneumo.cli import commands as cli

TRIES = int(os.environ.get("FUZZ", "500"))
RECORD = "FUZZ" in os.environ
LONGEST_LINE = 2000

in_printed = pytest.mark.xdist_group("printed")

tried: Counter[str] = Counter()  # by kind of mistake
totals: Counter[str] = Counter()  # tracebacks, files_written, accepted
written: list[str] = []
watching = [False]


def watch(event, arguments):
    """Notice every file that is opened for writing, made, renamed or removed, and every new process.

    Bytecode of modules that Python meets for the first time does not count, nor does a descriptor that was
    opened before (a worker's pipe to pytest, in another thread): the opening of its file was noticed by name.
    A command that could not read or write leaves its output to the null device, which is no file.
    """
    if not watching[0] or ".pyc" in str(arguments):
        return
    if event == "open":
        path, mode, flags = arguments
        writes = isinstance(mode, str) and set(mode) & set("wax+")
        no_file = isinstance(path, int) or path == os.devnull
        if not no_file and (writes or (flags or 0) & (os.O_WRONLY | os.O_RDWR)):
            written.append(str(path))
    elif event in ("os.mkdir", "os.rename", "os.remove", "subprocess.Popen", "os.system", "socket.connect"):
        written.append(f"{event} {arguments}")


sys.addaudithook(watch)


@pytest.fixture(scope="module", autouse=True)
def evidence():
    start = time.perf_counter()
    yield
    if RECORD:
        counts = {"tracebacks": totals["tracebacks"], "files_written": totals["files_written"]}
        record = {"tried": tried.total(), **counts, "by_kind": dict(sorted(tried.items()))}
        (ROOT / "results" / "evidence").mkdir(parents=True, exist_ok=True)
        (ROOT / "results" / "evidence" / "fuzz.json").write_text(json.dumps(record, indent=1) + "\n")
        print(f"\n{tried.total()} bad inputs in {time.perf_counter() - start:.0f} s: {counts}")
        assert tried.total() >= TRIES


def run(*arguments):
    """Exit code, standard output and standard error of a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    argv, sys.argv = sys.argv, ["pneumo", *arguments]
    written.clear()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            watching[0] = True
            cli.main()
    except SystemExit as error:
        code = error.code or 0
    except BaseException:
        totals["tracebacks"] += 1
        code, _ = 1, err.write(traceback.format_exc())
    finally:
        watching[0] = False
        sys.argv = argv
    totals["files_written"] += len(written)
    return code, out.getvalue(), err.getvalue()


def assert_one_line(code, out, err, *words):
    assert (code, out) == (2, ""), err
    assert err.startswith("pneumo: ") and err.endswith("\n")
    line = err[:-1]
    assert line.isprintable() and len(line) <= LONGEST_LINE, line[:3000]
    assert all(word in line for word in words), (words, line)


def trying(share):
    """Settings of a test that gets its share of all tries."""
    options = {"derandomize": not RECORD, "database": None, "suppress_health_check": list(HealthCheck)}
    return settings(max_examples=int(TRIES * share), **options)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """An empty folder to work in."""
    return tmp_path_factory.mktemp("fuzz")


@pytest.fixture(autouse=True)
def work_there(folder, monkeypatch):
    monkeypatch.chdir(folder)


def assert_refused(folder, mistake):
    (folder / "mine.yaml").write_bytes(mistake.content)
    code, out, err = run("check", "mine.yaml")
    if code == 0 and mistake.kind == "missing" and not mistake.words:
        return  # a smaller study
    tried[f"configuration: {mistake.kind}"] += 1
    assert not written
    assert_one_line(code, out, err, "mine.yaml: ", *mistake.words)


@trying(0.1)
@given(mistake=bad_input.mistakes())
def test_configuration(folder, mistake):
    assert_refused(folder, mistake)


@pytest.mark.slow
@trying(0.85)
@given(mistake=bad_input.mistakes())
def test_more_configurations(folder, mistake):
    assert_refused(folder, mistake)


@trying(0.15)
@given(arguments=bad_input.command_lines())
def test_command_line(folder, arguments):
    code, out, err = run(*arguments)
    if code == 0:
        assert out and not err  # a right one
        return
    tried["command line"] += 1
    assert not written
    assert_one_line(code, out, err)


@pytest.fixture(scope="module")
def study(printed_once, tmp_path_factory):
    """A copy, to be spoilt."""
    return Path(shutil.copytree(printed_once, tmp_path_factory.mktemp("study") / "results"))


FOREIGN = [b"", b"hello\n", b"\x89HDF\r\n\x1a\n" + bytes(100), b"CDF\x01", b"[]", b"{", b"{}", b"\xff"]
FOREIGN += [b"[" * 99_999]
COMMANDS = {  # by the file that each reads
    "published/replay/E07.nc": ("explain", "E07", "M8", "1.35"),
    "published/statistics.nc": ("explain", "T7.M8.mse"),
    "parameters.json": ("verdict",),
}


def assert_foreign_file_is_refused(study, data):
    name = data.draw(st.sampled_from(sorted(COMMANDS)))
    file = study / name
    content = data.draw(st.sampled_from([*FOREIGN, None, "netCDF"]))
    original = file.read_bytes()
    file.unlink()
    try:
        if content == "netCDF":
            with netCDF4.Dataset(file, "w") as dataset:
                dataset.createDimension("n", 3)
                dataset.createVariable("mse", "f8", ("n",)).units = "days since nonsense"
        elif content is None:
            file.mkdir()
        else:
            file.write_bytes(content)
        code, out, err = run("paper", *COMMANDS[name], "--results", str(study))
    finally:
        file.rmdir() if content is None else file.unlink()
        file.write_bytes(original)
    tried["foreign file"] += 1
    assert not written
    assert_one_line(code, out, err, file.name)


@in_printed
@trying(0.006)
@given(data=st.data())
def test_results_folder_with_foreign_files(study, data):
    assert_foreign_file_is_refused(study, data)


@in_printed
@pytest.mark.slow
@trying(0.014)
@given(data=st.data())
def test_results_folder_with_more_foreign_files(study, data):
    assert_foreign_file_is_refused(study, data)


NO_NUMBERS = ["nan", "inf", "-1", "1.36", "1e999", "x", ""]
NO_NAMES = ["../replay/E07", "/etc/passwd", "..", "E07/../E08", "", "E07.nc", "\0", "E" * 999]


@in_printed
@pytest.mark.parametrize(
    ("kind", "cell", "words"),
    [
        *(("n", ("E07", "M8", n), ("n = ", "must be")) for n in NO_NUMBERS),
        *(("experiment", (name, "M8", "1.35"), ("must be a name",)) for name in NO_NAMES),
    ],
)
def test_neither_n_nor_names_leave_grid_and_folder(study, kind, cell, words):
    tried[kind] += 1
    assert_one_line(*run("paper", "explain", "--results", str(study), "--", *cell), *words)


@pytest.mark.parametrize("text", [bad_input.LAUGHS, bad_input.MERGES, "x: " + "[" * 1_000])
def test_small_files_do_not_become_large(folder, text):
    (folder / "mine.yaml").write_text(text)
    tracemalloc.start()
    try:
        assert_one_line(*run("check", "mine.yaml"), "nested" if "[[" in text else "anchor or alias")
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()


def test_a_key_given_twice_and_an_endless_file_are_refused(folder):
    (folder / "mine.yaml").write_text("name: one\nname: two\n")
    assert_one_line(*run("check", "mine.yaml"), "key 'name' is given twice")
    assert_one_line(*run("check", "/dev/zero"), "not a regular file")


def test_a_write_would_be_noticed(folder, monkeypatch):
    monkeypatch.setattr(cli, "app", lambda **_: (folder / "oops").write_text("x"))
    run("models")
    assert written and totals["files_written"]
    totals["files_written"] -= len(written)


EXPLAINED = ([], ["a", "b"], ["T99"], ["E07", "M8", "x"], ["../x", "M8", "1"])
REAL = [
    *([], ["chek"], ["check"], ["check", "nowhere.yaml"], ["check", "."], ["paper"], ["models", "x"]),
    *(["paper", "explain", *words] for words in EXPLAINED),
    *(["paper", "verdict", "--results", "nowhere"], ["--nothing"], ["check", "\udcff"], ["check", "é\n"]),
    *(["check", text] for text in ("{", "name: !!python/name:os.system", "a: &a [*a]", "gas: 1", "n: .nan")),
]


@pytest.mark.parametrize("arguments", REAL if RECORD else in_brief(REAL[::5], REAL[::10]))
def test_real_command(folder, arguments):
    if len(arguments) == 2 and (":" in arguments[1] or arguments[1] == "{"):
        (folder / "real.yaml").write_text(arguments[1])
        arguments = ["check", "real.yaml"]
    before = sorted(folder.rglob("*"))
    command = [*PNEUMO, *map(os.fsencode, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    tried["real command"] += 1
    totals["tracebacks"] += "Traceback" in done.stderr
    assert_one_line(done.returncode, done.stdout, done.stderr)
    assert sorted(folder.rglob("*")) == before
