# Functions of wildcards that rules ask.


def all_cores(wildcards):
    """However many the run has; asked for late, since `snakemake --report` has none."""
    return workflow.cores


def all_cores_but_one(wildcards):
    """All, if there is one only."""
    return max(1, workflow.cores - 1)
