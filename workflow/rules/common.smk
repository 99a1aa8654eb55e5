# Functions of wildcards that rules ask.


def all_cores(wildcards):
    """However many the run has; asked for late, since `snakemake --report` has none."""
    return workflow.cores


def sets_of(wildcards):
    """Numbers of the seed sets of a block."""
    return list(range(int(wildcards.first), int(wildcards.first) + BLOCK))


def cylinders_of(wildcards):
    """Numbers of the cylinders of a block."""
    return list(range(int(wildcards.first), int(wildcards.first) + CYLINDER_BLOCK))
