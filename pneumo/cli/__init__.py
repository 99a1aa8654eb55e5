"""Command line."""

import os

# The matrices of a fit are tall and narrow: a second thread of BLAS would wait more than it works, and cost
# two thirds more processor time. It reads this once, when NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
