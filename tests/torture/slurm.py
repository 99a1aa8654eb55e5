"""Run the study through its Slurm profile on a real Slurm of one node; compare the bytes with a local run.

Needs root, Debian's slurm-wlm and munge, and Snakemake's slurm executor. Everything lives in a scratch
folder, but for the link /etc/slurm/slurm.conf; all of it is taken down again.
"""

import argparse
import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tests.fleet import SHORT, write_fleet
from tests.torture.study import Study

LINK = Path("/etc/slurm/slurm.conf")
PROGRAMS = ("munged", "munge", "slurmctld", "slurmd", "sbatch", "scontrol", "squeue")
CONFIGURATION = """
ClusterName=pneumo
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
AuthType=auth/munge
AuthInfo=socket={scratch}/munge.socket
CredType=cred/munge
StateSaveLocation={scratch}/state
SlurmdSpoolDir={scratch}/spool
SlurmctldPidFile={scratch}/slurmctld.pid
SlurmdPidFile={scratch}/slurmd.pid
SlurmctldLogFile={scratch}/slurmctld.log
SlurmdLogFile={scratch}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
MinJobAge=3600
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=8000 State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
OPTIONS = (
    *("--profile", "workflow/profiles/slurm", "--cores", "2"),
    *("--slurm-no-account", "--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", "2", "--seconds-between-status-checks", "1"),
)


def free_ports(number: int) -> list[int]:
    """Ports that nothing listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(number)]
        return [each.getsockname()[1] for each in sockets]


@contextmanager
def daemon(*command: str) -> Generator[None]:
    """Keep a program at work in the background."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()


def wait_for(*command: str, word: str = "", seconds: float = 30) -> None:
    """Repeat a command until it succeeds and prints the word."""
    end = time.monotonic() + seconds
    while True:
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode == 0 and word in done.stdout:
            return
        if time.monotonic() > end:
            raise SystemExit(f"{' '.join(command)}: {done.stdout}{done.stderr}")
        time.sleep(0.5)


@contextmanager
def cluster(scratch: Path) -> Generator[None]:
    """A Slurm of one node."""
    host = socket.gethostname().split(".")[0]
    for name in ("state", "spool"):
        (scratch / name).mkdir()
    key, munge_socket = scratch / "munge.key", scratch / "munge.socket"
    key.write_bytes(secrets.token_bytes(128))
    key.chmod(0o600)
    scratch.chmod(0o755)
    ports = free_ports(2)
    configuration = CONFIGURATION.format(host=host, scratch=scratch, ports=ports, cpus=os.cpu_count())
    (scratch / "slurm.conf").write_text(configuration)
    files = [f"--{name}-file={scratch}/munge.{name}" for name in ("pid", "log", "seed")]
    with ExitStack() as stack:
        LINK.parent.mkdir(exist_ok=True)
        LINK.symlink_to(scratch / "slurm.conf")
        stack.callback(LINK.unlink)
        munged = ("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={munge_socket}")
        stack.enter_context(daemon(*munged, *files))
        wait_for("munge", f"--socket={munge_socket}", "--no-input")
        stack.enter_context(daemon("slurmctld", "-D", "-c"))
        stack.enter_context(daemon("slurmd", "-D", "-N", host))
        wait_for("sinfo", "--noheader", "--format=%T", word="idle")
        yield


def study(folder: Path, options: argparse.Namespace) -> Study:
    """Study of the configuration, or of short runs of a fleet in blocks of two cylinders."""
    if not options.cylinders:
        return Study(folder, options.config)
    found = Study(folder, "fleet.yaml")
    write_fleet(folder, options.cylinders, f"{SHORT}\n  block_size: 2")
    return found


def main() -> None:
    """Run the study both ways and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="config/smoke.yaml", help="configuration on top of the paper's")
    parser.add_argument("--cylinders", type=int, default=0, help="instead: a table of so many, in blocks")
    options = parser.parse_args()
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing or os.geteuid() or LINK.exists():
        reason = f"no {missing[0]}: install slurm-wlm and munge" if missing else "it must be root's to start"
        raise SystemExit(f"slurm-test: not run: {f'{LINK} is there already' if LINK.exists() else reason}")
    with tempfile.TemporaryDirectory(prefix="slurm-") as scratch:
        local, remote = (study(Path(scratch, name), options) for name in ("local", "remote"))
        done = local.run()
        if done.code:
            raise SystemExit(done.output)
        print("local run: done", flush=True)
        with cluster(Path(scratch)):
            start = time.perf_counter()
            done = remote.run(*OPTIONS, before=("timeout", "-k", "10", "900"))
            print(f"run on Slurm: exit code {done.code}, {time.perf_counter() - start:.0f} s", flush=True)
        expected, found = local.hashes(), remote.hashes()
        same = sum(found.get(name) == digest for name, digest in expected.items())
        jobs = done.output.count("has been submitted with SLURM jobid")
        print(f"{same} of {len(expected)} files identical, {jobs} Slurm jobs", flush=True)
        if done.code or same != len(expected):
            raise SystemExit(done.output)


if __name__ == "__main__":
    main()
