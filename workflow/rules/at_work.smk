# Models at work in observers and controllers, paper/decisions/0049: `snakemake -j2 at_work`. What is done stays done.

# Experiments in open and in closed loop of each plant, and the number from which its seeds are drawn; "open" and
# "closed" are those of `pneumo init`.
AT_WORK = {
    "E05-E06": 0,
    "E09-E10": 1,
    "E13-E14": 2,
    "E07-E08": 3,
    "E11-E12": 4,
    "E15-E16": 5,
    "open-closed": 6,
}


rule at_work_block:
    input:
        parameters=rules.parameters.output[0],
        template="pneumo/selection/templates/cylinder.yaml",
    output:
        block="<results>/at_work/{plant}.nc",
    log:
        "<results>/logs/at_work_{plant}.log",
    wildcard_constraints:
        plant="|".join(AT_WORK),
    params:
        number=number_of_plant,
        code=code_behind("at_work_block.py"),
    message:
        "Models at work: experiments {wildcards.plant}"
    script:
        "../scripts/at_work_block.py"


rule at_work_statistics:
    input:
        parameters=rules.parameters.output[0],
        blocks=expand(rules.at_work_block.output, plant=AT_WORK),
    output:
        cells="<results>/at_work.nc",
    log:
        "<results>/logs/at_work.log",
    params:
        code=code_behind("at_work.py"),
    message:
        "Models at work: rank correlation of replay error and use"
    script:
        "../scripts/at_work.py"


rule at_work:
    input:
        rules.at_work_statistics.output,
        expand("<results>/figures/at_work.{kind}", kind=["svg", "png"]),


# The same with the full order, and with k_0 as a state, where a plant is known in part only: paper/decisions/0076.
PARTLY_KNOWN = {plant: (plant, number) for plant, number in AT_WORK.items()} | {
    "stick-slip": ("E09-E10", 7),
    "sagging-supply": ("E07-E08", 8),
}


rule partly_known_block:
    input:
        parameters=rules.parameters.output[0],
        template="pneumo/selection/templates/cylinder.yaml",
    output:
        block="<results>/partly_known/{plant}.nc",
    log:
        "<results>/logs/partly_known_{plant}.log",
    wildcard_constraints:
        plant="|".join(PARTLY_KNOWN),
    params:
        experiments=lambda wildcards: PARTLY_KNOWN[wildcards.plant][0],
        number=lambda wildcards: PARTLY_KNOWN[wildcards.plant][1],
        code=code_behind("partly_known_block.py"),
    message:
        "Models at work, known in part: {wildcards.plant}"
    script:
        "../scripts/partly_known_block.py"


rule partly_known:
    input:
        parameters=rules.parameters.output[0],
        blocks=expand(rules.partly_known_block.output, plant=PARTLY_KNOWN),
    output:
        cells="<results>/partly_known.nc",
    log:
        "<results>/logs/partly_known.log",
    params:
        code=code_behind("partly_known.py"),
    message:
        "Models at work, known in part: ratios by what is known"
    script:
        "../scripts/partly_known.py"
