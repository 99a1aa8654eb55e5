# Functions of wildcards that rules ask.


def all_cores(wildcards):
    """However many the run has; asked for late, since `snakemake --report` has none."""
    return workflow.cores


def all_cores_but_one(wildcards):
    """All, if there is one only."""
    return max(1, workflow.cores - 1)


def sets_of(wildcards):
    """Numbers of the seed sets of a block."""
    return list(range(int(wildcards.first), int(wildcards.first) + BLOCK))


def kept(name):
    """Function for an input: the evidence in results, else the copy kept with the source, else to be made."""
    return lambda wildcards: kept_or_made(RESULTS, STUDY, name)


def code_now(*names):
    """Function for a parameter: the evidence that there is, and the code that would make it now."""
    return lambda wildcards: {
        file: EVIDENCE_CODE[name](wildcards) for name in names for file in evidence_for(RESULTS, STUDY, name)
    }


def cylinders_of(wildcards):
    """Numbers of the cylinders of a block."""
    return list(range(int(wildcards.first), int(wildcards.first) + CYLINDER_BLOCK))


def contest_cylinders_of(wildcards):
    """Numbers of the cylinders of a block of the contest."""
    return list(range(int(wildcards.first), int(wildcards.first) + CONTEST_BLOCK))
