# The study with a hundred sets of seeds; not part of it: `snakemake -j2 ensemble`. What is done stays done.

SEED_SETS = 100
BLOCK = 10  # sets in one job, some two minutes
BLOCKS = [f"{first:03}" for first in range(0, SEED_SETS, BLOCK)]


rule ensemble_block:
    input:
        parameters=rules.parameters.output[0],
    output:
        block="<results>/ensemble/{first}.nc",
    log:
        "<results>/logs/ensemble_{first}.log",
    wildcard_constraints:
        first=r"\d{3}",
    threads: all_cores
    params:
        sets=sets_of,
        of=SEED_SETS,
        code=code_behind("ensemble_block.py"),
    message:
        "Ensemble: sets of seeds from {wildcards.first} on"
    script:
        "../scripts/ensemble_block.py"


rule seed_sets:
    input:
        blocks=expand(rules.ensemble_block.output, first=BLOCKS),
    output:
        errors="<results>/seed_sets.nc",
    log:
        "<results>/logs/seed_sets.log",
    params:
        code=code_behind("seed_sets.py"),
    message:
        "Ensemble: errors of all sets of seeds in one file"
    script:
        "../scripts/seed_sets.py"


rule ensemble_statistics:
    input:
        parameters=rules.parameters.output[0],
        errors=kept("seed_sets.nc"),
    output:
        tables="<results>/ensemble.nc",
    log:
        "<results>/logs/ensemble_statistics.log",
    params:
        code=code_behind("ensemble_statistics.py"),
    message:
        "Ensemble: tables with their spread, models compared"
    script:
        "../scripts/ensemble_statistics.py"


rule findings:
    input:
        parameters=rules.parameters.output[0],
        errors=kept("seed_sets.nc"),
        claims="paper/2006/claims.yaml",
        published=expand("paper/2006/published/table{number}.csv", number=[5, 7, 8, 9]),
    output:
        findings="<results>/findings.json",
        table="<results>/findings.md",
        deviations="<results>/seed_deviations.csv",
    log:
        "<results>/logs/findings.log",
    params:
        code=code_behind("findings.py"),
    message:
        "Statements about models judged over the ensemble; how much seeds change each number"
    script:
        "../scripts/findings.py"


rule ensemble:
    input:
        rules.ensemble_statistics.output,
        expand("<results>/figures/ensemble.{kind}", kind=["svg", "png"]),
        rules.findings.output,
