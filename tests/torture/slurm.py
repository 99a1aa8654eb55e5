"""Run the smoke study through the Slurm profile on a real Slurm of one node; compare with a local run.

Needs Snakemake's slurm executor, and what `slurm_node` does.
"""

import tempfile
from pathlib import Path

from tests.torture.slurm_node import cluster, why_not
from tests.torture.study import Study

OPTIONS = (
    *("--profile", "workflow/profiles/slurm", "--cores", "2"),
    *("--slurm-no-account", "--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", "2", "--seconds-between-status-checks", "1"),
)


def main() -> None:
    """Run the study both ways and compare."""
    if reason := why_not():
        raise SystemExit(f"slurm-test: not run: {reason}")
    with tempfile.TemporaryDirectory(prefix="slurm-") as scratch:
        local, remote = (Study(Path(scratch, name), "config/smoke.yaml") for name in ("local", "remote"))
        done = local.run()
        if done.code:
            raise SystemExit(done.output)
        with cluster(Path(scratch)):
            done = remote.run(*OPTIONS, before=("timeout", "-k", "10", "3600"))
        if done.code:
            raise SystemExit(done.output)
        expected, hashes = local.hashes(), remote.hashes()
    different = sorted(name for name in expected.keys() | hashes if expected.get(name) != hashes.get(name))
    print(f"{len(expected)} files, different: {different or 'none'}")
    raise SystemExit(bool(different))


if __name__ == "__main__":
    main()
