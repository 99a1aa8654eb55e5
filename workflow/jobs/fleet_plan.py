"""Plan for a table of cylinders: its blocks, checked before any job starts, and the resources of each."""

import os
import sys
from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.configuration.cylinder_table import with_table
from pneumo.configuration.parameters import Sources, read_sources, study
from pneumo.configuration.plausible_cylinders import checked
from pneumo.configuration.schema import Configuration
from pneumo.errors import ConfigurationError, as_lines

# Of one core, per step and n of the grid: all models at three k_0; measured (docs/cluster.md).
SECONDS_PER_STEP = 5e-6
LEAKING = 20.0  # times longer if closed paths of the valve leak
MARGIN, START = 3.0, 300.0  # factor on the expected time; s, to import and compile
BYTES_PER_STEP, MEMORY = 500, 1000  # of the longest run, per thread; MB, of the process


class Fleet(NamedTuple):
    """The cylinders of a table in blocks; each block is a study of its own."""

    sources: Sources
    blocks: dict[str, list[str]]  # names of cylinders, by the number of the first
    planned: "dict[str, Resources]"  # by block, of those asked for

    def content(self, block: str) -> dict[str, Any]:
        """Return the configuration of a block's cylinders."""
        assert self.sources.table is not None
        return with_table(self.sources.content, self.sources.table, self.blocks[block])

    def resources(self, block: str) -> "Resources":
        """Return the resources that a block's job needs."""
        if block not in self.planned:
            self.planned[block] = resources(Sources(self.content(block)).validated())
        return self.planned[block]

    def signal_files(self) -> list[str]:
        """Return the files that hold signals of the experiments."""
        signals = [e.get("signal") or {} for e in self.sources.content["experiments"].values()]
        return [signal["file"] for signal in signals if "file" in signal]


class Resources(NamedTuple):
    """Resources of a job, with a margin."""

    seconds: float  # of one core
    bytes_per_thread: float

    def runtime(self, threads: int, attempt: int) -> int:
        """Time limit of the job, min, longer after each failed attempt."""
        return ceil(attempt * (START + MARGIN * self.seconds / threads) / 60)

    def mem_mb(self, threads: int, attempt: int) -> int:
        """Memory limit of the job, MB, larger after each failed attempt."""
        return ceil(attempt * (MEMORY + threads * self.bytes_per_thread / 1e6))


def resources(configuration: Configuration) -> Resources:
    """Return the resources that the runs of a configuration need, from their simulated time."""
    seconds, longest = 0.0, 0.0
    for name in configuration.chosen:
        steps = configuration.duration(name) / configuration.step_s
        valve = configuration.cylinders[configuration.experiments[name].cylinder].valve
        slow = LEAKING if valve and valve.leak_dm3_per_sbar else 1.0
        seconds += SECONDS_PER_STEP * slow * steps * configuration.run.seeds * len(configuration.n)
        longest = max(longest, steps)
    return Resources(seconds, BYTES_PER_STEP * longest)


def checked_fleet(
    config: Mapping[str, Any],
    files: Sequence[Path],
    options: Mapping[str, Any],
    *,
    check: bool,
    trust: bool = False,
) -> Fleet | None:
    """Return the fleet of Snakemake's configuration, or None if its cylinders are not in a table.

    The configuration is that of the `files` and ``--config`` `options` of the command line, without the
    paper's. With `check` every row is checked, which the jobs of a run need not repeat; `trust` accepts rows
    that are not plausible. If something is wrong, ends the process with exit code 2 and one line on standard
    error, or one for each wrong row.
    """
    if not isinstance(config["cylinders"], str):
        return None
    try:
        return _fleet(read_sources(*map(os.path.relpath, files), options=options), check, trust)
    except ConfigurationError as error:
        print(as_lines(error), file=sys.stderr)
        sys.exit(2)


def _fleet(sources: Sources, check: bool, trust: bool) -> Fleet:
    assert sources.table is not None
    if check:
        study(checked(sources, trust=trust))  # files of signals are read when units are converted
    names = list(sources.table.rows)
    first = Sources(with_table(sources.content, sources.table, names[:1]), sources.parts)
    size = first.validated().run.block_size
    return Fleet(sources, {f"{i:06}": names[i : i + size] for i in range(0, len(names), size)}, {})
