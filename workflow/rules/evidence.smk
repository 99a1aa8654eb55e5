# What supports the assumptions; not part of the study: `snakemake -j2 evidence`, then `snakemake -j2` for the verdict.


rule assumptions:
    input:
        claims="paper/claims.yaml",
        assumptions="paper/assumptions.yaml",
        published=expand("paper/published/table{number}.csv", number=range(1, 10)),
    output:
        "results/assumptions.nc",
    log:
        "results/logs/assumptions.log",
    threads: workflow.cores
    params:
        configuration=config,
        code=code_behind("assumptions.py"),
    message:
        "Every assumption toggled: Tables 5, 7, 8 and 9 anew"
    script:
        "../scripts/assumptions.py"


rule assumptions_effects:
    input:
        assumptions=rules.assumptions.output[0],
        claims="paper/claims.yaml",
    output:
        table="results/assumptions.md",
        figure=expand("results/figures/assumptions.{kind}", kind=["svg", "png"]),
    log:
        "results/logs/assumptions_effects.log",
    params:
        code=code_behind("assumptions_effects.py"),
    message:
        "Effects of the assumptions: table and tornado plot"
    script:
        "../scripts/assumptions_effects.py"


rule evidence:
    input:
        rules.assumptions_effects.output,
