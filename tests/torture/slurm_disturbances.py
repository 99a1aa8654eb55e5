"""What happens to jobs of a cluster: one is killed, one hangs until its time is over, the node is drained."""

import subprocess
import time
from collections.abc import Callable
from typing import NamedTuple, TypeVar

T = TypeVar("T")
LONGEST = 600.0  # s, until what is waited for must have happened
AT_WORK = 5.0  # s, that a job runs before something happens to it
PAUSE = 10.0  # s, that the node stays drained


class Job(NamedTuple):
    """A job as Slurm tells of it."""

    number: str
    state: str
    time_limit: str
    task: str  # rule and wildcards, as Snakemake's executor writes them into the comment


def told(*command: str) -> str:
    """Return what a command of Slurm prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def jobs(*states: str) -> list[Job]:
    """Return the jobs in some states, in the order of their numbers."""
    listed = told("squeue", "--noheader", "--sort=i", f"--states={','.join(states)}", "--format=%i|%T|%l|%k")
    return [Job(*line.split("|")) for line in listed.splitlines()]


def awaited(found: Callable[[], T], what: str, run: subprocess.Popen[str]) -> T:
    """Ask until there is something, and return it; end if the run does, or after `LONGEST`."""
    end = time.monotonic() + LONGEST
    while not (answer := found()):
        if run.poll() is not None or time.monotonic() > end:
            raise SystemExit(f"slurm-test: {what}: did not happen")
        time.sleep(0.5)
    return answer


def running(run: subprocess.Popen[str]) -> Job:
    """Wait for a job that is at work."""
    job = awaited(lambda: jobs("RUNNING"), "a job runs", run)[0]
    time.sleep(AT_WORK)
    return job


def ended(job: Job, state: str, run: subprocess.Popen[str]) -> None:
    """Wait until a job has ended in a state."""
    awaited(lambda: any(each.number == job.number for each in jobs(state)), f"{job.task}: {state}", run)


def kill(run: subprocess.Popen[str]) -> Job:
    """Cancel a job that runs."""
    job = running(run)
    told("scancel", job.number)
    ended(job, "CANCELLED", run)
    return job


def let_hang(run: subprocess.Popen[str]) -> Job:
    """Stop the processes of a job, and lower its limit to a minute, over which it then is."""
    job = running(run)
    told("scancel", "--signal=STOP", "--full", job.number)
    told("scontrol", "update", f"JobId={job.number}", "TimeLimit=1")
    ended(job, "TIMEOUT", run)
    return job


def drain(run: subprocess.Popen[str]) -> Job:
    """Drain the node while a job runs: it ends, no other begins; then resume."""
    job = running(run)
    node = told("sinfo", "--noheader", "--format=%n").strip()
    told("scontrol", "update", f"NodeName={node}", "State=DRAIN", "Reason=slurm-test")
    awaited(lambda: "drained" in told("sinfo", "--noheader", "--format=%T"), "the node is drained", run)
    time.sleep(PAUSE)
    if jobs("RUNNING") or not jobs("PENDING"):
        raise SystemExit("slurm-test: no job waits for the drained node")
    told("scontrol", "update", f"NodeName={node}", "State=RESUME")
    awaited(lambda: jobs("RUNNING"), "a job runs again", run)
    return job


Disturbance = Callable[[subprocess.Popen[str]], Job]
DISTURBANCES: dict[str, Disturbance] = {
    "killed": kill,
    "over its time limit": let_hang,
    "at work when the node was drained": drain,
}
RETRIED = 2  # of them end the job, which then runs again
