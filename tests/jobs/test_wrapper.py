"""Frame of a job: arguments, log, exit code."""

import errno
import inspect
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from snakemake.iocontainers import InputFiles, OutputFiles, Params, Wildcards
from workflow_scripts import SCRIPTS, script

from paper_verdict.errors import PaperError
from pneumo.errors import ResultError, RunError
from pneumo.selection.cylinder_template import write_table_template
from workflow.jobs.wrapper import run_job


@pytest.fixture
def job(run_folder):
    before = signal.getsignal(signal.SIGINT)
    yield SimpleNamespace(
        input=InputFiles(fromdict={"parameters": "parameters.json"}),
        output=OutputFiles(toclone=["one.nc", "two.nc"]),
        params=Params(fromdict={"code": "abc"}),
        wildcards=Wildcards(fromdict={"first": "020"}),
        threads=2,
        log=[str(run_folder / "job.log")],
        rule="rule",
    )
    signal.signal(signal.SIGINT, before)


def log_of(job):
    return Path(job.log[0]).read_text(encoding="utf-8")


def failing(error):
    def main():
        raise error

    return main


def loaded(monkeypatch, cache, *configs):
    """The workflow that Snakemake reads in the checkout."""
    from snakemake.api import SnakemakeApi  # half a second, which no other test needs
    from snakemake.settings.types import ConfigSettings, ResourceSettings

    monkeypatch.chdir(SCRIPTS.parents[1])
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))  # for sources of Snakemake; HOME may be read-only
    monkeypatch.setattr(sys, "executable", sys.executable)  # the Snakefile quotes it
    with SnakemakeApi() as api:
        settings = ResourceSettings(cores=1), ConfigSettings(configfiles=list(configs))
        return api.workflow(*settings, snakefile=Path("Snakefile"))._workflow


def test_every_rule_gives_its_script_what_it_takes(monkeypatch, tmp_path):
    write_table_template(tmp_path / "fleet.yaml")
    rules = []
    for configs in ([tmp_path / "fleet.yaml"], []):  # that of a table has rules of its own
        workflow = loaded(monkeypatch, tmp_path, *configs)
        rules += [rule for rule in workflow.rules if rule.script]
    for rule in rules:
        named = [*rule.input.keys(), *rule.output.keys(), *rule.params.keys()]
        given = [*named, *rule.wildcard_names, "threads"]
        assert len(given) == len(set(given)), f"{rule.name}: two values of one name"
        assert set(inspect.signature(script(Path(rule.script).stem)).parameters) <= set(given), rule.name
    assert {Path(rule.script).name for rule in rules} == {file.name for file in SCRIPTS.glob("*.py")}


FULL = OSError(errno.ENOSPC, "no space left on device")
FORBIDDEN = PermissionError(errno.EACCES, "permission denied")
FAILING = [
    OSError(number, os.strerror(number), "results/E01.nc")
    for number in (errno.EIO, errno.ESTALE, errno.ETIMEDOUT, errno.EMFILE)
]


@pytest.mark.parametrize(
    "error",
    [
        ResultError("E01.nc: broken"),
        PaperError("claims.yaml: broken"),
        RunError("not settled"),
        FULL,
        FORBIDDEN,
        *FAILING,
    ],
)
def test_an_error_to_mend_is_one_line_and_exit_2(job, error, capsys):
    with pytest.raises(SystemExit) as end:
        run_job(failing(error), {"snakemake": job})
    assert end.value.code == 2
    assert capsys.readouterr().err == f"pneumo: {error}\n"
    assert log_of(job) == f"{error}\n"


BUSY = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from workflow.jobs.wrapper import run_job

def main():
    with ThreadPoolExecutor(1) as pool:
        work = pool.submit(time.sleep, 60)  # as a kernel does that holds no lock
        print("at work", flush=True)
        work.result()

nothing = SimpleNamespace(items=lambda: ())
files = {"input": nothing, "output": nothing, "log": ["log"]}
job = SimpleNamespace(**files, params={}, wildcards={}, threads=1, rule="rule")
run_job(main, {"snakemake": job})
"""


def test_an_interrupt_ends_a_job_at_once_without_a_word(run_folder):
    command = [sys.executable, "-c", BUSY]
    options = {"env": os.environ | {"PYTHONPATH": str(SCRIPTS.parents[1])}, "text": True}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options) as busy:
        assert busy.stdout
        assert busy.stdout.readline() == "at work\n"
        busy.send_signal(signal.SIGINT)
        _, error = busy.communicate(timeout=30)  # not the sixty seconds of the thread
    assert (busy.returncode, error) == (-signal.SIGINT, "")
