"""Functions that the Snakefile and every job of the workflow need."""
