"""Time and memory of a command: ``python benchmarks/used.py COMMAND ...`` prints JSON.

A process of its own: Linux counts the memory of the process that starts a command as the command's.
"""

import json
import resource
import subprocess
import sys
import time
from typing import Any


def used(*command: str) -> dict[str, Any]:
    """Run a command; its exit code, output, times, s, and the memory of its largest process, MB."""
    begin = time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu, wall = usage.ru_utime + usage.ru_stime, time.perf_counter() - begin
    costs = {"wall_s": wall, "cpu_s": cpu, "peak_MB": usage.ru_maxrss / 1e3}
    return {"code": done.returncode, "output": done.stdout, "costs": costs}


if __name__ == "__main__":
    print(json.dumps(used(*sys.argv[1:])))
