"""Command line. Its functions import what they need, so that help and errors of usage are fast."""

import os
import sys

INTERRUPTED = 130  # exit code, as of shells: 128 and SIGINT
BROKEN_PIPE = 141  # 128 and SIGPIPE

# The matrices of a fit are tall and narrow: a second thread of BLAS would wait more than it works, and cost
# two thirds more processor time. It reads this once, when NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> None:
    """Run the command line; Ctrl-C ends it with one line, also during imports."""
    try:
        from pneumo.cli.commands import main as run

        run()
    except KeyboardInterrupt:
        print("pneumo: interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)
