# Random cylinders of catalogue sizes, paper/decisions/0029: `snakemake -j2 cylinders`. What is done stays done.

CYLINDERS, COMPARED = 2000, 1000  # all; those over which models are compared, the others are held out
CYLINDER_BLOCK = 50  # in one job, one or two minutes
CYLINDER_BLOCKS = [f"{first:04}" for first in range(0, CYLINDERS, CYLINDER_BLOCK)]


rule cylinders_block:
    output:
        block="<results>/cylinders/{first}.nc",
    log:
        "<results>/logs/cylinders_{first}.log",
    wildcard_constraints:
        first=r"\d{4}",
    threads: all_cores
    params:
        numbers=cylinders_of,
        code=code_behind("cylinders_block.py"),
    message:
        "Random cylinders from {wildcards.first} on"
    script:
        "../scripts/cylinders_block.py"


rule cylinders_analysis:
    input:
        blocks=expand("<results>/cylinders/{first}.nc", first=CYLINDER_BLOCKS),
    output:
        cells="<results>/cylinders.nc",
    log:
        "<results>/logs/cylinders.log",
    params:
        compared=COMPARED,
        code=code_behind("cylinders.py"),
    message:
        "Random cylinders: models compared"
    script:
        "../scripts/cylinders.py"


rule cylinders:
    input:
        rules.cylinders_analysis.output,
        expand("<results>/figures/regimes.{kind}", kind=["svg", "png"]),


# The full order in the contest, paper/decisions/0075: `snakemake -j2 contest`. Blocks come in turn from both halves.
CONTEST_BLOCK = 10  # cylinders in one job, one or two minutes on one core
CONTESTED = 1000  # cylinders of each half
CONTEST_BLOCKS = [
    f"{first + half:04}" for first in range(0, CONTESTED, CONTEST_BLOCK) for half in (0, COMPARED)
]


rule contest_block:
    output:
        block="<results>/contest/{first}.nc",
    log:
        "<results>/logs/contest_{first}.log",
    wildcard_constraints:
        first=r"\d{4}",
    params:
        numbers=contest_cylinders_of,
        code=code_behind("contest_block.py"),
    message:
        "The full order in the contest: random cylinders from {wildcards.first} on"
    script:
        "../scripts/contest_block.py"


rule contest_paper:
    input:
        parameters=rules.parameters.output[0],
    output:
        runs="<results>/contest_paper.nc",
    log:
        "<results>/logs/contest_paper.log",
    params:
        code=code_behind("contest_paper.py"),
    message:
        "The full order in the contest: the paper's experiments, 60 s each"
    script:
        "../scripts/contest_paper.py"


rule contest:
    input:
        blocks=expand(rules.contest_block.output, first=CONTEST_BLOCKS),
        paper=rules.contest_paper.output.runs,
        rule=kept("cylinders.nc"),
    output:
        cells="<results>/contest.nc",
    log:
        "<results>/logs/contest.log",
    params:
        compared=COMPARED,
        code=code_behind("contest.py"),
    message:
        "The full order in the contest: tables of the half held out"
    script:
        "../scripts/contest.py"
