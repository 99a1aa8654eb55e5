# Models at work in observers and controllers, paper/decisions/0049: `snakemake -j2 at_work`. What is done stays done.

# Experiments in open and in closed loop of each plant; "open" and "closed" are those of `pneumo init`.
AT_WORK = ["E05-E06", "E09-E10", "E13-E14", "E07-E08", "E11-E12", "E15-E16", "open-closed"]


rule at_work_block:
    input:
        parameters=rules.parameters.output[0],
        template="pneumo/engineer/templates/cylinder.yaml",
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
