"""A Slurm of one node: needs root, Debian's slurm-wlm and munge.

Everything lives in a scratch folder, but for the link /etc/slurm/slurm.conf; all of it is taken down again.
"""

import os
import secrets
import shutil
import socket
import subprocess
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

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
KillWait=5
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=8000 State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def why_not() -> str:
    """Return why no Slurm can be started here, or nothing."""
    missing = [program for program in PROGRAMS if not shutil.which(program)]
    if missing:
        return f"no {missing[0]}: install slurm-wlm and munge"
    if LINK.exists():
        return f"{LINK} is there already"
    return "it must be root's to start" if os.geteuid() else ""


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
