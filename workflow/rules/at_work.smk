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
        block="results/at_work/{plant}.nc",
    log:
        "results/logs/at_work_{plant}.log",
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
        cells="results/at_work.nc",
    log:
        "results/logs/at_work.log",
    params:
        code=code_behind("at_work.py"),
    message:
        "Models at work: rank correlation of replay error and use"
    script:
        "../scripts/at_work.py"


rule at_work:
    input:
        rules.at_work_statistics.output,
        expand("results/figures/at_work.{kind}", kind=["svg", "png"]),
