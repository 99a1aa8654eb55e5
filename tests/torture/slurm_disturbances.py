"""Disturbances on a cluster: a job is killed, a job exceeds its time limit, the node is drained."""

import subprocess
import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

T = TypeVar("T")
LONGEST = 600.0  # s, that an event may take
AT_WORK = 5.0  # s, that a job runs before it is disturbed
PAUSE = 10.0  # s, that the node stays drained


class Job(NamedTuple):
    """A job as `squeue` lists it."""

    number: str
    state: str
    time_limit: str
    task: str  # rule and wildcards, as Snakemake's executor writes them into the comment


def output_of(*command: str) -> str:
    """Output of a Slurm command."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def jobs(*states: str) -> list[Job]:
    """Jobs in the given states, by number."""
    of_states = f"--states={','.join(states)}"
    listed = output_of("squeue", "--noheader", "--sort=i", of_states, "--format=%i|%T|%l|%k")
    return [Job(*line.split("|")) for line in listed.splitlines()]


def awaited(probe: Callable[[], T], what: str, run: subprocess.Popen[str]) -> T:
    """Ask until the answer is true and return it; stop when the run ends, or after `LONGEST`."""
    end = time.monotonic() + LONGEST
    while not (answer := probe()):
        if run.poll() is not None or time.monotonic() > end:
            raise SystemExit(f"slurm-test: {what}: did not happen")
        time.sleep(0.5)
    return answer


def running(run: subprocess.Popen[str]) -> Job:
    """Wait until a job runs, and return it."""
    job = awaited(lambda: jobs("RUNNING"), "a job runs", run)[0]
    time.sleep(AT_WORK)
    return job


def ended(job: Job, state: str, run: subprocess.Popen[str]) -> None:
    """Wait until a job has ended in a state."""
    awaited(lambda: any(each.number == job.number for each in jobs(state)), f"{job.task}: {state}", run)


def kill(run: subprocess.Popen[str]) -> Job:
    """Cancel a job that runs."""
    job = running(run)
    output_of("scancel", job.number)
    ended(job, "CANCELLED", run)
    return job


def let_hang(run: subprocess.Popen[str]) -> Job:
    """Stop the processes of a job and lower its time limit to a minute, which it then exceeds."""
    job = running(run)
    output_of("scancel", "--signal=STOP", "--full", job.number)
    output_of("scontrol", "update", f"JobId={job.number}", "TimeLimit=1")
    ended(job, "TIMEOUT", run)
    return job


def drain(run: subprocess.Popen[str]) -> Job:
    """Drain the node while a job runs: that job ends and no other starts; then resume."""
    job = running(run)
    node = output_of("sinfo", "--noheader", "--format=%n").strip()
    output_of("scontrol", "update", f"NodeName={node}", "State=DRAIN", "Reason=slurm-test")
    awaited(lambda: "drained" in output_of("sinfo", "--noheader", "--format=%T"), "the node is drained", run)
    time.sleep(PAUSE)
    if jobs("RUNNING") or not jobs("PENDING"):
        raise SystemExit("slurm-test: no job waits for the drained node")
    output_of("scontrol", "update", f"NodeName={node}", "State=RESUME")
    awaited(lambda: jobs("RUNNING"), "a job runs again", run)
    return job


Disturbance = Callable[[subprocess.Popen[str]], Job]
DISTURBANCES: dict[str, Disturbance] = {
    "killed": kill,
    "over its time limit": let_hang,
    "at work when the node was drained": drain,
}
RETRIED = 2  # of them end the job, which then runs again
